// A text area with the numbers of its lines beside it, where lines can be marked.
import { type Span, placeOf } from "./json_text.js";

// As in dock.css.
const lineHeightPx = 18;
const paddingPx = 6;
// So much of what is before a line is shown with it.
const linesBefore = 2;

export class NumberedText {
  private readonly numbers: HTMLElement;
  private count = 0;
  private marked: readonly number[] = [];

  /** @param changed called when somebody has written */
  constructor(
    readonly area: HTMLTextAreaElement,
    changed: () => void,
  ) {
    this.numbers = area.previousElementSibling as HTMLElement;
    area.addEventListener("scroll", () => (this.numbers.scrollTop = area.scrollTop));
    area.addEventListener("input", () => {
      this.number();
      changed();
    });
  }

  get text(): string {
    return this.area.value;
  }

  /** Puts another text in its place; what is seen of it and the cursor stay where they were. */
  set text(text: string) {
    const { area } = this;
    if (text === area.value) return;
    const { selectionStart, scrollTop, scrollLeft } = area;
    area.value = text;
    area.setSelectionRange(selectionStart, selectionStart);
    this.number();
    area.scrollTop = scrollTop;
    area.scrollLeft = scrollLeft;
  }

  /** Marks these lines, counted from 1, and no others. */
  mark(lines: readonly number[]): void {
    this.marked = lines;
    const band = "linear-gradient(var(--marked), var(--marked))";
    const top = (line: number) => paddingPx + (line - 1) * lineHeightPx;
    this.area.style.background = lines
      .map((line) => `${band} 0 ${top(line)}px / 100% ${lineHeightPx}px no-repeat local`)
      .join(", ");
    this.count = 0;
    this.number();
  }

  /** Takes the focus to a part of the text, up to the end of its line. */
  select({ start, end }: Span): void {
    const { area } = this;
    const lineEnd = area.value.indexOf("\n", start);
    area.focus();
    area.setSelectionRange(start, lineEnd < 0 ? end : Math.min(end, lineEnd));
    const { line } = placeOf(area.value, start);
    area.scrollTop = (line - 1 - linesBefore) * lineHeightPx;
    area.scrollLeft = 0;
  }

  private number(): void {
    const count = this.area.value.split("\n").length;
    if (count === this.count) return;
    this.count = count;
    const parts: (string | HTMLElement)[] = [];
    for (let line = 1; line <= count; ++line) {
      const isMarked = this.marked.includes(line);
      parts.push(
        isMarked ? Object.assign(document.createElement("mark"), { textContent: String(line) }) : String(line),
      );
      parts.push("\n");
    }
    this.numbers.replaceChildren(...parts);
    this.numbers.scrollTop = this.area.scrollTop;
  }
}
