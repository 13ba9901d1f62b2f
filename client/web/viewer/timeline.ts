// The line of time: of a world that runs its last half minute, to be looked at again, of a recording all of it, to be
// gone to. What happened is marked on it.
import type { Client, Frame, PneumaError, RecordingFile } from "../src/index.js";
import { refuse } from "./effect.js";
import { element } from "./element.js";
import { deedText, happeningText } from "./happenings.js";
import { Latest } from "./latest.js";
import { type MarkKind, Marks } from "./marks.js";
import { Past, pastS } from "./past.js";
import type { Moment } from "./playback.js";
import type { Recording } from "./recording.js";

const jumpS = 1; // of the buttons and their keys
const latelyMax = 6; // lines

function seconds(timeS: number): string {
  return timeS.toFixed(1);
}

export class Timeline {
  private readonly slider = element<HTMLInputElement>("moment");
  private readonly told = element<HTMLOutputElement>("moment-told");
  private readonly nowButton = element<HTMLButtonElement>("now");
  private readonly lately = element("lately");
  private readonly past = new Past();
  private readonly marks = new Marks();
  private readonly seeks: Latest<number>;
  private recording: Recording | undefined;
  private tick = 0;
  private lookedAtS: number | undefined; // of the past
  private stoodAtS = 0; // now, when the past began to be looked at
  private isHeld = false; // by a pointer

  /**
   * @param client of what is shown, if any
   * @param moved what is shown is another moment, by the timeline, or a recording is at its end
   */
  constructor(
    client: () => Client | undefined,
    private readonly moved: () => void,
  ) {
    const seek = async (timeS: number) => {
      const { recording } = this;
      if (!recording) return;
      await client()?.seek(recording.world, timeS);
      this.moved();
    };
    this.seeks = new Latest(
      seek,
      (error) => refuse(error as PneumaError),
      () => this.tell(),
    );
    this.slider.addEventListener("input", () => this.goTo(this.slider.valueAsNumber));
    this.slider.addEventListener("pointerdown", () => (this.isHeld = true));
    for (const end of ["pointerup", "pointercancel"]) {
      this.slider.addEventListener(end, () => (this.isHeld = false));
    }
    element("back").addEventListener("click", () => this.goTo(this.place - jumpS));
    element("ahead").addEventListener("click", () => this.goTo(this.place + jumpS));
    this.nowButton.addEventListener("click", () => this.toNow());
  }

  /** Whether the past is looked at, which cannot be touched. */
  get isPast(): boolean {
    return this.lookedAtS !== undefined;
  }

  /** How long ago is what is looked at, in words; undefined: it is now, or a recording's. */
  get pastTold(): string | undefined {
    return this.isPast ? this.pastText() : undefined;
  }

  /** Whether a recording stands at its last frame. */
  get isAtEnd(): boolean {
    return this.recording?.isEnd(this.tick) ?? false;
  }

  /** Another world, or the same again: a recording, or one that runs. */
  begin(recording: Recording | undefined): void {
    this.recording = recording;
    this.past.clear();
    this.marks.begin(recording === undefined);
    this.seeks.drop();
    this.tick = recording?.firstTick ?? 0;
    this.slider.min = recording ? "0" : String(-pastS);
    this.slider.max = String(recording?.durationS ?? 0);
    this.toNow();
  }

  take(frame: Frame): void {
    const wasAtEnd = this.isAtEnd;
    this.tick = frame.tick;
    if (!this.recording) this.past.take(frame, !this.isPast);
    else if (this.isAtEnd !== wasAtEnd) this.moved();
  }

  /** Something happened; in a recording at this tick, else now. */
  mark(kind: MarkKind, text: string, tick: bigint): void {
    if (text === "") return;
    this.marks.add({ atS: this.placeOf(tick), kind, text });
  }

  /** What a recording holds, which a server would tell of when it comes to it; and its key frames. */
  markAll({ frames }: RecordingFile): void {
    const keys = frames.filter(({ frame }) => frame.baseTick === undefined);
    this.marks.setKeys(keys.map(({ frame }) => this.placeOf(frame.tick)));
    for (const { before } of frames) {
      for (const { happening } of before) {
        if (happening.case === "event") this.mark("event", happeningText(happening.value), happening.value.tick);
        else this.mark("deed", deedText(happening.value), happening.value.tick);
      }
    }
  }

  /** What is to be seen in the place of what comes. */
  moment(resets: number): Moment | undefined {
    if (this.lookedAtS === undefined) return undefined;
    const moment = this.past.at(this.lookedAtS);
    return moment && { ...moment, resets };
  }

  /** Brings the line up to date. */
  tell(): void {
    const { recording, past, place } = this;
    if (!this.isHeld && !this.seeks.isSending) this.slider.value = String(place);
    // What is looked at stands still: so does the line under it.
    const endS = recording?.durationS ?? (this.isPast ? this.stoodAtS : past.nowS);
    const beginS = recording ? 0 : endS - pastS;
    if (!recording && !this.isPast) this.marks.forgetBefore(beginS);
    this.marks.draw(beginS, endS);
    const at = recording ? `${seconds(place)} / ${seconds(recording.durationS)} s` : this.pastText();
    this.told.value = at;
    const happened = this.marks.textAt(recording ? place : endS + place);
    this.slider.setAttribute("aria-valuetext", happened === "" ? at : `${at}: ${happened}`);
    this.slider.title = happened;
    this.tellLately();
  }

  private tellLately(): void {
    const { recording, past } = this;
    const untilS = recording ? this.place : past.nowS;
    const when = (atS: number) => (recording ? `at ${seconds(atS)} s` : `${seconds(past.nowS - atS)} s ago`);
    this.lately.replaceChildren(
      ...this.marks
        .latest(latelyMax, untilS)
        .flatMap(({ atS, text }) => [
          Object.assign(document.createElement("dt"), { textContent: when(atS) }),
          Object.assign(document.createElement("dd"), { textContent: text }),
        ]),
    );
  }

  private placeOf(tick: bigint): number {
    return this.recording?.atS(Number(tick)) ?? this.past.nowS;
  }

  /** The slider's value. */
  private get place(): number {
    if (this.recording) return this.recording.atS(this.tick);
    return this.lookedAtS === undefined ? 0 : this.lookedAtS - this.stoodAtS;
  }

  private pastText(): string {
    return this.lookedAtS === undefined ? "now" : `${seconds(this.past.nowS - this.lookedAtS)} s ago`;
  }

  private goTo(place: number): void {
    const { recording, past } = this;
    if (recording) {
      this.seeks.put(Math.min(recording.durationS, Math.max(0, place)));
      return;
    }
    if (!this.isPast) this.stoodAtS = past.nowS;
    const atS = Math.max(past.beginS, this.stoodAtS + place);
    if (atS >= this.stoodAtS) return this.toNow();
    this.lookedAtS = atS;
    this.show();
  }

  private toNow(): void {
    this.lookedAtS = undefined;
    this.show();
  }

  private show(): void {
    document.body.classList.toggle("past", this.isPast);
    this.nowButton.disabled = !this.isPast;
    this.nowButton.classList.toggle("main", this.isPast);
    this.tell();
    this.moved();
  }
}
