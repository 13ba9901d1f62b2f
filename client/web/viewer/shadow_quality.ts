// How well shadows are drawn, by how many pictures a second there are.
export type ShadowQuality = "soft" | "hard" | "none";

const qualities: readonly ShadowQuality[] = ["none", "hard", "soft"];
// Pictures a second below which shadows get worse, and above which better, counted over such a time.
const slowHz = 24;
const fastHz = 50;
const countMs = 3000;
const gapMs = 500;

/** As it was written; the best where it was not, or is no quality. */
export function shadowQuality(text: string | null): ShadowQuality {
  return qualities.find((quality) => quality === text) ?? "soft";
}

export class ShadowGauge {
  private level: number;
  private lastMs = -Infinity;
  private countedFromMs = 0;
  private counted = 0;
  /** Fast counts in a row, and how many make it better: more each time that was too early. */
  private fast = 0;
  private fastWanted = 2;

  constructor(first: ShadowQuality = "soft") {
    this.level = qualities.indexOf(first);
  }

  get quality(): ShadowQuality {
    return qualities[this.level]!;
  }

  /** To be called with each picture. */
  count(nowMs: number): void {
    const isGap = nowMs - this.lastMs > gapMs; // the page was not seen, or waited for a shader
    this.lastMs = nowMs;
    if (isGap || nowMs - this.countedFromMs > countMs) {
      if (!isGap) this.judge((1000 * this.counted) / countMs);
      this.countedFromMs = nowMs;
      this.counted = 0;
    }
    ++this.counted;
  }

  private judge(hz: number): void {
    this.fast = hz >= fastHz ? this.fast + 1 : 0;
    if (hz < slowHz && this.level > 0) {
      --this.level;
      this.fastWanted *= 2;
    } else if (this.fast >= this.fastWanted && this.level < qualities.length - 1) {
      ++this.level;
      this.fast = 0;
    }
  }
}
