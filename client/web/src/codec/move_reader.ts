// Moves of a body's vertices from their prediction and residuals: proto/WIRE.md, "Prediction". Whole numbers of 32 bits
// that wrap around; x y z of each slot, one after the other.
import { type MeshOrder, parentsMax } from "./mesh_order.js";
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
  triples.take(new Uint8Array(weightTriples).fill(weightLevel), 0, weightTriples, weights);
  return weights;
}

/** Arrays that reading a block needs for a while; of the largest body so far. */
export class Scratch {
  flow = new Int32Array(0);
  drift = new Int32Array(0);
  levels = new Uint8Array(0);
  residuals = new Int32Array(0);
  // Of what was found at each slot; entry 0 is of nothing.
  sizes = new Int32Array(1);
  errors = new Int32Array(3);

  fit(slots: number): void {
    if (this.levels.length >= slots) return;
    this.flow = new Int32Array(3 * slots);
    this.drift = new Int32Array(3 * slots);
    this.levels = new Uint8Array(slots);
    this.residuals = new Int32Array(3 * slots);
    this.sizes = new Int32Array(1 + slots);
    this.errors = new Int32Array(3 * (1 + slots));
  }
}

/** Writes the drift of each slot, in 16ths of a step. */
export function predictDrift(order: MeshOrder, moves: Moves, weights: Weights, { flow, drift }: Scratch): void {
  const [m1, m2, m3, m4] = moves;
  const [a1 = 0, a2 = 0, a3 = 0, a4 = 0, b1 = 0, b2 = 0, b3 = 0, b4 = 0, c = 0] = weights;
  const { begins, entries } = order.rings;
  if (c === 0) flow.fill(0);
  for (let slot = 0; slot < order.size && c !== 0; ++slot) {
    const at = 3 * slot;
    const begin = begins[slot]!;
    const end = begins[slot + 1]!;
    let x = Math.imul(begin - end, m1[at]!);
    let y = Math.imul(begin - end, m1[at + 1]!);
    let z = Math.imul(begin - end, m1[at + 2]!);
    for (let i = begin; i < end; ++i) {
      const near = 3 * entries[i]!;
      x = (x + m1[near]!) | 0;
      y = (y + m1[near + 1]!) | 0;
      z = (z + m1[near + 2]!) | 0;
    }
    flow[at] = Math.imul(c, x);
    flow[at + 1] = Math.imul(c, y);
    flow[at + 2] = Math.imul(c, z);
  }
  for (let i = 0; i < m1.length; ++i) {
    const n1 = m1[i]!;
    const n2 = m2[i]!;
    const n3 = m3[i]!;
    const n4 = m4[i]!;
    const ofRing = Math.imul(b1, n1) + Math.imul(b2, n2) + Math.imul(b3, n3) + Math.imul(b4, n4);
    flow[i]! += ofRing;
    drift[i] = (Math.imul(a1, n1) + Math.imul(a2, n2) + Math.imul(a3, n3) + Math.imul(a4, n4)) << 3;
  }
  for (let slot = 0; slot < order.size; ++slot) {
    const at = 3 * slot;
    const begin = begins[slot]!;
    const end = begins[slot + 1]!;
    let x = (drift[at]! + Math.imul(begin - end, flow[at]!)) | 0;
    let y = (drift[at + 1]! + Math.imul(begin - end, flow[at + 1]!)) | 0;
    let z = (drift[at + 2]! + Math.imul(begin - end, flow[at + 2]!)) | 0;
    for (let i = begin; i < end; ++i) {
      const near = 3 * entries[i]!;
      x = (x + flow[near]!) | 0;
      y = (y + flow[near + 1]!) | 0;
      z = (z + flow[near + 2]!) | 0;
    }
    drift[at] = (x + 32) >> 6;
    drift[at + 1] = (y + 32) >> 6;
    drift[at + 2] = (z + 32) >> 6;
  }
}

// So that 1 / n of a multiple of n is not a little less than whole: less than the sixth by which other quotients are
// above a whole number, more than the rounding of 2^32 / n.
const nudge = 2 ** -10;
const reciprocals = Float64Array.from({ length: parentsMax + 1 }, (_, count) => 1 / Math.max(count, 1));

/** Run by run: what the level of a slot is found from was taken before. */
function takeResiduals(order: MeshOrder, level: number, scratch: Scratch, triples: TripleReader): void {
  const { levels, residuals, sizes } = scratch;
  const { parents, parentCounts } = order;
  const listSize = sizeOf(level);
  let begin = 0;
  for (const end of order.runEnds) {
    for (let slot = begin, at = parentsMax * begin; slot < end; ++slot, at += parentsMax) {
      const sum =
        sizes[parents[at]!]! +
        sizes[parents[at + 1]!]! +
        sizes[parents[at + 2]!]! +
        sizes[parents[at + 3]!]! +
        sizes[parents[at + 4]!]! +
        sizes[parents[at + 5]!]!;
      const mean = Math.floor(sum * reciprocals[parentCounts[slot]!]! + nudge);
      levels[slot] = Math.min(levelOf(listSize + 4 * mean), levelMax);
    }
    triples.take(levels, begin, end, residuals);
    if (triples.failed()) return;
    for (let slot = begin, at = 3 * begin; slot < end; ++slot, at += 3) {
      const size = Math.abs(residuals[at]!) + 2 * (Math.abs(residuals[at + 1]!) + Math.abs(residuals[at + 2]!));
      sizes[slot + 1] = Math.min(4 * size, sizeMax);
    }
    begin = end;
  }
}

/** Reads a list of moves, with the drift in `scratch`. Where the text ends early, the reader has failed. */
export function takeMoves(order: MeshOrder, level: number, scratch: Scratch, triples: TripleReader): Int32Array {
  const moves = new Int32Array(3 * order.size);
  takeResiduals(order, level, scratch, triples);
  if (triples.failed()) return moves;
  const { drift, errors, residuals } = scratch;
  const { parents, parentCounts } = order;
  for (let slot = 0; slot < order.size; ++slot) {
    const first = parentsMax * slot;
    const p0 = 3 * parents[first]!;
    const p1 = 3 * parents[first + 1]!;
    const p2 = 3 * parents[first + 2]!;
    const p3 = 3 * parents[first + 3]!;
    const p4 = 3 * parents[first + 4]!;
    const p5 = 3 * parents[first + 5]!;
    const sumX = (errors[p0]! + errors[p1]! + errors[p2]! + errors[p3]! + errors[p4]! + errors[p5]!) | 0;
    const sumY =
      (errors[p0 + 1]! + errors[p1 + 1]! + errors[p2 + 1]! + errors[p3 + 1]! + errors[p4 + 1]! + errors[p5 + 1]!) | 0;
    const sumZ =
      (errors[p0 + 2]! + errors[p1 + 2]! + errors[p2 + 2]! + errors[p3 + 2]! + errors[p4 + 2]! + errors[p5 + 2]!) | 0;
    const share = reciprocals[parentCounts[slot]!]!;
    const at = 3 * slot;
    const driftX = drift[at]!;
    const driftY = drift[at + 1]!;
    const driftZ = drift[at + 2]!;
    const x = (driftX + Math.floor(sumX * share + nudge)) | 0;
    const y = (driftY + Math.floor(sumY * share + nudge)) | 0;
    const z = (driftZ + Math.floor(sumZ * share + nudge)) | 0;
    const moveX = (((x + 8) >> 4) + residuals[at]!) | 0;
    const parity = moveX & 1;
    const centre = 16 - 16 * parity;
    const moveY = ((((y + centre) >> 5) + residuals[at + 1]!) * 2 + parity) | 0;
    const moveZ = ((((z + centre) >> 5) + residuals[at + 2]!) * 2 + parity) | 0;
    moves[at] = moveX;
    moves[at + 1] = moveY;
    moves[at + 2] = moveZ;
    errors[at + 3] = (moveX << 4) - driftX;
    errors[at + 4] = (moveY << 4) - driftY;
    errors[at + 5] = (moveZ << 4) - driftZ;
  }
  return moves;
}
