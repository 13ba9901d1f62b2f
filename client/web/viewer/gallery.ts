// The worlds of the server as cards, each with a small live picture. Only those cards that can be seen are streamed to,
// coarsely and slowly, and only while the gallery is open.
import type { Client, Stream, SubscribeOptions, WorldList_World } from "../src/index.js";
import { element } from "./element.js";
import { Thumbnail, Thumbnails } from "./thumbnails.js";

const rateHz = 6;
// Less than a pixel of a card, in a world of a few metres.
const maxErrorM = 0.01;
// Of a body: what a picture of this size can show.
const verticesWanted = 300;
// Of the streams that a connection may have, and of what a slow machine draws.
const streamsMax = 12;

interface Card {
  readonly item: HTMLLIElement;
  readonly link: HTMLAnchorElement;
  readonly facts: HTMLElement;
  readonly thumbnail: Thumbnail;
  world: WorldList_World;
  isSeen: boolean;
  isBusy: boolean;
  stream: Stream | undefined;
}

function optionsFor({ vertices, softBodies }: WorldList_World): SubscribeOptions {
  const ofABody = vertices / Math.max(softBodies, 1);
  // Each level has a quarter of the vertices of the one before.
  const levelOfDetail = Math.min(8, Math.max(0, Math.floor(Math.log2(ofABody / verticesWanted) / 2)));
  return { rateHz, maxErrorM, levelOfDetail };
}

function factsOf({ softBodies, rigidBodies, vertices, paused }: WorldList_World): string {
  const bodies = softBodies + rigidBodies;
  return `${bodies} ${bodies === 1 ? "body" : "bodies"}, ${vertices} vertices${paused ? ", paused" : ""}`;
}

export class Gallery {
  private readonly list = element("cards");
  private readonly cards = new Map<string, Card>();
  private readonly observer: IntersectionObserver;
  private readonly thumbnails = new Thumbnails();
  private client: Client | undefined;
  private isOpen = false;
  private isDark = false;

  constructor() {
    this.observer = new IntersectionObserver(
      (entries) => {
        for (const { target, isIntersecting } of entries) {
          const card = [...this.cards.values()].find(({ item }) => item === target);
          if (card) card.isSeen = isIntersecting;
        }
        this.follow();
      },
      { root: element("gallery") },
    );
  }

  open(isOpen: boolean): void {
    this.isOpen = isOpen;
    this.follow();
  }

  show(dark: boolean): void {
    this.isDark = dark;
    for (const { thumbnail } of this.cards.values()) thumbnail.show(dark);
  }

  /** Takes the list of worlds as it is now, and which of them is on the page. */
  update(client: Client, worlds: readonly WorldList_World[], shown: string): void {
    if (client !== this.client) this.clear(); // its streams went with it
    this.client = client;
    const names = new Set(worlds.map(({ name }) => name));
    for (const [name, card] of this.cards) if (!names.has(name)) this.remove(card);
    for (const world of worlds) {
      const card = this.cards.get(world.name) ?? this.add(world);
      card.world = world;
      card.facts.textContent = factsOf(world);
      card.link.setAttribute("aria-current", String(world.name === shown));
    }
    this.follow();
  }

  private add(world: WorldList_World): Card {
    const item = document.createElement("li");
    const link = document.createElement("a");
    const canvas = document.createElement("canvas");
    const name = document.createElement("strong");
    const facts = document.createElement("small");
    link.href = `#${new URLSearchParams({ world: world.name })}`;
    canvas.setAttribute("aria-hidden", "true");
    name.textContent = world.name;
    link.append(canvas, name, facts);
    item.append(link);
    const thumbnail = new Thumbnail(canvas, this.thumbnails);
    thumbnail.show(this.isDark);
    const card = { item, link, facts, thumbnail, world, isSeen: false, isBusy: false, stream: undefined };
    this.cards.set(world.name, card);
    this.list.append(item);
    this.observer.observe(item);
    return card;
  }

  private remove(card: Card): void {
    this.cards.delete(card.world.name);
    this.observer.unobserve(card.item);
    card.item.remove();
    card.thumbnail.clear();
  }

  private clear(): void {
    for (const card of this.cards.values()) this.remove(card);
  }

  /** Sees to it that those cards have streams that are to have them. */
  private follow(): void {
    let left = streamsMax;
    for (const card of this.cards.values()) {
      const isWanted = this.isOpen && card.isSeen && left-- > 0;
      if (!card.isBusy && isWanted !== (card.stream !== undefined)) void this.turn(card, isWanted);
    }
  }

  private async turn(card: Card, isWanted: boolean): Promise<void> {
    const { client } = this;
    if (client?.state !== "open") return;
    card.isBusy = true;
    try {
      if (isWanted) {
        card.stream = await client.subscribe(card.world.name, optionsFor(card.world), {
          frame: (frame) => card.thumbnail.take(frame),
          ended: () => {
            card.stream = undefined;
            card.thumbnail.clear();
          },
        });
      } else if (card.stream) {
        await client.unsubscribe(card.stream);
      }
    } catch {
      // It is tried again with the next list.
      card.isBusy = false;
      return;
    }
    card.isBusy = false;
    this.follow(); // what is wanted may be another by now
  }
}
