// A server that does what a test says: it takes connections, welcomes them, and keeps each request until it is asked for.
import { create, fromBinary, type MessageInitShape, toBinary } from "@bufbuild/protobuf";
import { once } from "node:events";
import type { AddressInfo } from "node:net";
import { type WebSocket, WebSocketServer } from "ws";
import type { RequestKind } from "../../src/index.js";
import type { Update } from "../../src/connection.js";
import {
  type ClientMessage,
  ClientMessageSchema,
  Error_Code,
  ErrorSchema,
  type ServerMessage,
  ServerMessageSchema,
  SubscribedSchema,
  WelcomeSchema,
} from "../../proto/pneuma/v1/session_pb.js";

type Value<Kind> = Extract<ClientMessage["request"], { case: Kind }> extends { value: infer V } ? V : never;

/** A request that waits for its reply. */
export class Asked<Kind extends RequestKind = RequestKind> {
  constructor(
    private readonly peer: Peer,
    private readonly requestId: bigint,
    readonly kind: Kind,
    readonly value: Value<Kind>,
  ) {}

  reply(message: Update): void {
    this.peer.send(message, this.requestId);
  }

  subscribed(streamId: number): void {
    this.reply({ case: "subscribed", value: create(SubscribedSchema, { streamId, gridStepM: 0.001 }) });
  }

  refuse(code: keyof typeof Error_Code, retryAfterS = 0): void {
    this.reply({ case: "error", value: create(ErrorSchema, { code: Error_Code[code], what: "as told", retryAfterS }) });
  }
}

/** One of a server's connections. */
export class Peer {
  private readonly requests: Asked[] = [];
  private readonly waiting: ((asked: Asked) => void)[] = [];

  constructor(
    private readonly socket: WebSocket,
    welcome: MessageInitShape<typeof WelcomeSchema>,
  ) {
    socket.on("message", (bytes: Buffer) => {
      const { requestId, request } = fromBinary(ClientMessageSchema, bytes);
      const asked = new Asked(this, requestId, request.case!, request.value as never);
      if (asked.kind === "hello") return asked.reply({ case: "welcome", value: create(WelcomeSchema, welcome) });
      const take = this.waiting.shift();
      if (take) take(asked);
      else this.requests.push(asked);
    });
  }

  /** The next request, which must be of this kind. */
  async next<Kind extends RequestKind>(kind: Kind): Promise<Asked<Kind>> {
    const asked = this.requests.shift() ?? (await new Promise<Asked>((resolve) => this.waiting.push(resolve)));
    if (asked.kind !== kind) throw new Error(`${asked.kind}, not ${kind}`);
    return asked as unknown as Asked<Kind>;
  }

  /** Unasked, or as the reply to a request. */
  send(message: Update, requestId = 0n): void {
    const value: ServerMessage = create(ServerMessageSchema, { requestId, message });
    this.socket.send(toBinary(ServerMessageSchema, value));
  }

  /** Breaks the connection. */
  drop(): void {
    this.socket.terminate();
  }
}

export class ScriptedServer {
  /** What those that connect from now on are told. */
  welcome: MessageInitShape<typeof WelcomeSchema> = { messageBytesMax: 1 << 20 };
  private readonly peers: Peer[] = [];
  private readonly waiting: ((peer: Peer) => void)[] = [];

  private constructor(private readonly sockets: WebSocketServer) {
    sockets.on("connection", (socket) => {
      const peer = new Peer(socket, this.welcome);
      const take = this.waiting.shift();
      if (take) take(peer);
      else this.peers.push(peer);
    });
  }

  static async start(): Promise<ScriptedServer> {
    const sockets = new WebSocketServer({ host: "127.0.0.1", port: 0 });
    await once(sockets, "listening");
    return new ScriptedServer(sockets);
  }

  get url(): string {
    return `ws://127.0.0.1:${(this.sockets.address() as AddressInfo).port}/ws`;
  }

  /** The next connection to come. */
  async peer(): Promise<Peer> {
    return this.peers.shift() ?? new Promise((resolve) => this.waiting.push(resolve));
  }

  close(): void {
    for (const socket of this.sockets.clients) socket.terminate();
    this.sockets.close();
  }
}
