// Moves of a body's vertices from their prediction and residuals: proto/WIRE.md, "Prediction". Whole numbers of 32 bits
// that wrap around; x y z of each slot, one after the other.
import type { MeshOrder } from "./mesh_order.js";
import { levelMax, levelOf, models, sizeOf } from "./residual_tables.js";
import type { SymbolReader } from "./symbol_reader.js";

/** What a slot is predicted from, beside its drift. */
export type Neighbours = "none" | "mean" | "parallelogram";

/** Of the last move, the move before, and the rings of both. */
export type DriftWeights = readonly [number, number, number, number];

const sizeMax = 1 << 24;

/** The drift of each slot, in 256ths of a step. */
export function predictDrift(
  order: MeshOrder,
  move: Int32Array,
  moveBefore: Int32Array,
  [ofMove, ofMoveBefore, ofRing, ofRingBefore]: DriftWeights,
): Int32Array {
  const drift = new Int32Array(move.length);
  for (let i = 0; i < move.length; ++i) {
    drift[i] = (Math.imul(ofMove, move[i]!) + Math.imul(ofMoveBefore, moveBefore[i]!)) << 3;
  }
  if (ofRing === 0 && ofRingBefore === 0) return drift;
  const flow = new Int32Array(move.length);
  for (let i = 0; i < move.length; ++i) {
    flow[i] = Math.imul(ofRing, move[i]!) + Math.imul(ofRingBefore, moveBefore[i]!);
  }
  const { rings, ringBegins } = order;
  for (let slot = 0; slot < order.size; ++slot) {
    const begin = ringBegins[slot]!;
    const end = ringBegins[slot + 1]!;
    let x = 0;
    let y = 0;
    let z = 0;
    for (let at = begin; at < end; ++at) {
      const from = 3 * rings[at]!;
      x = (x + flow[from]!) | 0;
      y = (y + flow[from + 1]!) | 0;
      z = (z + flow[from + 2]!) | 0;
    }
    const to = 3 * slot;
    drift[to]! += x - Math.imul(end - begin, flow[to]!);
    drift[to + 1]! += y - Math.imul(end - begin, flow[to + 1]!);
    drift[to + 2]! += z - Math.imul(end - begin, flow[to + 2]!);
  }
  return drift;
}

/** Reads the moves of a body into `moves`. Where the text ends early, the reader has failed and the rest is left. */
export function takeMoves(
  order: MeshOrder,
  neighbours: Neighbours,
  level: number,
  drift: Int32Array,
  symbols: SymbolReader,
  moves: Int32Array,
): void {
  // The error of each slot and its size, from 1 on; those of 0 are 0, for what has no neighbours before it.
  const found = new Int32Array(4 * (order.size + 1));
  const bodySize = sizeOf(level);
  const { parents, parallelograms } = order;
  for (let slot = 0; slot < order.size && !symbols.failed(); ++slot) {
    let x = 0;
    let y = 0;
    let z = 0;
    let size = bodySize;
    if (neighbours === "parallelogram") {
      const at = 6 * slot;
      const a = 4 * parallelograms[at]!;
      const b = 4 * parallelograms[at + 1]!;
      const a2 = 4 * parallelograms[at + 2]!;
      const b2 = 4 * parallelograms[at + 3]!;
      const c = 4 * parallelograms[at + 4]!;
      const c2 = 4 * parallelograms[at + 5]!;
      x = (found[a]! + found[b]! + found[a2]! + found[b2]! - found[c]! - found[c2]!) >> 1;
      y = (found[a + 1]! + found[b + 1]! + found[a2 + 1]! + found[b2 + 1]! - found[c + 1]! - found[c2 + 1]!) >> 1;
      z = (found[a + 2]! + found[b + 2]! + found[a2 + 2]! + found[b2 + 2]! - found[c + 2]! - found[c2 + 2]!) >> 1;
      size += found[a + 3]! + found[b + 3]! + found[a2 + 3]! + found[b2 + 3]!;
    } else {
      const at = 4 * slot;
      const p = 4 * parents[at]!;
      const q = 4 * parents[at + 1]!;
      const r = 4 * parents[at + 2]!;
      const s = 4 * parents[at + 3]!;
      if (neighbours === "mean") {
        x = (found[p]! + found[q]! + found[r]! + found[s]!) >> 2;
        y = (found[p + 1]! + found[q + 1]! + found[r + 1]! + found[s + 1]!) >> 2;
        z = (found[p + 2]! + found[q + 2]! + found[r + 2]! + found[s + 2]!) >> 2;
      }
      size += found[p + 3]! + found[q + 3]! + found[r + 3]! + found[s + 3]!;
    }
    const levelHere = Math.min(levelOf(size), levelMax);
    const modelOfX = models[levelHere]!;
    const modelOfYZ = models[Math.max(levelHere - 4, 0)]!;
    const residualX = symbols.take(modelOfX);
    const residualY = symbols.take(modelOfYZ);
    const residualZ = symbols.take(modelOfYZ);

    const to = 3 * slot;
    const driftX = drift[to]!;
    const driftY = drift[to + 1]!;
    const driftZ = drift[to + 2]!;
    const moveX = (((driftX + x + 128) >> 8) + residualX) | 0;
    const parity = moveX & 1;
    const centre = 256 - 256 * parity;
    const moveY = (((((driftY + y + centre) >> 9) + residualY) << 1) + parity) | 0;
    const moveZ = (((((driftZ + z + centre) >> 9) + residualZ) << 1) + parity) | 0;
    moves[to] = moveX;
    moves[to + 1] = moveY;
    moves[to + 2] = moveZ;
    const here = 4 * (slot + 1);
    found[here] = (moveX << 8) - driftX;
    found[here + 1] = (moveY << 8) - driftY;
    found[here + 2] = (moveZ << 8) - driftZ;
    found[here + 3] = Math.min(4 * (Math.abs(residualX) + 2 * (Math.abs(residualY) + Math.abs(residualZ))), sizeMax);
  }
}
