// What the page itself does, counted from one telling to the next.
export interface Counts {
  /** Frames that came, and their bytes. */
  readonly frames: number;
  readonly bytes: number;
  /** Ticks whose frames the server or this page left out. */
  readonly dropped: number;
  readonly pictures: number;
  /** Time to bring the scene to a picture's moment, before it is drawn, in all. */
  readonly updateMs: number;
  /** Time that the worker took to decode, in all. */
  readonly decodeMs: number;
}

const nothing: Counts = { frames: 0, bytes: 0, dropped: 0, pictures: 0, updateMs: 0, decodeMs: 0 };

export class Gauge {
  private counts: Counts = nothing;
  private before = nothing;
  private beforeMs = performance.now();

  add(more: Partial<Counts>): void {
    const added = Object.entries(more).map(([name, value]) => [name, this.counts[name as keyof Counts] + value]);
    this.counts = { ...this.counts, ...Object.fromEntries(added) };
  }

  /** Of all time. */
  get all(): Counts {
    return this.counts;
  }

  /** What was added since it was asked for last, and in how many seconds. */
  since(): Counts & { passedS: number } {
    const now = performance.now();
    const names = Object.keys(nothing) as (keyof Counts)[];
    const differences = Object.fromEntries(names.map((name) => [name, this.counts[name] - this.before[name]]));
    const passedS = (now - this.beforeMs) / 1000;
    this.before = this.counts;
    this.beforeMs = now;
    return { ...nothing, ...differences, passedS };
  }
}
