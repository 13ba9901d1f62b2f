// Reads a stream's payloads one after the other: proto/WIRE.md, "Frame payload".
import { type BlockHead, levelOfRest, malformed, pointMax, takeHeads } from "./block_heads.js";
import type { MeshOrder } from "./mesh_order.js";
import { pointsCheck, pointsDigest } from "./points_check.js";
import { type Moves, predictDrift, Scratch, takeMoves, takeWeights, type Weights } from "./move_reader.js";
import { PneumaError } from "../errors.js";
import { type SimulatedMotion, velocitiesOf } from "./simulated_motion.js";
import { TripleReader } from "./triple_reader.js";

/** Where a body's vertices are on the grid and how they came there; x y z of each slot. */
interface Motion {
  readonly points: Float64Array;
  /** Of the points. */
  readonly digest: number;
  readonly moves: Moves;
  readonly weights: Weights;
  /** Of a body that has mechanics, in eighths of a step a frame. */
  readonly velocities: Int32Array | undefined;
}

function motionOf({ size }: MeshOrder): Motion {
  const none = new Int32Array(3 * size);
  return {
    points: new Float64Array(3 * size),
    digest: 0,
    moves: [none, none, none, none],
    weights: new Int32Array(9),
    velocities: none,
  };
}

type Place = Pick<Motion, "points" | "digest">;

function sumOf(points: Float64Array, moves: Int32Array, body: number): Place {
  const sums = new Float64Array(points.length);
  let furthest = 0;
  for (let i = 0; i < points.length; ++i) {
    const sum = points[i]! + moves[i]!;
    furthest = Math.max(furthest, Math.abs(sum));
    sums[i] = sum;
  }
  if (furthest > pointMax) throw malformed("a point is further away than any server's", body);
  return { points: sums, digest: pointsDigest(sums, furthest) };
}

function placeOf(points: Float64Array): Place {
  return { points, digest: pointsDigest(points, pointMax) };
}

/** Reads the blocks of one payload, body by body. */
class BlockReader {
  constructor(
    private readonly triples: TripleReader,
    private readonly scratch: Scratch,
  ) {}

  take({ order, simulation }: Body, head: BlockHead, last: Motion, body: number): Motion {
    const { moves, points } = last;
    this.scratch.fit(order.size);
    const next = (move: Int32Array): Moves => [move, moves[0], moves[1], moves[2]];
    if (head.mode === "still") {
      const none = new Int32Array(points.length);
      return { ...last, moves: next(none), velocities: simulation && none };
    }
    if (head.mode === "simulated") {
      simulation!.predict(points, last.velocities!, this.scratch.drift);
      const move = takeMoves(order, head.level, this.scratch, this.triples);
      const velocities = simulation!.correct(move);
      return { ...sumOf(points, move, body), moves: next(move), weights: last.weights, velocities };
    }
    if (head.mode === "moved") {
      const weights = head.hasWeights ? takeWeights(this.triples) : last.weights;
      predictDrift(order, moves, weights, this.scratch);
      const move = takeMoves(order, head.level, this.scratch, this.triples);
      const velocities = simulation && velocitiesOf(move);
      return { ...sumOf(points, move, body), moves: next(move), weights, velocities };
    }
    const weights = takeWeights(this.triples);
    const own = head.mode === "plain" ? placeOf(head.points) : this.takePoints(order, head.level, head.points, body);
    const ownMoves = this.takeOwnMoves(order, head.moveLevels);
    return {
      ...own,
      moves: ownMoves,
      weights,
      velocities: this.takeVelocities(order, head.velocityLevel, ownMoves[0]),
    };
  }

  private takeVelocities(order: MeshOrder, level: number | undefined, move: Int32Array): Int32Array | undefined {
    if (level === undefined) return undefined;
    if (level === levelOfRest) return velocitiesOf(move);
    for (let i = 0; i < move.length; ++i) this.scratch.drift[i] = move[i]! << 8;
    return takeMoves(order, level, this.scratch, this.triples).map((twice) => twice >> 1);
  }

  private takePoints(order: MeshOrder, level: number, anchor: Float64Array, body: number): Place {
    this.scratch.drift.fill(0);
    const steps = takeMoves(order, level, this.scratch, this.triples);
    const anchors = Float64Array.from(steps, (_, i) => anchor[i % 3]!);
    return sumOf(anchors, steps, body);
  }

  /** The last four moves: each is told by how it differs from the one after it. */
  private takeOwnMoves(order: MeshOrder, levels: readonly number[]): Moves {
    const { drift } = this.scratch;
    drift.fill(0);
    const [m1, m2, m3, m4] = levels.map((level) => {
      const isRest = level === levelOfRest;
      const moves = isRest ? new Int32Array(3 * order.size) : takeMoves(order, level, this.scratch, this.triples);
      for (let i = 0; i < moves.length; ++i) drift[i] = moves[i]! << 4;
      return moves;
    });
    return [m1!, m2!, m3!, m4!];
  }
}

interface Body {
  readonly order: MeshOrder;
  readonly simulation: SimulatedMotion | undefined;
}

function wrongState(what: string): PneumaError {
  return new PneumaError("WRONG_STATE", what, "payload");
}

/** The soft bodies of one layout of a stream. Any bytes are safe to read: what cannot be read is refused. */
export class FrameReader {
  // After the last frame of each time layer.
  private readonly layers: Motion[][];
  private last: Motion[];
  /** A check failed: what builds on any frame before the next key frame cannot be read. */
  private isWrong = false;
  private readonly scratch = new Scratch();

  private readonly bodies: readonly Body[];

  /** @param simulations one a body; undefined: it is not simulated */
  constructor(orders: readonly MeshOrder[], simulations: readonly (SimulatedMotion | undefined)[] = []) {
    this.bodies = orders.map((order, body) => ({ order, simulation: simulations[body] }));
    this.last = orders.map(motionOf);
    this.layers = [this.last];
  }

  /**
   * Reads the next payload of the stream; of a payload that is refused (PneumaError MALFORMED or UNSUPPORTED) nothing is kept.
   * A delta frame whose check fails, and those after it, are WRONG_STATE until a key frame comes.
   * @param base the layer whose last frame it builds on; undefined: a key frame
   * @param layer its own
   * @param check that the server's points have; undefined: it does not say
   */
  read(payload: Uint8Array, base: number | undefined, layer = 0, check?: number): void {
    if (this.isWrong && base !== undefined) throw wrongState("a frame before the key frame that was asked for");
    const motionsBefore = this.layers[base ?? 0];
    if (!motionsBefore) throw malformed(`builds on layer ${base}, of which there was no frame`);
    const { heads, residuals } = takeHeads(
      payload,
      base === undefined,
      this.bodies.map(({ order, simulation }) => ({ vertexCount: order.size, isSimulated: simulation !== undefined })),
    );
    const triples = new TripleReader(residuals);
    const blocks = new BlockReader(triples, this.scratch);
    const motions = this.bodies.map((own, body) => {
      const motion = blocks.take(own, heads[body]!, motionsBefore[body]!, body);
      if (triples.failed()) throw malformed("the payload ends in this body's residuals", body);
      return motion;
    });
    if (!triples.atEnd()) throw malformed("the residuals do not end where the payload does");
    const found = pointsCheck(motions.map(({ digest }) => digest));
    if (check !== undefined && found !== check) {
      const what = `the points are not the server's: their check is ${found}, not ${check}`;
      // A reader that takes a key frame wrong is not helped by another.
      if (base === undefined) throw malformed(what);
      this.isWrong = true;
      throw wrongState(what);
    }
    this.isWrong = false;
    this.layers[layer] = motions;
    this.last = motions;
  }

  /** Writes, of the last frame read, the grid coordinates of a body's vertices times `step`, x y z of each, in the order of its mesh. */
  positions(body: number, step: number, out: Float64Array): void {
    const { vertices } = this.bodies[body]!.order;
    const { points } = this.last[body]!;
    for (let slot = 0; slot < vertices.length; ++slot) {
      const to = 3 * vertices[slot]!;
      out[to] = points[3 * slot]! * step;
      out[to + 1] = points[3 * slot + 1]! * step;
      out[to + 2] = points[3 * slot + 2]! * step;
    }
  }
}
