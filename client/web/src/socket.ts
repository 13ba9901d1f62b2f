// A WebSocket in a browser, in a Node that has one, or from the package `ws`.
import { PneumaError } from "./errors.js";

/** What a connection needs of a WebSocket; `ws` and browsers have the same. */
export interface Socket {
  binaryType: string;
  onopen: (() => void) | null;
  onmessage: ((event: { data: unknown }) => void) | null;
  onclose: ((event: { code: number; reason: string }) => void) | null;
  onerror: (() => void) | null;
  send(data: Uint8Array): void;
  close(): void;
}

/** Throws PneumaError: INVALID_ARGUMENT for an address that is none, UNSUPPORTED without any WebSocket. */
export async function openSocket(url: string): Promise<Socket> {
  const make = (globalThis as { WebSocket?: new (url: string) => unknown }).WebSocket ?? (await fromPackage());
  try {
    const socket = new make(url) as Socket;
    socket.binaryType = "arraybuffer";
    return socket;
  } catch (error) {
    throw new PneumaError("INVALID_ARGUMENT", (error as Error).message, "url");
  }
}

async function fromPackage(): Promise<new (url: string) => unknown> {
  try {
    return (await import("ws")).WebSocket;
  } catch {
    throw new PneumaError("UNSUPPORTED", "no WebSocket here; before version 22, Node needs the package ws");
  }
}
