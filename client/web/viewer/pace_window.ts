// How a world keeps up, by what the server says of each second.

const ratiosMax = 10;
const slowBelow = 0.95;

/** The world's time over real time in the last ten seconds; before the first one was told, it kept up. */
export class Pace {
  private ratios: number[] = [];

  add(ratio: number): void {
    this.ratios = [...this.ratios, ratio].slice(-ratiosMax);
  }

  get isSlow(): boolean {
    const lost = this.ratios.reduce((sum, ratio) => sum + (1 - ratio), 0);
    return 1 - lost / ratiosMax < slowBelow;
  }

  /** Whether nothing was lost for all of that time. */
  get isOver(): boolean {
    return this.ratios.length === ratiosMax && this.ratios.every((ratio) => ratio >= slowBelow);
  }
}
