// The golden vectors of frames and simulated bodies, run through a decoder that may not be the one under src/.
import type * as frameReader from "../src/codec/frame_reader.js";
import type * as meshOrder from "../src/codec/mesh_order.js";
import type * as simulatedMotion from "../src/codec/simulated_motion.js";
import { type GoldenBody, goldenBodies, type GoldenStream, goldenStreams } from "./golden.js";

/** The modules of a decoder. */
export interface Codec {
  readonly FrameReader: typeof frameReader.FrameReader;
  readonly makeMeshOrder: typeof meshOrder.makeMeshOrder;
  readonly SimulatedMotion: typeof simulatedMotion.SimulatedMotion;
  readonly checkMechanics: typeof simulatedMotion.checkMechanics;
}

type FrameReader = frameReader.FrameReader;

const refusals = ["MALFORMED", "UNSUPPORTED", "WRONG_STATE"];

function isRefusal(error: unknown): boolean {
  return refusals.includes((error as { code?: string } | undefined)?.code ?? "");
}

/** Whether it threw a refusal; an error of any other kind goes on up. */
function refuses(action: () => void): boolean {
  try {
    action();
    return false;
  } catch (error) {
    if (isRefusal(error)) return true;
    throw error;
  }
}

export function readerOf(codec: Codec, stream: GoldenStream): FrameReader {
  const orders = stream.meshes.map(codec.makeMeshOrder);
  const simulations = stream.mechanics.map((own, body) => {
    return own && new codec.SimulatedMotion(orders[body]!, stream.meshes[body]!, own, stream.gridStepM);
  });
  return new codec.FrameReader(orders, simulations);
}

export function pointsOf(reader: FrameReader, stream: GoldenStream): number[][] {
  return stream.meshes.map(({ vertexCount }, body) => {
    const points = new Float64Array(3 * vertexCount);
    reader.positions(body, 1, points);
    return [...points];
  });
}

function areSame(ours: ArrayLike<number>, theirs: ArrayLike<number>): boolean {
  return ours.length === theirs.length && Array.from(ours).every((value, i) => value === theirs[i]);
}

function arePoints(reader: FrameReader, stream: GoldenStream, expected: readonly (readonly number[])[]): boolean {
  return pointsOf(reader, stream).every((points, body) => areSame(points, expected[body]!));
}

/** The first frame that is not as it should be. Each key frame is read by a new reader, too: it stands alone. */
function wrongFrame(codec: Codec, stream: GoldenStream): string | undefined {
  const reader = readerOf(codec, stream);
  let fresh = reader;
  for (const [place, { payload, isKey, isGood, points, check }] of stream.frames.entries()) {
    if (isKey && isGood) fresh = readerOf(codec, stream);
    for (const each of new Set([reader, fresh])) {
      const expected = isGood ? points : pointsOf(each, stream);
      const isRefused = refuses(() => each.read(payload, isKey ? undefined : 0, 0, check));
      const isWrong = isRefused === isGood || (expected && !arePoints(each, stream, expected));
      if (isWrong) return `${stream.name}, frame ${place}`;
    }
  }
  return undefined;
}

/** The first frame of a simulated body that is not as it should be, or that it is taken though it should not. */
function wrongBody(codec: Codec, { name, isGood, mesh, mechanics, gridStepM, frames, ...start }: GoldenBody) {
  const order = codec.makeMeshOrder(mesh);
  if (refuses(() => codec.checkMechanics(order, mechanics, gridStepM)) === isGood) return `${name}, taken or not`;
  if (!isGood) return undefined;
  const motion = new codec.SimulatedMotion(order, mesh, mechanics, gridStepM);
  const points = Float64Array.from(start.points);
  let velocities: Int32Array = Int32Array.from(start.velocities);
  const drift = new Int32Array(points.length);
  for (const [place, frame] of frames.entries()) {
    motion.predict(points, velocities, drift);
    if (!areSame(drift, frame.drift)) return `${name}, drift of frame ${place}`;
    velocities = motion.correct(Int32Array.from(frame.moves));
    if (!areSame(velocities, frame.velocities)) return `${name}, velocities of frame ${place}`;
    for (const [i, move] of frame.moves.entries()) points[i]! += move;
  }
  return undefined;
}

const streams = goldenStreams();
const bodies = goldenBodies();

/** What of the golden vectors this decoder gets wrong first; undefined: nothing. */
export function firstWrong(codec: Codec): string | undefined {
  for (const body of bodies) {
    const wrong = wrongBody(codec, body);
    if (wrong) return wrong;
  }
  for (const stream of streams) {
    const wrong = wrongFrame(codec, stream);
    if (wrong) return wrong;
  }
  return undefined;
}
