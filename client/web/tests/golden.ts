// The golden vectors of the wire: tests/golden/README.md says how they are written.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import type { Triangles } from "../src/codec/mesh_order.js";

export interface GoldenFrame {
  readonly payload: Uint8Array;
  readonly isKey: boolean;
  /** By body; undefined: the frame must be refused. */
  readonly points?: readonly number[][];
}

export interface GoldenStream {
  readonly name: string;
  readonly meshes: readonly Triangles[];
  readonly frames: readonly GoldenFrame[];
}

function numbers(text: string): number[] {
  return text.split(" ").filter(Boolean).map(Number);
}

/** Throws where a line is of no kind that it knows, so that a vector of a new kind is not passed over. */
export function goldenStreams(): GoldenStream[] {
  const streams: { name: string; meshes: Triangles[]; frames: (GoldenFrame & { points?: number[][] })[] }[] = [];
  const path = join(process.env["PNEUMA_SOURCE"] ?? "../..", "tests/golden/frames.txt");
  for (const line of readFileSync(path, "utf8").split("\n")) {
    if (line === "" || line.startsWith("#")) continue;
    const [key, ...words] = line.split(" ");
    const value = words.join(" ");
    const stream = streams.at(-1);
    if (key === "stream") {
      streams.push({ name: value, meshes: [], frames: [] });
    } else if (key === "mesh") {
      const [vertexCount, ...indices] = numbers(value);
      stream!.meshes.push({ vertexCount: vertexCount!, indices });
    } else if (key === "key" || key === "delta") {
      stream!.frames.push({ payload: Buffer.from(value, "hex"), isKey: key === "key", points: [] });
    } else if (key === "bad-key" || key === "bad-delta") {
      stream!.frames.push({ payload: Buffer.from(value, "hex"), isKey: key === "bad-key" });
    } else if (key === "points") {
      stream!.frames.at(-1)!.points!.push(numbers(value));
    } else {
      throw new Error(`frames.txt: ${line}`);
    }
  }
  return streams;
}
