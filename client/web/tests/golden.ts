// The golden vectors of the wire: tests/golden/README.md says how they are written.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import type { Triangles } from "../src/codec/mesh_order.js";
import type { Mechanics } from "../src/codec/simulated_motion.js";

export interface GoldenFrame {
  readonly payload: Uint8Array;
  readonly isKey: boolean;
  /** By body; undefined: the frame must be refused. */
  readonly points?: readonly number[][];
}

export interface GoldenStream {
  readonly name: string;
  readonly gridStepM: number;
  readonly meshes: readonly Triangles[];
  /** By body; undefined: it is not simulated. */
  readonly mechanics: readonly (Mechanics | undefined)[];
  readonly frames: readonly GoldenFrame[];
}

function numbers(text: string): number[] {
  return text.split(" ").filter(Boolean).map(Number);
}

export function readGolden(name: string): string {
  return readFileSync(join(process.env["PNEUMA_SOURCE"] ?? "../..", "tests/golden", name), "utf8");
}

const mechanicsKeys = [
  "frame_s",
  "substeps",
  "masses_kg",
  "rest_lengths_m",
  "stiffnesses_n_m",
  "damping_n_s_m",
  "gas",
  "gravity_m_s2",
  "plane",
];

/** What these lines of a body, keys and values, say of its mechanics; undefined: nothing. */
export function mechanicsIn(lines: readonly (readonly [string, string])[]): Mechanics | undefined {
  const all = (key: string) => lines.filter(([name]) => name === key).map(([, value]) => numbers(value));
  const one = (key: string) => all(key)[0]!;
  if (all("frame_s").length === 0) return undefined;
  const [pressurePa, volumeM3, exponent65536ths, outsidePa] = one("gas") as [number, number, number, number];
  return {
    frameS: one("frame_s")[0]!,
    substeps: one("substeps")[0]!,
    massesKg: one("masses_kg"),
    restLengthsM: one("rest_lengths_m"),
    stiffnessesNM: one("stiffnesses_n_m"),
    dampingNSM: one("damping_n_s_m")[0]!,
    gas: { pressurePa, volumeM3, exponent65536ths, outsidePa },
    gravityMS2: one("gravity_m_s2"),
    planes: all("plane").map(([x, y, z, offsetM, restitution, friction]) => ({
      normal: [x!, y!, z!],
      offsetM: offsetM!,
      restitution: restitution!,
      friction: friction!,
    })),
  };
}

/** Throws where a line is of no kind that it knows, so that a vector of a new kind is not passed over. */
export function goldenStreams(): GoldenStream[] {
  return ["frames.txt", "simulated_frames.txt"].flatMap(streamsIn);
}

function streamsIn(name: string): GoldenStream[] {
  const streams: {
    name: string;
    gridStepM: number;
    meshes: Triangles[];
    lines: [string, string][][];
    frames: (GoldenFrame & { points?: number[][] })[];
  }[] = [];
  for (const line of readGolden(name).split("\n")) {
    if (line === "" || line.startsWith("#")) continue;
    const [key, ...words] = line.split(" ");
    const value = words.join(" ");
    const stream = streams.at(-1);
    if (key === "stream") {
      streams.push({ name: value, gridStepM: 1, meshes: [], lines: [], frames: [] });
    } else if (key === "grid_step_m") {
      stream!.gridStepM = Number(value);
    } else if (mechanicsKeys.includes(key!)) {
      stream!.lines.at(-1)!.push([key!, value]);
    } else if (key === "mesh") {
      const [vertexCount, ...indices] = numbers(value);
      stream!.meshes.push({ vertexCount: vertexCount!, indices });
      stream!.lines.push([]);
    } else if (key === "key" || key === "delta") {
      stream!.frames.push({ payload: Buffer.from(value, "hex"), isKey: key === "key", points: [] });
    } else if (key === "bad-key" || key === "bad-delta") {
      stream!.frames.push({ payload: Buffer.from(value, "hex"), isKey: key === "bad-key" });
    } else if (key === "points") {
      stream!.frames.at(-1)!.points!.push(numbers(value));
    } else {
      throw new Error(`${name}: ${line}`);
    }
  }
  return streams.map((stream) => ({ ...stream, mechanics: stream.lines.map(mechanicsIn) }));
}
