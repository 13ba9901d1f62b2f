// Moves of a body's vertices from their prediction and residuals: proto/WIRE.md, "Prediction". Whole numbers of 32 bits
// that wrap around; x y z of each slot, one after the other.
import { type MeshOrder, parentsMax, ringPlacesASlot } from "./mesh_order.js";
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

/** Adds to `out` the sums over the rings of what each neighbour has more than the slot, times `factor`, and rounds by `shift` bits. */
function addRings(order: MeshOrder, field: Int32Array, factor: number, shift: number, out: Int32Array): void {
  const { ringPlaces: places, ringRests: rests } = order;
  for (let i = 0; i < rests.length; i += 2) {
    const at = rests[i]!;
    const near = rests[i + 1]!;
    for (let axis = 0; axis < 3; ++axis) out[at + axis]! += Math.imul(factor, field[near + axis]! - field[at + axis]!);
  }
  const half = (1 << shift) >> 1;
  for (let at = 0, i = 0; i < places.length; at += 3, i += ringPlacesASlot) {
    const a = places[i]!;
    const b = places[i + 1]!;
    const c = places[i + 2]!;
    const d = places[i + 3]!;
    const e = places[i + 4]!;
    const f = places[i + 5]!;
    const x = field[a]! + field[b]! + field[c]! + field[d]! + field[e]! + field[f]! - 6 * field[at]!;
    const y =
      field[a + 1]! +
      field[b + 1]! +
      field[c + 1]! +
      field[d + 1]! +
      field[e + 1]! +
      field[f + 1]! -
      6 * field[at + 1]!;
    const z =
      field[a + 2]! +
      field[b + 2]! +
      field[c + 2]! +
      field[d + 2]! +
      field[e + 2]! +
      field[f + 2]! -
      6 * field[at + 2]!;
    out[at] = (out[at]! + Math.imul(factor, x) + half) >> shift;
    out[at + 1] = (out[at + 1]! + Math.imul(factor, y) + half) >> shift;
    out[at + 2] = (out[at + 2]! + Math.imul(factor, z) + half) >> shift;
  }
}

/** Writes the drift of each slot, in 16ths of a step. */
export function predictDrift(order: MeshOrder, moves: Moves, weights: Weights, { flow, drift }: Scratch): void {
  const [m1, m2, m3, m4] = moves;
  const [a1 = 0, a2 = 0, a3 = 0, a4 = 0, b1 = 0, b2 = 0, b3 = 0, b4 = 0, c = 0] = weights;
  for (let i = 0; i < m1.length; ++i) {
    const n1 = m1[i]!;
    const n2 = m2[i]!;
    const n3 = m3[i]!;
    const n4 = m4[i]!;
    flow[i] = Math.imul(b1, n1) + Math.imul(b2, n2) + Math.imul(b3, n3) + Math.imul(b4, n4);
    drift[i] = (Math.imul(a1, n1) + Math.imul(a2, n2) + Math.imul(a3, n3) + Math.imul(a4, n4)) << 3;
  }
  if (c !== 0) addRings(order, m1, c, 0, flow);
  addRings(order, flow, 1, 6, drift);
}

// So that 1 / n of a multiple of n is not a little less than whole: less than the sixth by which other quotients are
// above a whole number, more than the rounding of 2^32 / n.
const nudge = 2 ** -10;
// And, with | 0, so that a quotient below 0 is rounded down as well: only whole numbers modulo 2^32 are kept.
const nudgeDown = 2 ** 32 + nudge;
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
      const mean = (sum * reciprocals[parentCounts[slot]!]! + nudge) | 0;
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
