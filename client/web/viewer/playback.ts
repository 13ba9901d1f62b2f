// Frames arrive unevenly; the picture goes on evenly, as little behind them as they allow.
import type { Frame } from "../src/index.js";

export interface Moment {
  readonly from: Frame;
  readonly to: Frame;
  /** How far it is from `from` to `to`, 0 to 1. */
  readonly fraction: number;
  /** How often the world began again before: it may have come further since than it was. */
  readonly resets: number;
}

const framesMax = 30;
// Arrivals are judged by those of this time; after a silence that long, what was before says nothing.
const windowMs = 2000;
const silenceMs = 500;
// The pace of a world is told from arrivals once they reach back so far.
const paceWindowMs = 500;
const behindMaxS = 0.25;
// Of the difference to where the picture should be, so much is made good each second; past the largest, at once.
const catchUpPerS = 2;
const differenceMaxS = 0.5;
// A stream that is slower is not one that is watched: what was between was left out, or a recording went elsewhere.
const leapS = 1.5;

interface Arrival {
  readonly atMs: number;
  readonly timeS: number;
}

export class Playback {
  private frames: Frame[] = [];
  private arrivals: Arrival[] = [];
  private shownS = 0;
  private scale = 1;
  private lastMs: number | undefined;
  private resets = 0;

  /** @param nowMs when it arrived, on the clock of `at` */
  push(frame: Frame, nowMs = performance.now()): void {
    const newest = this.frames.at(-1);
    const stepS = newest ? frame.timeS - newest.timeS : 0;
    if (newest && stepS <= 0) ++this.resets;
    if (newest && (stepS <= 0 || stepS > leapS)) this.frames = []; // there is nothing between the two
    this.frames.push(frame);
    if (this.frames.length > framesMax) this.frames.shift();
    if (this.frames.length === 1) this.shownS = frame.timeS;
    const last = this.arrivals.at(-1);
    if (last && (frame.timeS <= last.timeS || nowMs - last.atMs > silenceMs)) this.arrivals = [];
    this.arrivals.push({ atMs: nowMs, timeS: frame.timeS });
    while (this.arrivals[0]!.atMs < nowMs - windowMs) this.arrivals.shift();
  }

  /** Takes the world's time over real time to be this from now on, until arrivals tell better. */
  slowTo(scale: number): void {
    if (scale === this.scale) return;
    this.scale = scale;
    this.arrivals = this.arrivals.slice(-1);
  }

  clear(): void {
    this.frames = [];
    this.arrivals = [];
  }

  /** What to show at this moment of real time; undefined before the first frame. */
  at(nowMs: number): Moment | undefined {
    const newest = this.frames.at(-1);
    if (!newest) return undefined;
    const passedS = this.lastMs === undefined ? 0 : Math.max(0, nowMs - this.lastMs) / 1000;
    this.lastMs = nowMs;
    const pace = this.pace();
    const difference = this.wantedS(nowMs, pace) - (this.shownS + pace * passedS);
    const made = Math.abs(difference) > differenceMaxS ? 1 : Math.min(1, catchUpPerS * passedS);
    // Never back: where it is too far ahead it waits.
    this.shownS = Math.max(this.shownS, Math.min(this.shownS + pace * passedS + made * difference, newest.timeS));
    while (this.isFirstOver()) this.frames.shift();
    const [from, next] = this.frames as [Frame, Frame?];
    const to = next?.layout === from.layout ? next : from;
    const spanS = to.timeS - from.timeS;
    const fraction = spanS > 0 ? Math.min(1, Math.max(0, (this.shownS - from.timeS) / spanS)) : 1;
    return { from, to, fraction, resets: this.resets };
  }

  /** The last two of a layout are kept: something may come between them yet. Where bodies came or went there is nothing. */
  private isFirstOver(): boolean {
    const [first, next] = this.frames;
    if (!first || !next || next.timeS > this.shownS) return false;
    return this.frames.length > 2 || next.layout !== first.layout;
  }

  /** Seconds of the world's time a real one. */
  private pace(): number {
    const first = this.arrivals[0]!;
    const last = this.arrivals.at(-1)!;
    const realMs = last.atMs - first.atMs;
    return realMs < paceWindowMs ? this.scale : (1000 * (last.timeS - first.timeS)) / realMs;
  }

  /**
   * The world's time that every frame up to the next one will have come for, were it as late as the latest of the window:
   * an interval and the spread of the arrivals behind what the earliest promise.
   */
  private wantedS(nowMs: number, pace: number): number {
    const [first] = this.arrivals;
    let earliestS = Infinity;
    let latestS = -Infinity;
    for (const { atMs, timeS } of this.arrivals) {
      const latenessS = (pace * (atMs - first!.atMs)) / 1000 - (timeS - first!.timeS);
      earliestS = Math.min(earliestS, latenessS);
      latestS = Math.max(latestS, latenessS);
    }
    const newestS = first!.timeS + (pace * (nowMs - first!.atMs)) / 1000 - earliestS;
    const last = this.arrivals.at(-1)!;
    const intervalS = last.timeS - (this.arrivals.at(-2)?.timeS ?? last.timeS);
    return newestS - Math.min(1.05 * intervalS + latestS - earliestS, behindMaxS);
  }
}
