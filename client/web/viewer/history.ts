// Numbers over a stretch of time, the newest of them: rows of a time and what was measured then.
export class History {
  private readonly columns: readonly Float64Array[];
  private count = 0;

  /** Holds `spanS` seconds, of rows no closer than `intervalS`. NaN stands for what was not measured. */
  constructor(
    width: number,
    private readonly spanS: number,
    private readonly intervalS: number,
  ) {
    const rows = Math.ceil(spanS / intervalS) + 1;
    this.columns = Array.from({ length: width + 1 }, () => new Float64Array(rows));
  }

  /** A row too close to the last is left out; where time has gone back, all before it is forgotten. */
  push(timeS: number, values: readonly number[]): void {
    const times = this.columns[0]!;
    const last = this.count > 0 ? times[this.count - 1]! : -Infinity;
    if (timeS < last) this.clear();
    else if (timeS - last < this.intervalS * 0.999) return;
    let old = 0;
    while (old < this.count && times[old]! < timeS - this.spanS) ++old;
    if (this.count - old === times.length) ++old;
    for (const column of this.columns) column.copyWithin(0, old, this.count);
    this.count -= old;
    [timeS, ...values].forEach((value, i) => (this.columns[i]![this.count] = value));
    ++this.count;
  }

  clear(): void {
    this.count = 0;
  }

  /** Times, then a list for each of the values. */
  rows(): Float64Array[] {
    return this.columns.map((column) => column.subarray(0, this.count));
  }
}
