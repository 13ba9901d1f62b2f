// What happened, on a line of time.
import { element } from "./element.js";

export type MarkKind = "event" | "deed" | "key";

export interface Mark {
  readonly atS: number;
  readonly kind: MarkKind;
  readonly text: string;
}

// More are no marks any more: the oldest go.
const marksMax = 1000;

export class Marks {
  private marks: Mark[] = [];
  private readonly place = element("marks");
  private drawn = "";

  clear(): void {
    this.marks = [];
  }

  /** What is there already is not marked twice: a recording comes to it again. */
  add(mark: Mark): void {
    const isKnown = this.marks.some(
      ({ atS, kind, text }) => kind === mark.kind && text === mark.text && Math.abs(atS - mark.atS) < 1e-6,
    );
    if (isKnown) return;
    this.marks = [...this.marks.slice(1 - marksMax), mark];
  }

  forgetBefore(atS: number): void {
    this.marks = this.marks.filter((mark) => mark.atS >= atS);
  }

  /** In words, those within a tenth of a second; "": none. */
  textAt(atS: number): string {
    const near = this.marks.filter((mark) => mark.text !== "" && Math.abs(mark.atS - atS) <= 0.1);
    return near.map(({ text }) => text).join(", ");
  }

  /** The last ones that say something, the newest first. */
  latest(count: number): readonly Mark[] {
    return this.marks
      .filter(({ text }) => text !== "")
      .slice(-count)
      .reverse();
  }

  draw(beginS: number, endS: number): void {
    const within = this.marks.filter(({ atS }) => atS >= beginS && atS <= endS);
    const parts = within.map(({ atS }) => `${((100 * (atS - beginS)) / (endS - beginS)).toFixed(2)}%`);
    const drawn = within.map(({ kind }, i) => `${kind} ${parts[i]}`).join();
    if (drawn === this.drawn) return;
    this.drawn = drawn;
    this.place.replaceChildren(
      ...within.map(({ kind }, i) => {
        const mark = document.createElement("i");
        mark.className = kind;
        mark.style.left = parts[i]!;
        return mark;
      }),
    );
  }
}
