// The last half minute of a world that runs, kept from the frames that came, to be looked at again.
import type { Frame } from "../src/index.js";
import { PackedFrame, packedBytes } from "./packed_frame.js";
import type { Moment } from "./playback.js";

export const pastS = 30;
// More are not seen: the picture goes on between two frames.
const rateMaxHz = 30;
// Of all frames together. hero takes 2 MB; the largest world has a frame each 0.7 s then.
const bytesMax = 64 * 1024 * 1024;
// Where so much is missing between two frames, nothing is known of what was between them.
const gapS = 2;

interface Kept {
  readonly atS: number;
  readonly packed: PackedFrame;
  /** Nothing leads to it from the one before. */
  readonly isFirst: boolean;
}

export class Past {
  private kept: Kept[] = [];
  private bytes_ = 0;
  private nowS_ = 0;
  private last: { readonly tick: number; readonly timeS: number } | undefined;
  private isBroken = false;
  private unpacked: { readonly kept: Kept; readonly frame: Frame }[] = []; // the last two that were asked for

  /** What is kept, in memory. */
  get bytes(): number {
    return this.bytes_;
  }

  /** Time that the world went on since it is watched; where it began again it goes on here. */
  get nowS(): number {
    return this.nowS_;
  }

  /** As far back as there is something to see. */
  get beginS(): number {
    return this.kept[0]?.atS ?? this.nowS_;
  }

  clear(): void {
    this.kept = [];
    this.unpacked = [];
    this.bytes_ = 0;
    this.nowS_ = 0;
    this.last = undefined;
    this.isBroken = false;
  }

  /** @param isKept whether what is kept goes on: not while it is looked at */
  take(frame: Frame, isKept: boolean): void {
    const stepS = this.last ? frame.timeS - this.last.timeS : 0;
    if (stepS < 0) this.isBroken = true;
    else this.nowS_ += stepS;
    this.last = frame;
    if (isKept) this.keep(frame);
  }

  /** What was to be seen then, or at the nearest moment that is kept. */
  at(atS: number): Omit<Moment, "resets"> | undefined {
    const next = this.kept.findIndex((kept) => kept.atS > atS);
    const first = this.kept[next < 0 ? this.kept.length - 1 : Math.max(0, next - 1)];
    if (!first) return undefined;
    const second = this.kept[next];
    const from = this.unpack(first);
    const isBetween =
      second !== undefined && second !== first && !second.isFirst && second.packed.layout === first.packed.layout;
    if (!isBetween) return { from, to: from, fraction: 1 };
    const fraction = (Math.max(atS, first.atS) - first.atS) / (second.atS - first.atS);
    return { from, to: this.unpack(second), fraction };
  }

  private keep(frame: Frame): void {
    const { nowS_: atS } = this;
    const newest = this.kept.at(-1);
    // A frame that comes a little early is as good as the next one.
    const intervalS = Math.max(0.9 / rateMaxHz, (pastS * packedBytes(frame)) / bytesMax);
    const passedS = newest ? atS - newest.atS : Infinity;
    if (!this.isBroken && passedS < intervalS) return;
    const packed = new PackedFrame(frame);
    this.kept.push({ atS, packed, isFirst: this.isBroken || passedS > gapS + intervalS });
    this.isBroken = false;
    this.bytes_ += packed.bytes;
    while (this.kept[0]!.atS < atS - pastS || this.bytes_ > bytesMax) this.bytes_ -= this.kept.shift()!.packed.bytes;
  }

  private unpack(kept: Kept): Frame {
    const held = this.unpacked.find((each) => each.kept === kept);
    if (held) return held.frame;
    const frame = kept.packed.unpack();
    this.unpacked = [...this.unpacked.slice(-1), { kept, frame }];
    return frame;
  }
}
