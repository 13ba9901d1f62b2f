// Reads a stream's payloads one after the other: proto/WIRE.md, "Frame payload".
import { type BlockHead, levelOfRest, malformed, pointMax, takeHeads } from "./block_heads.js";
import type { MeshOrder } from "./mesh_order.js";
import { predictDrift, takeMoves } from "./move_reader.js";
import { SymbolReader } from "./symbol_reader.js";

/** Where a body's vertices are on the grid and how they came there; x y z of each slot. */
interface Motion {
  readonly points: Float64Array;
  readonly move: Int32Array;
  readonly moveBefore: Int32Array;
}

function motionOf(order: MeshOrder): Motion {
  const count = 3 * order.size;
  return { points: new Float64Array(count), move: new Int32Array(count), moveBefore: new Int32Array(count) };
}

function sumOf(points: Float64Array, moves: Int32Array, body: number): Float64Array {
  const sums = new Float64Array(points.length);
  let furthest = 0;
  for (let i = 0; i < points.length; ++i) {
    const sum = points[i]! + moves[i]!;
    furthest = Math.max(furthest, Math.abs(sum));
    sums[i] = sum;
  }
  if (furthest > pointMax) throw malformed("a point is further away than any server's", body);
  return sums;
}

function takeOwnMoves(order: MeshOrder, level: number, drift: Int32Array, symbols: SymbolReader): Int32Array {
  const moves = new Int32Array(3 * order.size);
  if (level !== levelOfRest) takeMoves(order, "mean", level, drift, symbols, moves);
  return moves;
}

function takeBlock(order: MeshOrder, head: BlockHead, last: Motion, symbols: SymbolReader, body: number): Motion {
  if (head.mode === "still") {
    return { points: last.points, move: new Int32Array(last.move.length), moveBefore: last.move };
  }
  if (head.mode === "moved") {
    const move = new Int32Array(last.move.length);
    const drift = predictDrift(order, last.move, last.moveBefore, head.weights);
    takeMoves(order, head.neighbours, head.level, drift, symbols, move);
    return { points: sumOf(last.points, move, body), move, moveBefore: last.move };
  }
  const noDrift = new Int32Array(3 * order.size);
  let points = head.points;
  if (head.mode === "key") {
    const steps = new Int32Array(3 * order.size);
    takeMoves(order, "parallelogram", head.level, noDrift, symbols, steps);
    const anchors = new Float64Array(3 * order.size);
    for (let i = 0; i < anchors.length; ++i) anchors[i] = head.points[i % 3]!;
    points = sumOf(anchors, steps, body);
  }
  const move = takeOwnMoves(order, head.moveLevel, noDrift, symbols);
  const steady = predictDrift(order, move, move, [32, 0, 0, 0]);
  return { points, move, moveBefore: takeOwnMoves(order, head.beforeLevel, steady, symbols) };
}

/** The soft bodies of one layout of a stream. Any bytes are safe to read: what cannot be read is refused. */
export class FrameReader {
  private motions: Motion[];

  constructor(private readonly orders: readonly MeshOrder[]) {
    this.motions = orders.map(motionOf);
  }

  /** Reads the next payload of the stream; of a payload that is refused (PneumaError MALFORMED) nothing is kept. */
  read(payload: Uint8Array, isKey: boolean): void {
    const { heads, residuals } = takeHeads(
      payload,
      isKey,
      this.orders.map((order) => order.size),
    );
    const symbols = new SymbolReader(residuals);
    const motions = this.orders.map((order, body) => {
      const motion = takeBlock(order, heads[body]!, this.motions[body]!, symbols, body);
      if (symbols.failed()) throw malformed("the payload ends in this body's residuals", body);
      return motion;
    });
    if (!symbols.atEnd()) throw malformed("the residuals do not end where the payload does");
    this.motions = motions;
  }

  /** Writes the grid coordinates of a body's vertices times `step`, x y z of each, in the order of its mesh. */
  positions(body: number, step: number, out: Float64Array): void {
    const { vertices } = this.orders[body]!;
    const { points } = this.motions[body]!;
    for (let slot = 0; slot < vertices.length; ++slot) {
      const to = 3 * vertices[slot]!;
      out[to] = points[3 * slot]! * step;
      out[to + 1] = points[3 * slot + 1]! * step;
      out[to + 2] = points[3 * slot + 2]! * step;
    }
  }
}
