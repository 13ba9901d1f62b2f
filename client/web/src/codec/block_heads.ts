// The heads of a payload's blocks: proto/WIRE.md, "Layout of a payload".
import { PneumaError } from "../errors.js";
import { levelMax } from "./residual_tables.js";

const format = 5;
/** Points that are larger are refused, so that a double counts any point a stream can reach. */
export const pointMax = 2 ** 45;
/** Of a list of moves: all are 0. */
export const levelOfRest = 255;

/** How one body's block is told. */
export type BlockHead =
  | { readonly mode: "still" }
  /** `points`: of all slots, x y z of each; `moveLevels`: of its last four moves. */
  | {
      readonly mode: "plain";
      readonly points: Float64Array;
      readonly moveLevels: readonly number[];
      /** Of a body that has mechanics. */
      readonly velocityLevel: number | undefined;
    }
  /** `points`: of slot 0 alone. */
  | {
      readonly mode: "key";
      readonly points: Float64Array;
      readonly level: number;
      readonly moveLevels: readonly number[];
      readonly velocityLevel: number | undefined;
    }
  | { readonly mode: "moved"; readonly hasWeights: boolean; readonly level: number }
  | { readonly mode: "simulated"; readonly level: number };

/** A body, as far as its head depends on it. */
export interface BlockBody {
  readonly vertexCount: number;
  readonly isSimulated: boolean;
}

export function malformed(what: string, body?: number): PneumaError {
  return new PneumaError("MALFORMED", what, body === undefined ? "payload" : `payload.bodies[${body}]`);
}

class HeadReader {
  private readonly view: DataView;
  private at = 1;

  constructor(private readonly bytes: Uint8Array) {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  rest(): Uint8Array {
    return this.bytes.subarray(this.at);
  }

  head(body: number, { vertexCount, isSimulated }: BlockBody, isKey: boolean): BlockHead {
    this.need(1, body);
    const mode = this.view.getUint8(this.at++);
    if (mode > (isSimulated ? 5 : 4)) throw malformed(`no such mode: ${mode}`, body);
    if (isKey && mode !== 1 && mode !== 2) throw malformed("a block of a key frame builds on a base", body);
    if (mode === 0) return { mode: "still" };
    if (mode === 1) {
      return {
        mode: "plain",
        points: this.points(vertexCount, body),
        moveLevels: this.moveLevels(body),
        velocityLevel: isSimulated ? this.levelOrRest(body) : undefined,
      };
    }
    if (mode === 2) {
      return {
        mode: "key",
        points: this.points(1, body),
        level: this.level(body),
        moveLevels: this.moveLevels(body),
        velocityLevel: isSimulated ? this.levelOrRest(body) : undefined,
      };
    }
    if (mode === 5) return { mode: "simulated", level: this.level(body) };
    return { mode: "moved", hasWeights: mode === 3, level: this.level(body) };
  }

  private need(count: number, body: number): void {
    if (this.at + count > this.bytes.length) throw malformed("the payload ends in this body's head", body);
  }

  private level(body: number): number {
    const level = this.levelOrRest(body);
    if (level > levelMax) throw malformed(`level ${level} is past ${levelMax}`, body);
    return level;
  }

  private moveLevels(body: number): number[] {
    return Array.from({ length: 4 }, () => this.levelOrRest(body));
  }

  private levelOrRest(body: number): number {
    this.need(1, body);
    const level = this.view.getUint8(this.at++);
    if (level > levelMax && level !== levelOfRest) throw malformed(`level ${level} is past ${levelMax}`, body);
    return level;
  }

  private points(count: number, body: number): Float64Array {
    this.need(24 * count, body);
    const points = new Float64Array(3 * count);
    for (let i = 0; i < points.length; ++i) {
      const low = this.view.getUint32(this.at, true);
      const high = this.view.getInt32(this.at + 4, true);
      this.at += 8;
      const point = high * 2 ** 32 + low;
      if (Math.abs(point) > pointMax) throw malformed("a point is further away than any server's", body);
      points[i] = point;
    }
    return points;
  }
}

/** The heads, and the bytes of the residuals behind them. Throws PneumaError MALFORMED, UNSUPPORTED for another format. */
export function takeHeads(
  payload: Uint8Array,
  isKey: boolean,
  bodies: readonly BlockBody[],
): { heads: BlockHead[]; residuals: Uint8Array } {
  if (payload.length === 0) throw malformed("the payload is empty");
  if (payload[0] !== format) {
    throw new PneumaError("UNSUPPORTED", `format ${payload[0]}; this client reads ${format}`, "payload");
  }
  const reader = new HeadReader(payload);
  const heads = bodies.map((body, place) => reader.head(place, body, isKey));
  return { heads, residuals: reader.rest() };
}
