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

/** The sum of six entries. */
function sumOf(field: Int32Array, a: number, b: number, c: number, d: number, e: number, f: number): number {
  return (field[a]! + field[b]! + field[c]! + field[d]! + field[e]! + field[f]!) | 0;
}

/** Adds, times `factor`, what neighbours past a slot's sixth have more than the slot. */
function addRests(rests: Int32Array, field: Int32Array, factor: number, out: Int32Array): void {
  for (let i = 0; i < rests.length; i += 2) {
    const at = rests[i]!;
    const near = rests[i + 1]!;
    for (let axis = 0; axis < 3; ++axis) out[at + axis]! += Math.imul(factor, field[near + axis]! - field[at + axis]!);
  }
}

/** Writes the drift of each slot, in 16ths of a step. */
export function predictDrift(order: MeshOrder, moves: Moves, weights: Weights, { flow, drift }: Scratch): void {
  const [m1, m2, m3, m4] = moves;
  const [a1 = 0, a2 = 0, a3 = 0, a4 = 0, b1 = 0, b2 = 0, b3 = 0, b4 = 0, c = 0] = weights;
  const { ringPlaces: places, ringRests: rests, size } = order;
  // Written out: a loop over neighbours costs 15 % of the time to decode a frame, one over axes 5 %, a function that
  // looks up the places of both passes 3 %.
  const ofOwn = b1 - 6 * c;
  for (let at = 0, i = 0; at < 3 * size; at += 3, i += 6) {
    const p0 = places[i]!;
    const p1 = places[i + 1]!;
    const p2 = places[i + 2]!;
    const p3 = places[i + 3]!;
    const p4 = places[i + 4]!;
    const p5 = places[i + 5]!;
    const ringX = sumOf(m1, p0, p1, p2, p3, p4, p5);
    const x1 = m1[at]!;
    const x2 = m2[at]!;
    const x3 = m3[at]!;
    const x4 = m4[at]!;
    const ownX = Math.imul(ofOwn, x1) + Math.imul(b2, x2) + Math.imul(b3, x3) + Math.imul(b4, x4);
    flow[at] = Math.imul(c, ringX) + ownX;
    drift[at] = (Math.imul(a1, x1) + Math.imul(a2, x2) + Math.imul(a3, x3) + Math.imul(a4, x4)) << 3;
    const ringY = sumOf(m1, p0 + 1, p1 + 1, p2 + 1, p3 + 1, p4 + 1, p5 + 1);
    const y1 = m1[at + 1]!;
    const y2 = m2[at + 1]!;
    const y3 = m3[at + 1]!;
    const y4 = m4[at + 1]!;
    const ownY = Math.imul(ofOwn, y1) + Math.imul(b2, y2) + Math.imul(b3, y3) + Math.imul(b4, y4);
    flow[at + 1] = Math.imul(c, ringY) + ownY;
    drift[at + 1] = (Math.imul(a1, y1) + Math.imul(a2, y2) + Math.imul(a3, y3) + Math.imul(a4, y4)) << 3;
    const ringZ = sumOf(m1, p0 + 2, p1 + 2, p2 + 2, p3 + 2, p4 + 2, p5 + 2);
    const z1 = m1[at + 2]!;
    const z2 = m2[at + 2]!;
    const z3 = m3[at + 2]!;
    const z4 = m4[at + 2]!;
    const ownZ = Math.imul(ofOwn, z1) + Math.imul(b2, z2) + Math.imul(b3, z3) + Math.imul(b4, z4);
    flow[at + 2] = Math.imul(c, ringZ) + ownZ;
    drift[at + 2] = (Math.imul(a1, z1) + Math.imul(a2, z2) + Math.imul(a3, z3) + Math.imul(a4, z4)) << 3;
  }
  addRests(rests, m1, c, flow);
  addRests(rests, flow, 1, drift);
  for (let at = 0, i = 0; at < 3 * size; at += 3, i += 6) {
    const p0 = places[i]!;
    const p1 = places[i + 1]!;
    const p2 = places[i + 2]!;
    const p3 = places[i + 3]!;
    const p4 = places[i + 4]!;
    const p5 = places[i + 5]!;
    const ringX = sumOf(flow, p0, p1, p2, p3, p4, p5);
    const ringY = sumOf(flow, p0 + 1, p1 + 1, p2 + 1, p3 + 1, p4 + 1, p5 + 1);
    const ringZ = sumOf(flow, p0 + 2, p1 + 2, p2 + 2, p3 + 2, p4 + 2, p5 + 2);
    drift[at] = (drift[at]! + ringX - 6 * flow[at]! + 32) >> 6;
    drift[at + 1] = (drift[at + 1]! + ringY - 6 * flow[at + 1]! + 32) >> 6;
    drift[at + 2] = (drift[at + 2]! + ringZ - 6 * flow[at + 2]! + 32) >> 6;
  }
}

// So that a multiple of n times 1 / n is not a little less than whole: more than what such products are rounded by, less
// than the sixth by which other quotients are below the next whole number.
const nudge = 2 ** -10;
// What `| 0` cuts is cut towards 0: 2^32, which it takes off again, keeps a quotient below 0 above it meanwhile.
const nudgeDown = 2 ** 32 + nudge;

/** Run by run: what the level of a slot is found from was taken before. */
function takeResiduals(order: MeshOrder, level: number, scratch: Scratch, triples: TripleReader): void {
  const { levels, residuals, sizes } = scratch;
  const { parents, parentShares } = order;
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
      const mean = (sum * parentShares[slot]! + nudge) | 0;
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
  const { parents, parentShares } = order;
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
    const share = parentShares[slot]!;
    const at = 3 * slot;
    const driftX = drift[at]!;
    const driftY = drift[at + 1]!;
    const driftZ = drift[at + 2]!;
    const x = (driftX + ((sumX * share + nudgeDown) | 0)) | 0;
    const y = (driftY + ((sumY * share + nudgeDown) | 0)) | 0;
    const z = (driftZ + ((sumZ * share + nudgeDown) | 0)) | 0;
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
