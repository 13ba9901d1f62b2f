// The selected body's card: what is known of it, now or at the moment that is looked at.
import type { Frame, Scene } from "../src/index.js";
import { type Fact, factsOf } from "./body_facts.js";
import { element } from "./element.js";
import { factsOfFrame } from "./frame_facts.js";
import type { Moment } from "./playback.js";
import type { Measured, StatsFeed } from "./stats_feed.js";

// The server measures the whole world for it.
const wish = { intervalMs: 1000, hasRoundTrip: false };

const notRecorded = "not recorded";
const notKept = "–";

export interface Shown {
  /** "": nothing is selected. */
  readonly selected: string;
  readonly scene: Scene | undefined;
  readonly frame: Frame | undefined;
  readonly hasContacts: boolean;
  /** What is drawn. */
  readonly moment: Moment | undefined;
  readonly isRecording: boolean;
  /** How long ago that is, in words, while the past is looked at. */
  readonly past: string | undefined;
}

export class BodyCard {
  private readonly place = element("card");
  private followed = "";
  private readonly watcher = (measured: Measured) => this.take(measured);

  constructor(
    private readonly feed: StatsFeed,
    private readonly shown: () => Shown,
  ) {}

  /**
   * As long as something is selected, and the panel and the card's group are open: asks the server for what there is to
   * know. The server knows nothing of a recording or of the past: there, frames tell what they hold.
   */
  follow(): void {
    const { selected, isRecording, past } = this.shown();
    const isOpen = this.place.closest("details:not([open])") === null;
    const isMeasured = !isRecording && past === undefined;
    if (selected !== this.followed) this.feed.watch(this.watcher, false, wish); // of another one it asks at once
    this.followed = selected;
    this.feed.watch(this.watcher, selected !== "" && isOpen && isMeasured, wish);
    if (selected === "") this.show([]);
    else if (isOpen && !isMeasured) this.show(this.seen());
  }

  private take({ stats }: Measured): void {
    const { selected, scene, frame, hasContacts } = this.shown();
    this.show(scene ? factsOf(selected, { stats, scene, frame, hasContacts }) : []);
  }

  private seen(): readonly Fact[] {
    const { selected, scene, moment, isRecording, past } = this.shown();
    if (!scene || !moment) return [];
    const facts = factsOfFrame(selected, { moment, scene, absent: isRecording ? notRecorded : notKept });
    return past === undefined || facts.length === 0 ? facts : [["When", past], ...facts];
  }

  private show(facts: readonly Fact[]): void {
    this.place.replaceChildren(
      ...facts.flatMap(([name, value]) => [
        Object.assign(document.createElement("dt"), { textContent: name }),
        Object.assign(document.createElement("dd"), { textContent: value }),
      ]),
    );
  }
}
