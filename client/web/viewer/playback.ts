// Frames arrive unevenly; the picture goes on evenly, a little behind the newest of them.
import type { Frame } from "../src/index.js";

export interface Moment {
  readonly from: Frame;
  readonly to: Frame;
  /** How far it is from `from` to `to`, 0 to 1. */
  readonly fraction: number;
}

const framesMax = 30;
// Behind the newest frame by so many of the last intervals: one frame may come late by half of one.
const intervalsBehind = 1.5;
// Of the difference to where the picture should be, so much is made good each second; past the largest, at once.
const catchUpPerS = 2;
const differenceMaxS = 0.5;

export class Playback {
  private frames: Frame[] = [];
  private shownS = 0;
  private lastMs: number | undefined;

  push(frame: Frame): void {
    const newest = this.frames.at(-1);
    // After a reset, and where bodies came or went, there is nothing between the two.
    if (newest && (frame.timeS <= newest.timeS || frame.layout !== newest.layout)) this.frames = [];
    this.frames.push(frame);
    if (this.frames.length > framesMax) this.frames.shift();
    if (this.frames.length === 1) this.shownS = frame.timeS;
  }

  /** The world's time over real time. */
  scale = 1;

  clear(): void {
    this.frames = [];
  }

  /** What to show at this moment of real time; undefined before the first frame. */
  at(nowMs: number): Moment | undefined {
    const newest = this.frames.at(-1);
    if (!newest) return undefined;
    const passedS = this.lastMs === undefined ? 0 : (Math.max(0, nowMs - this.lastMs) / 1000) * this.scale;
    this.lastMs = nowMs;
    const intervalS = newest.timeS - (this.frames.at(-2)?.timeS ?? newest.timeS);
    const difference = newest.timeS - intervalsBehind * intervalS - (this.shownS + passedS);
    const made = Math.abs(difference) > differenceMaxS ? 1 : Math.min(1, catchUpPerS * passedS);
    this.shownS = Math.min(this.shownS + passedS + made * difference, newest.timeS);
    while (this.frames.length > 2 && this.frames[1]!.timeS <= this.shownS) this.frames.shift();
    const from = this.frames[0]!;
    const to = this.frames[1] ?? from;
    const spanS = to.timeS - from.timeS;
    const fraction = spanS > 0 ? Math.min(1, Math.max(0, (this.shownS - from.timeS) / spanS)) : 1;
    return { from, to, fraction };
  }
}
