// The scene of the world that is shown, as it holds now, and the edits made to it here, which can be taken back.
import { Client, type Done, PneumaError, type Scene } from "../src/index.js";
import { type Change, inverseOf } from "./inverse_edit.js";

// Many edits may come in a row, a slider's of another page: the scene is read once a while.
const readIntervalMs = 250;
const deedsMax = 100;

interface Deed {
  /** What was done, for people: "Remove ball-2". */
  readonly says: string;
  readonly changes: readonly Change[];
  readonly inverse: readonly Change[];
  /** One and the same for all edits of a slider that is drawn once. */
  readonly gesture: object | undefined;
}

/** The scene with what `changes` take out of it as it is at the moment: put back, it is to be where it was. */
export type Capture = (scene: Scene, changes: readonly Change[]) => Scene;

export class WorldEdits {
  private client: Client | undefined;
  private world = "";
  private scene_: Scene | undefined;
  private isStale = false;
  private isToRead = false;
  private reading: Promise<void> | undefined;
  private done: Deed[] = [];
  private undone: Deed[] = [];

  /** @param changed called when there is another scene, or other deeds to undo or redo */
  constructor(
    private readonly changed: () => void,
    private readonly failed: (error: PneumaError) => void,
    private readonly capture: Capture,
  ) {}

  /** As it was read last. */
  get scene(): Scene | undefined {
    return this.scene_;
  }
  get toUndo(): string | undefined {
    return this.done.at(-1)?.says;
  }
  get toRedo(): string | undefined {
    return this.undone.at(-1)?.says;
  }

  /** Turns to a world; of the one that is shown already, reads the scene anew. */
  async begin(client: Client, world: string): Promise<void> {
    if (world !== this.world) {
      this.forget();
      this.scene_ = undefined;
    }
    this.client = client;
    this.world = world;
    await this.read();
  }

  /** No world is shown any more. */
  end(): void {
    this.forget();
    this.client = undefined;
    this.world = "";
    this.scene_ = undefined;
    this.changed();
  }

  /** Where the world went back to its first scene there is nothing to take back. */
  forget(): void {
    this.done = [];
    this.undone = [];
  }

  /** Somebody edited the world. */
  async stale(): Promise<void> {
    this.isStale = true;
    if (this.isToRead) return;
    this.isToRead = true;
    await new Promise((resolve) => setTimeout(resolve, readIntervalMs));
    this.isToRead = false;
    if (this.isStale) await this.read().catch(this.failed);
  }

  /** The scene as it is now. */
  async fresh(): Promise<Scene> {
    if (this.isStale || !this.scene_) await this.read();
    return this.scene_!;
  }

  async make(says: string, changes: readonly Change[], gesture?: object): Promise<Done> {
    const last = this.done.at(-1);
    const goesOn = gesture !== undefined && last?.gesture === gesture;
    const inverse = goesOn ? last.inverse : await this.inverse(changes);
    const reply = await this.send(changes);
    if (goesOn && this.done.at(-1) === last) this.done.pop();
    this.done.push({ says, changes, inverse, gesture });
    if (this.done.length > deedsMax) this.done.shift();
    this.undone = [];
    this.changed();
    return reply;
  }

  /** Takes the last deed back; says what it was. */
  async undo(): Promise<{ says: string; tick: bigint } | undefined> {
    const deed = this.done.pop();
    if (!deed) return undefined;
    try {
      const { tick } = await this.send(deed.inverse);
      this.undone.push(deed);
      return { says: deed.says, tick };
    } finally {
      this.changed();
    }
  }

  async redo(): Promise<{ says: string; tick: bigint } | undefined> {
    const deed = this.undone.pop();
    if (!deed) return undefined;
    try {
      const inverse = await this.inverse(deed.changes);
      const { tick } = await this.send(deed.changes);
      this.done.push({ ...deed, inverse, gesture: undefined });
      return { says: deed.says, tick };
    } finally {
      this.changed();
    }
  }

  private async inverse(changes: readonly Change[]): Promise<Change[]> {
    return inverseOf(this.capture(await this.fresh(), changes), changes);
  }

  private async send(changes: readonly Change[]): Promise<Done> {
    if (!this.client) throw new PneumaError("UNAVAILABLE", "no world is open");
    const reply = await this.client.edit(this.world, { changes: [...changes] });
    this.isStale = true;
    return reply;
  }

  /** One at a time: what was asked for while one is under way may be older than that. */
  private async read(): Promise<void> {
    while (this.reading) await this.reading;
    const { client, world } = this;
    if (!client) return;
    this.isStale = false;
    this.reading = client.scene(world).then((scene) => {
      if (world === this.world) this.scene_ = scene;
    });
    try {
      await this.reading;
    } finally {
      this.reading = undefined;
    }
    this.changed();
  }
}
