// Moves of a body's vertices from their prediction and residuals: proto/WIRE.md, "Prediction". Whole numbers of 32 bits
// that wrap around; x y z of each slot, one after the other.
import type { MeshOrder } from "./mesh_order.js";
import { levelMax, levelOf, sizeOf } from "./residual_tables.js";
import type { TripleReader } from "./triple_reader.js";

/** The last four moves of each slot, the last one first. */
export type Moves = readonly [Int32Array, Int32Array, Int32Array, Int32Array];

/** a1 to a4, b1 to b4, c. */
export type Weights = Int32Array;
const weightTriples = 3;
const weightLevel = 44;

const sizeMax = 1 << 24;

export function takeWeights(triples: TripleReader): Weights {
  const weights = new Int32Array(3 * weightTriples);
  for (let i = 0; i < weightTriples && !triples.failed(); ++i) {
    triples.take(weightLevel);
    weights.set([triples.x, triples.y, triples.z], 3 * i);
  }
  return weights;
}

/** Sums up what each slot's neighbours have more than it. */
function ringSums({ size, rings }: MeshOrder, values: Int32Array): Int32Array {
  const sums = new Int32Array(values.length);
  const { begins, entries } = rings;
  for (let slot = 0; slot < size; ++slot) {
    const begin = begins[slot]!;
    const end = begins[slot + 1]!;
    let x = 0;
    let y = 0;
    let z = 0;
    for (let at = begin; at < end; ++at) {
      const from = 3 * entries[at]!;
      x = (x + values[from]!) | 0;
      y = (y + values[from + 1]!) | 0;
      z = (z + values[from + 2]!) | 0;
    }
    const to = 3 * slot;
    sums[to] = x - Math.imul(end - begin, values[to]!);
    sums[to + 1] = y - Math.imul(end - begin, values[to + 1]!);
    sums[to + 2] = z - Math.imul(end - begin, values[to + 2]!);
  }
  return sums;
}

/** The drift of each slot, in 16ths of a step. */
export function predictDrift(order: MeshOrder, [m1, m2, m3, m4]: Moves, weights: Weights): Int32Array {
  const [a1 = 0, a2 = 0, a3 = 0, a4 = 0, b1 = 0, b2 = 0, b3 = 0, b4 = 0, c = 0] = weights;
  const flow = c === 0 ? new Int32Array(m1.length) : ringSums(order, m1);
  for (let i = 0; i < flow.length; ++i) {
    const own = Math.imul(b1, m1[i]!) + Math.imul(b2, m2[i]!) + Math.imul(b3, m3[i]!) + Math.imul(b4, m4[i]!);
    flow[i] = own + Math.imul(c, flow[i]!);
  }
  const drift = ringSums(order, flow);
  for (let i = 0; i < drift.length; ++i) {
    const own = Math.imul(a1, m1[i]!) + Math.imul(a2, m2[i]!) + Math.imul(a3, m3[i]!) + Math.imul(a4, m4[i]!);
    drift[i] = ((own << 3) + drift[i]! + 32) >> 6;
  }
  return drift;
}

/** Reads a list of moves. Where the text ends early, the reader has failed and the rest is 0. */
export function takeMoves(order: MeshOrder, level: number, drift: Int32Array, triples: TripleReader): Int32Array {
  const moves = new Int32Array(drift.length);
  const errors = new Int32Array(drift.length);
  const sizes = new Int32Array(order.size);
  const listSize = sizeOf(level);
  const { begins, entries } = order.parents;
  for (let slot = 0; slot < order.size && !triples.failed(); ++slot) {
    const to = 3 * slot;
    const driftX = drift[to]!;
    const driftY = drift[to + 1]!;
    const driftZ = drift[to + 2]!;
    let x = driftX;
    let y = driftY;
    let z = driftZ;
    let size = listSize;
    const begin = begins[slot]!;
    const count = begins[slot + 1]! - begin;
    if (count > 0) {
      let errorX = 0;
      let errorY = 0;
      let errorZ = 0;
      let sizeSum = 0;
      for (let at = begin; at < begin + count; ++at) {
        const parent = entries[at]!;
        errorX = (errorX + errors[3 * parent]!) | 0;
        errorY = (errorY + errors[3 * parent + 1]!) | 0;
        errorZ = (errorZ + errors[3 * parent + 2]!) | 0;
        sizeSum += sizes[parent]!;
      }
      // Quotients of doubles are exact enough: they are no nearer to a whole number than a sixth, or are one.
      x += Math.floor(errorX / count);
      y += Math.floor(errorY / count);
      z += Math.floor(errorZ / count);
      size += 4 * Math.floor(sizeSum / count);
    }
    triples.take(Math.min(levelOf(size), levelMax));
    const { x: residualX, y: residualY, z: residualZ } = triples;
    const moveX = (((x + 8) >> 4) + residualX) | 0;
    const parity = moveX & 1;
    const centre = 16 - 16 * parity;
    const moveY = ((((y + centre) >> 5) + residualY) * 2 + parity) | 0;
    const moveZ = ((((z + centre) >> 5) + residualZ) * 2 + parity) | 0;
    moves[to] = moveX;
    moves[to + 1] = moveY;
    moves[to + 2] = moveZ;
    errors[to] = (moveX << 4) - driftX;
    errors[to + 1] = (moveY << 4) - driftY;
    errors[to + 2] = (moveZ << 4) - driftZ;
    sizes[slot] = Math.min(4 * (Math.abs(residualX) + 2 * (Math.abs(residualY) + Math.abs(residualZ))), sizeMax);
  }
  return moves;
}
