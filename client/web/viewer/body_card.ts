// The selected body's card: what is known of it, once a second.
import type { Frame, Scene } from "../src/index.js";
import { factsOf } from "./body_facts.js";
import { element } from "./element.js";
import type { Measured, StatsFeed } from "./stats_feed.js";

// The server measures the whole world for it.
const wish = { intervalMs: 1000, hasRoundTrip: false };

export interface Shown {
  /** "": nothing is selected. */
  readonly selected: string;
  readonly scene: Scene | undefined;
  readonly frame: Frame | undefined;
  readonly hasContacts: boolean;
}

export class BodyCard {
  private readonly place = element("card");
  private followed = "";
  private readonly watcher = (measured: Measured) => this.take(measured);

  constructor(
    private readonly feed: StatsFeed,
    private readonly shown: () => Shown,
  ) {}

  /** Asks for what there is to know as long as something is selected, and the panel and the card's group are open. */
  follow(): void {
    const { selected } = this.shown();
    const isOpen = this.place.closest("details:not([open])") === null;
    if (selected !== this.followed) this.feed.watch(this.watcher, false, wish); // of another one it asks at once
    this.followed = selected;
    this.feed.watch(this.watcher, selected !== "" && isOpen, wish);
    if (selected === "") this.place.replaceChildren();
  }

  private take({ stats }: Measured): void {
    const { selected, scene, ...rest } = this.shown();
    const facts = scene ? factsOf(selected, { stats, scene, ...rest }) : [];
    this.place.replaceChildren(
      ...facts.flatMap(([name, value]) => [
        Object.assign(document.createElement("dt"), { textContent: name }),
        Object.assign(document.createElement("dd"), { textContent: value }),
      ]),
    );
  }
}
