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
    weights.set(triples.triple, 3 * i);
  }
  return weights;
}

/** Arrays that reading a block needs for a while; of the largest body so far. */
export class Scratch {
  flow = new Int32Array(0);
  drift = new Int32Array(0);
  /** The error of each slot, x y z, and its size: beside each other, since they are asked for together. */
  found = new Int32Array(0);

  fit(slots: number): void {
    if (this.found.length >= 4 * slots) return;
    this.flow = new Int32Array(3 * slots);
    this.drift = new Int32Array(3 * slots);
    this.found = new Int32Array(4 * slots);
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
const reciprocals = Float64Array.from({ length: 7 }, (_, count) => 1 / count);

/** Reads a list of moves, with the drift in `scratch`. Where the text ends early, the reader has failed. */
export function takeMoves(order: MeshOrder, level: number, scratch: Scratch, triples: TripleReader): Int32Array {
  const moves = new Int32Array(3 * order.size);
  const { drift, found } = scratch;
  const { triple } = triples;
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
        const parent = 4 * entries[at]!;
        errorX = (errorX + found[parent]!) | 0;
        errorY = (errorY + found[parent + 1]!) | 0;
        errorZ = (errorZ + found[parent + 2]!) | 0;
        sizeSum = (sizeSum + found[parent + 3]!) | 0;
      }
      const share = reciprocals[count]!;
      x += Math.floor(errorX * share + nudge);
      y += Math.floor(errorY * share + nudge);
      z += Math.floor(errorZ * share + nudge);
      size += 4 * Math.floor(sizeSum * share + nudge);
    }
    triples.take(Math.min(levelOf(size), levelMax));
    const residualX = triple[0]!;
    const residualY = triple[1]!;
    const residualZ = triple[2]!;
    const moveX = (((x + 8) >> 4) + residualX) | 0;
    const parity = moveX & 1;
    const centre = 16 - 16 * parity;
    const moveY = ((((y + centre) >> 5) + residualY) * 2 + parity) | 0;
    const moveZ = ((((z + centre) >> 5) + residualZ) * 2 + parity) | 0;
    moves[to] = moveX;
    moves[to + 1] = moveY;
    moves[to + 2] = moveZ;
    const here = 4 * slot;
    found[here] = (moveX << 4) - driftX;
    found[here + 1] = (moveY << 4) - driftY;
    found[here + 2] = (moveZ << 4) - driftZ;
    found[here + 3] = Math.min(4 * (Math.abs(residualX) + 2 * (Math.abs(residualY) + Math.abs(residualZ))), sizeMax);
  }
  return moves;
}
