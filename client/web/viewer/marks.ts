// What happened, on a line of time.
import { element } from "./element.js";

export type MarkKind = "event" | "deed";

export interface Mark {
  readonly atS: number;
  readonly kind: MarkKind;
  readonly text: string;
}

// Of a world that runs more are no marks any more: the oldest go. A recording's are as many as it holds.
const liveMarksMax = 1000;
// Of the line, less than a point of a display: what is nearer to another of its kind is drawn with it.
const placeDecimals = 1; // of a percentage
const nearS = 0.1;

function nameOf({ atS, kind, text }: Mark): string {
  return `${kind} ${Math.round(1e6 * atS)} ${text}`;
}

export class Marks {
  private marks: Mark[] = []; // in the order of time
  private known = new Set<string>();
  private keysS: readonly number[] = [];
  private isLive = true;
  private readonly place = element("marks");
  private drawn = "";

  /** Forgets all. */
  begin(isLive: boolean): void {
    this.isLive = isLive;
    this.marks = [];
    this.known = new Set();
    this.keysS = [];
  }

  /** Where a recording's key frames are. */
  setKeys(keysS: readonly number[]): void {
    this.keysS = keysS;
  }

  /** What is there already is not marked twice: a recording comes to it again. */
  add(mark: Mark): void {
    const name = nameOf(mark);
    if (this.known.has(name)) return;
    this.known.add(name);
    this.marks.splice(this.countUntil(mark.atS), 0, mark);
    if (this.isLive && this.marks.length > liveMarksMax) this.known.delete(nameOf(this.marks.shift()!));
  }

  forgetBefore(atS: number): void {
    while (this.marks.length > 0 && this.marks[0]!.atS < atS) this.known.delete(nameOf(this.marks.shift()!));
  }

  /** In words, those within a tenth of a second; "": none. */
  textAt(atS: number): string {
    const near = this.marks.filter((mark) => Math.abs(mark.atS - atS) <= nearS);
    return near.map(({ text }) => text).join(", ");
  }

  /** The last ones until then, the newest first. */
  latest(count: number, untilS: number): readonly Mark[] {
    const end = this.countUntil(untilS);
    return this.marks.slice(Math.max(0, end - count), end).reverse();
  }

  draw(beginS: number, endS: number): void {
    const all: readonly { atS: number; kind: string }[] = [
      ...this.keysS.map((atS) => ({ atS, kind: "key" })),
      ...this.marks,
    ];
    const within = all.filter(({ atS }) => atS >= beginS && atS <= endS);
    const placeOf = (atS: number) => ((100 * (atS - beginS)) / (endS - beginS)).toFixed(placeDecimals);
    const drawn = [...new Set(within.map(({ atS, kind }) => `${kind} ${placeOf(atS)}`))];
    if (drawn.join() === this.drawn) return;
    this.drawn = drawn.join();
    this.place.replaceChildren(
      ...drawn.map((each) => {
        const [kind, place] = each.split(" ") as [string, string];
        const mark = document.createElement("i");
        mark.className = kind;
        mark.style.left = `${place}%`;
        return mark;
      }),
    );
  }

  /** How many are not later than that. */
  private countUntil(atS: number): number {
    let [low, high] = [0, this.marks.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.marks[middle]!.atS <= atS) low = middle + 1;
      else high = middle;
    }
    return low;
  }
}
