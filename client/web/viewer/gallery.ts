// The worlds of the server as cards, each with a small picture. The pictures are renewed one after the other, of the cards
// that can be seen, while the gallery is open: a machine without a graphics card has the large picture to draw.
import type { Client, Frame, SubscribeOptions, WorldList_World } from "../src/index.js";
import { element } from "./element.js";
import { Thumbnails } from "./thumbnails.js";
import { counted } from "./words.js";

// A card's picture is no older than that, where there are few.
const ageMs = 20_000;
// A world that sends no frame for so long has its turn later.
const patienceMs = 5000;
// Less than a pixel of a card, in a world of a few metres.
const maxErrorM = 0.01;
// Of a body: what a picture of this size can show.
const verticesWanted = 300;

interface Card {
  readonly item: HTMLLIElement;
  readonly link: HTMLAnchorElement;
  readonly facts: HTMLElement;
  readonly canvas: HTMLCanvasElement;
  world: WorldList_World;
  isSeen: boolean;
  paintedAtMs: number;
}

function optionsFor({ vertices, softBodies }: WorldList_World): SubscribeOptions {
  const ofABody = vertices / Math.max(softBodies, 1);
  // Each level has a quarter of the vertices of the one before.
  const levelOfDetail = Math.min(8, Math.max(0, Math.floor(Math.log2(ofABody / verticesWanted) / 2)));
  return { maxErrorM, levelOfDetail };
}

function factsOf({ softBodies, rigidBodies, vertices, paused }: WorldList_World): string {
  const bodies = counted(softBodies + rigidBodies, "body", "bodies");
  return `${paused ? "paused, " : ""}${bodies}, ${counted(vertices, "vertex", "vertices")}`;
}

/** One frame of a world; undefined: none came. */
async function frameOf(client: Client, world: WorldList_World): Promise<Frame | undefined> {
  let came: (frame?: Frame) => void = () => {};
  const first = new Promise<Frame | undefined>((resolve) => (came = resolve));
  const stream = await client.subscribe(world.name, optionsFor(world), { frame: came, ended: () => came() });
  const timer = setTimeout(came, patienceMs);
  const frame = await first;
  clearTimeout(timer);
  await client.unsubscribe(stream).catch(() => {}); // it ended with its world
  return frame;
}

export class Gallery {
  private readonly list = element("cards");
  private readonly cards = new Map<string, Card>();
  private readonly observer: IntersectionObserver;
  private readonly thumbnails = new Thumbnails();
  private client: Client | undefined;
  private shown = ""; // the world on the page, once it has a card
  private isOpen = false;
  private isDark = false;
  private isPainting = false;

  /** @param newest what came last of the world on the page, which is streamed to it already */
  constructor(private readonly newest: () => Frame | undefined) {
    this.observer = new IntersectionObserver(
      (entries) => {
        for (const { target, isIntersecting } of entries) {
          const card = [...this.cards.values()].find(({ item }) => item === target);
          if (card) card.isSeen = isIntersecting;
        }
        void this.paint();
      },
      { root: element("gallery") },
    );
  }

  open(isOpen: boolean): void {
    this.isOpen = isOpen;
    this.reveal();
    void this.paint();
  }

  show(dark: boolean): void {
    if (dark !== this.isDark) for (const card of this.cards.values()) card.paintedAtMs = -Infinity;
    this.isDark = dark;
    void this.paint();
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
      card.link.title = `${world.name}: ${factsOf(world)}`;
      card.link.setAttribute("aria-current", String(world.name === shown));
    }
    if (shown !== this.shown && this.cards.has(shown)) {
      this.shown = shown;
      this.reveal();
    }
    void this.paint();
  }

  /** Brings the card of the world on the page into sight. */
  private reveal(): void {
    if (this.isOpen) this.cards.get(this.shown)?.item.scrollIntoView({ block: "nearest", inline: "center" });
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
    const card = { item, link, facts, canvas, world, isSeen: false, paintedAtMs: -Infinity };
    this.cards.set(world.name, card);
    this.list.append(item);
    this.observer.observe(item);
    return card;
  }

  private remove(card: Card): void {
    this.cards.delete(card.world.name);
    this.observer.unobserve(card.item);
    card.item.remove();
  }

  private clear(): void {
    for (const card of this.cards.values()) this.remove(card);
  }

  /** The card in sight whose picture is the oldest, if it is old. */
  private due(): Card | undefined {
    if (!this.isOpen || this.client?.state !== "open") return undefined;
    const seen = [...this.cards.values()].filter(({ isSeen }) => isSeen);
    const [oldest] = seen.sort((a, b) => a.paintedAtMs - b.paintedAtMs);
    return oldest && performance.now() - oldest.paintedAtMs > ageMs ? oldest : undefined;
  }

  /** Paints what is due, one after the other. It is called again with each list of worlds. */
  private async paint(): Promise<void> {
    if (this.isPainting) return;
    this.isPainting = true;
    for (let card = this.due(); card; card = this.due()) {
      card.paintedAtMs = performance.now();
      const { client, shown } = this;
      const own = card.world.name === shown ? this.newest() : undefined;
      const frame = own ?? (await frameOf(client!, card.world).catch(() => undefined));
      if (frame) this.thumbnails.paint(card.canvas, frame, this.isDark);
    }
    this.isPainting = false;
  }
}
