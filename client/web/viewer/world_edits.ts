// The scene of the world that is shown, as it holds now, and the edits made to it here, which can be taken back.
import { type Client, type Done, PneumaError, type Scene } from "../src/index.js";
import { type Change, heldOf, inverseOfSteps, joined, pumpedBy, type Step } from "./inverse_edit.js";
import { numbersIn, SceneFeed } from "./scene_feed.js";

const deedsMax = 100;
// Of all deeds together, some tens of megabytes.
const numbersMax = 4_000_000;

// A deed that was refused for one of these can be tried again.
function passes({ code, retryAfterS }: PneumaError): boolean {
  return code === "UNAVAILABLE" || (code === "LIMIT_EXCEEDED" && retryAfterS !== undefined);
}

export interface Wish {
  /** What is to be done, for people: "Remove ball-2". */
  readonly says: string;
  readonly changes: readonly Change[];
}

interface Deed {
  readonly says: string;
  readonly steps: readonly Step[];
  readonly numbers: number;
  /** The soft bodies that this page has pumped since: their gas is not what it was left at. */
  readonly pumped: ReadonlySet<string>;
  /** One and the same for all edits of a slider that is drawn once. */
  readonly gesture: object | undefined;
}

interface Deeds {
  readonly done: Deed[];
  undone: Deed[];
}

export interface Repeated {
  readonly says: string;
  /** From which on it is in effect; undefined: nothing was left to be taken back. */
  readonly tick: bigint | undefined;
  /** Whether all of it was as it was left here. */
  readonly isWhole: boolean;
}

/** A world that is shown. What is asked of it goes to it also when another is shown by then. */
interface Opened {
  readonly feed: SceneFeed;
  deeds: Deeds;
  /** Deeds are done one after the other. */
  turn: Promise<unknown>;
}

/** The scene with what `changes` take out of it as it is at the moment: put back, it is to be where it was. */
export type Capture = (scene: Scene, changes: readonly Change[]) => Scene;

export class WorldEdits {
  private opened: Opened | undefined;

  /** @param changed called when there is another scene, or other deeds to undo or redo */
  constructor(
    private readonly changed: () => void,
    private readonly failed: (error: PneumaError) => void,
    private readonly capture: Capture,
  ) {}

  /** As it was read last. */
  get scene(): Scene | undefined {
    return this.opened?.feed.scene;
  }
  get toUndo(): string | undefined {
    return this.opened?.deeds.done.at(-1)?.says;
  }
  get toRedo(): string | undefined {
    return this.opened?.deeds.undone.at(-1)?.says;
  }

  /** Turns to a world; of the one that is shown already, reads the scene anew. */
  async begin(client: Pick<Client, "scene" | "edit">, world: string): Promise<void> {
    if (this.opened?.feed.client !== client || this.opened.feed.world !== world) {
      const feed: SceneFeed = new SceneFeed(client, world, () => this.tell(feed));
      this.opened = { feed, deeds: { done: [], undone: [] }, turn: Promise.resolve() };
      this.changed();
    }
    await this.opened.feed.read();
  }

  /** No world is shown. */
  end(): void {
    this.opened = undefined;
    this.changed();
  }

  /** Where the world went back to its first scene there is nothing to take back. */
  forget(): void {
    if (this.opened) this.opened.deeds = { done: [], undone: [] };
    this.changed();
  }

  /** Somebody edited the world. */
  async stale(): Promise<void> {
    const { opened } = this;
    if (!opened) return;
    opened.feed.age();
    if ((await opened.feed.settled()) && this.opened === opened) await opened.feed.read().catch(this.failed);
  }

  /** The scene as the server has it, with what moves by itself. */
  async read(): Promise<Scene> {
    return this.current().feed.read();
  }

  /** The scene as it is now, to what is known. */
  async fresh(): Promise<Scene> {
    return this.current().feed.fresh();
  }

  /**
   * Does what is wished for of the scene as it is then, when what was wished for before is done. Gives the wish and the
   * server's answer; undefined: nothing was to be done.
   */
  async make<W extends Wish>(
    wish: (scene: Scene) => W | undefined,
    gesture?: object,
  ): Promise<(W & { readonly reply: Done }) | undefined> {
    return this.inTurn(async ({ feed, deeds }) => {
      const last = deeds.done.at(-1);
      const begun = gesture !== undefined && last?.gesture === gesture ? last : undefined;
      // What a slider changes does not move by itself.
      const scene = begun && feed.scene ? feed.scene : await (gesture ? feed.fresh() : feed.read());
      const wished = wish(scene);
      if (!wished || wished.changes.length === 0) return undefined;
      const { says, changes } = wished;
      const steps = joined(begun?.steps ?? [], this.capture(scene, changes), changes);
      const reply = await this.send(feed, changes);
      if (begun) deeds.done.pop();
      push(deeds, { says, steps, gesture, numbers: numbersIn(steps), pumped: new Set() });
      deeds.undone = [];
      this.tell(feed);
      return { ...wished, reply };
    });
  }

  /** Takes the last deed back, as far as others have not changed the same since. */
  async undo(): Promise<Repeated | undefined> {
    return this.inTurn(async ({ feed, deeds }) => {
      const deed = deeds.done.pop();
      if (!deed) return undefined;
      const { says } = deed;
      return this.orBack(feed, deeds.done, deed, async () => {
        const scene = await feed.read();
        const held = heldOf(scene, deed.steps, deed.pumped);
        if (held.length === 0) return { says, tick: undefined, isWhole: false };
        const { tick } = await this.send(feed, inverseOfSteps(held));
        deeds.undone.push(deed);
        return { says, tick, isWhole: held.length === deed.steps.length };
      });
    });
  }

  async redo(): Promise<Repeated | undefined> {
    return this.inTurn(async ({ feed, deeds }) => {
      const deed = deeds.undone.pop();
      if (!deed) return undefined;
      const { says, numbers } = deed;
      return this.orBack(feed, deeds.undone, deed, async () => {
        const changes = deed.steps.map(({ change }) => change);
        const steps = joined([], this.capture(await feed.read(), changes), changes);
        const { tick } = await this.send(feed, changes);
        push(deeds, { says, steps, numbers, gesture: undefined, pumped: new Set() });
        return { says, tick, isWhole: true };
      });
    });
  }

  /** What cannot be done now stays to be done. */
  private async orBack<Result>(
    feed: SceneFeed,
    from: Deed[],
    deed: Deed,
    action: () => Promise<Result>,
  ): Promise<Result> {
    try {
      return await action();
    } catch (error) {
      if (error instanceof PneumaError && passes(error)) from.push(deed);
      throw error;
    } finally {
      this.tell(feed);
    }
  }

  private current(): Opened {
    if (!this.opened) throw new PneumaError("UNAVAILABLE", "no world is open");
    return this.opened;
  }

  private async inTurn<Result>(action: (opened: Opened) => Promise<Result>): Promise<Result> {
    const opened = this.current();
    const result = opened.turn.then(() => action(opened));
    opened.turn = result.catch(() => {});
    return result;
  }

  private async send(feed: SceneFeed, changes: readonly Change[]): Promise<Done> {
    const reply = await feed.client.edit(feed.world, { changes: [...changes] });
    feed.age();
    return reply;
  }

  private tell(feed: SceneFeed): void {
    if (this.opened?.feed === feed) this.changed();
  }
}

function push({ done }: Deeds, deed: Deed): void {
  const pumped = pumpedBy(deed.steps.map(({ change }) => change));
  if (pumped.length > 0) {
    done.forEach((each, i) => (done[i] = { ...each, pumped: new Set([...each.pumped, ...pumped]) }));
  }
  done.push(deed);
  const sum = () => done.reduce((numbers, each) => numbers + each.numbers, 0);
  while (done.length > deedsMax || sum() > numbersMax) done.shift();
}
