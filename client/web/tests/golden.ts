// The golden vectors of the wire: tests/golden/README.md says how they are written.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import type { Triangles } from "../src/codec/mesh_order.js";
import type { Mechanics } from "../src/codec/simulated_motion.js";

export interface GoldenFrame {
  readonly payload: Uint8Array;
  readonly isKey: boolean;
  /** Otherwise it must be refused. */
  readonly isGood: boolean;
  /** By body; undefined: they are not told. */
  readonly points?: readonly number[][];
  readonly check?: number;
}

export interface GoldenStream {
  readonly name: string;
  readonly gridStepM: number;
  readonly meshes: readonly Triangles[];
  /** By body; undefined: it is not simulated. */
  readonly mechanics: readonly (Mechanics | undefined)[];
  readonly frames: readonly GoldenFrame[];
}

/** A body that is simulated frame by frame. */
export interface GoldenBody {
  readonly name: string;
  /** Otherwise its mechanics must be refused. */
  readonly isGood: boolean;
  readonly mesh: Triangles;
  readonly mechanics: Mechanics;
  readonly gridStepM: number;
  /** At the start, as those after each frame: three numbers a slot. */
  readonly points: readonly number[];
  readonly velocities: readonly number[];
  readonly frames: readonly {
    readonly drift: readonly number[];
    readonly moves: readonly number[];
    readonly velocities: readonly number[];
  }[];
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

/** Of a path: 0 0 1, 1 1 2 and so on. */
function pathOf(vertexCount: number): Triangles {
  const indices = Array.from({ length: vertexCount - 1 }, (_, i) => [i, i, i + 1]).flat();
  return { vertexCount, indices };
}

function meshOf(text: string): Triangles {
  const [vertexCount, ...indices] = numbers(text);
  return { vertexCount: vertexCount!, indices };
}

export function goldenBodies(): GoldenBody[] {
  const records = readGolden("simulated_motion.txt")
    .split("\n\n")
    .map((record) => record.split("\n").filter((line) => line !== "" && !line.startsWith("#")))
    .filter((lines) => lines.length > 0)
    .map((lines) => lines.map((line): [string, string] => [line.split(" ", 1)[0]!, line.slice(line.indexOf(" ") + 1)]));
  return records.map((record) => {
    const all = (key: string) => record.filter(([name]) => name === key).map(([, value]) => numbers(value));
    const [first, name] = record[0]!;
    const mesh = meshOf(record.find(([key]) => key === "mesh")![1]);
    const [points = [], ...rest] = all("points");
    const [velocities = [], ...after] = all("velocities");
    if (rest.length > 0) throw new Error(`simulated_motion.txt: ${name} has points twice`);
    const [drifts, moves] = [all("drift"), all("moves")];
    const frames = drifts.map((drift, i) => ({ drift, moves: moves[i]!, velocities: after[i]! }));
    const [gridStepM] = all("grid_step_m")[0]!;
    const mechanics = mechanicsIn(record)!;
    return { name, isGood: first === "body", mesh, mechanics, gridStepM: gridStepM!, points, velocities, frames };
  });
}

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
    frames: (GoldenFrame & { points?: number[][]; check?: number })[];
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
    } else if (key === "mesh" || key === "path") {
      stream!.meshes.push(key === "mesh" ? meshOf(value) : pathOf(Number(value)));
      stream!.lines.push([]);
    } else if (["key", "delta", "bad-key", "bad-delta"].includes(key!)) {
      const isGood = !key!.startsWith("bad-");
      stream!.frames.push({ payload: Buffer.from(value, "hex"), isKey: key!.endsWith("key"), isGood });
    } else if (key === "points") {
      (stream!.frames.at(-1)!.points ??= []).push(numbers(value));
    } else if (key === "check") {
      stream!.frames.at(-1)!.check = Number(value);
    } else {
      throw new Error(`${name}: ${line}`);
    }
  }
  return streams.map((stream) => ({ ...stream, mechanics: stream.lines.map(mechanicsIn) }));
}
