// The world that the page shows: opened as the address names it, followed by its stream, and given up where it is gone.
import {
  type Applied,
  type Client,
  type Frame,
  type PneumaError,
  type Stream,
  type SubscribeOptions,
  type WorldList_World,
} from "../src/index.js";
import { Recording } from "./recording.js";
import { type View, wantedView, wantedWorld } from "./address.js";
import { subscribeAsFarAsCanBe } from "./subscribing.js";
import { inWords } from "./words.js";
import { WorldList } from "./world_list.js";

/** What follows the world. */
export interface Stage {
  /** What its stream is to bring. */
  options(): SubscribeOptions;
  say(text: string): void;
  /** The worlds that there are. */
  listed(list: readonly WorldList_World[]): void;
  /** Another world takes its turn, seen from `view` where there is one. */
  turn(view: View | undefined): void;
  look(view: View): void;
  /** It runs or stands still, its time over real time at `timeScale`; undefined: as before. */
  paced(isPaused: boolean, timeScale: number | undefined): void;
  frame(frame: Frame): void;
  gap(fromTick: number, toTick: number): void;
  /** Its vertices went wrong; it goes on with a key frame. */
  fault(error: PneumaError): void;
  applied(applied: Applied): void;
  /** A world that was not shown before comes: a recording, or one that runs. */
  found(recording: Recording | undefined): void;
  /** The world is there, maybe another one than before. */
  begun(client: Client, world: string): Promise<void>;
  gone(why: string): void;
}

/** What to show where the address names none: one that moves. */
function liveliest(list: readonly WorldList_World[]): string | undefined {
  const running = list.filter(({ paused }) => !paused);
  const named = (scene: string) => running.find(({ sceneName }) => sceneName === scene);
  return (named("hero") ?? named("five-balls") ?? running.find(({ softBodies }) => softBodies > 0) ?? list[0])?.name;
}

export class ShownWorld {
  private readonly list = new WorldList((worlds) => this.listChanged(worlds));
  private client: Client | undefined;
  private stream: Stream | undefined;
  private wanted = ""; // of the stream, as text; a recording may have less
  private name_ = "";
  private ended = ""; // the world that was shown and is gone
  private isPaused_ = false;
  private recording: Recording | undefined;
  // Worlds are opened one after the other, and of those that wait only the last.
  private opening: Promise<void> = Promise.resolve();
  private openings = 0;
  private opened = 0;

  constructor(private readonly stage: Stage) {
    addEventListener("hashchange", () => void this.open());
  }

  /** It stays so when the world is gone. */
  get name(): string {
    return this.name_;
  }

  get isPaused(): boolean {
    return this.isPaused_;
  }

  /** Whose world it is, as long as it can be asked for things. */
  get live(): { client: Client; world: string } | undefined {
    const { client, stream, name_ } = this;
    return client?.state === "open" && stream ? { client, world: name_ } : undefined;
  }

  /** Takes it from another server's client, or for the first time. */
  async connect(client: Client): Promise<void> {
    this.client = client;
    this.stream = undefined;
    await this.open();
  }

  /** After a connection that was lost. */
  async resume(): Promise<void> {
    const { client, name_ } = this;
    if (!client) return;
    if (!this.stream) return this.open();
    try {
      this.stage.say("");
      this.tell(await this.list.refresh());
      await this.stage.begun(client, name_);
    } catch (error) {
      this.stage.say(inWords(error as PneumaError));
    }
  }

  /** Shows the world that the address names, or a lively one. */
  open(): Promise<void> {
    const own = ++this.openings;
    this.opening = this.opening.then(async () => {
      if (own !== this.openings) return;
      await this.show();
      this.opened = own;
    });
    return this.opening;
  }

  /** Shows another; any, where it is null. */
  turnTo(world: string | null): void {
    const next = world === null ? "" : new URLSearchParams({ world }).toString();
    if (location.hash.slice(1) === next) void this.open();
    else location.hash = next;
  }

  /** Has its stream bring what the stage wants now. */
  followOptions(): void {
    if (this.stream && !this.isAsWanted) void this.open();
  }

  /** The worlds may be others. */
  async refresh(): Promise<void> {
    await this.list.refresh();
  }

  private get isAsWanted(): boolean {
    return this.wanted === JSON.stringify(this.stage.options());
  }

  private async show(): Promise<void> {
    const { client, stage } = this;
    if (!client) return;
    try {
      const list = await this.list.refresh(client);
      const world = wantedWorld() ?? (this.stream ? this.name_ : liveliest(list));
      const view = wantedView();
      const isSame = this.stream !== undefined && world === this.name_;
      if (this.stream && isSame && this.isAsWanted) {
        if (view) stage.look(view);
        return this.tell(list);
      }
      if (this.stream) await client.unsubscribe(this.stream);
      if (!isSame) stage.turn(view);
      if (world === undefined) return stage.say("This server has no worlds.");
      this.name_ = world;
      if (!isSame) stage.found((this.recording = Recording.among(list, world)));
      this.tell(list);
      this.wanted = JSON.stringify(stage.options());
      this.stream = await subscribeAsFarAsCanBe(client, world, stage.options(), {
        frame: (frame) => stage.frame(frame),
        gap: (fromTick, toTick) => {
          stage.gap(fromTick, toTick);
          // A pause may be among what was left out.
          this.list.refresh().then(
            (worlds) => this.tell(worlds),
            () => {},
          );
        },
        fault: (error) => stage.fault(error),
        applied: (applied) => this.applied(applied),
        ended: (error) => {
          this.stream = undefined;
          if (error.code !== "NOT_FOUND") return;
          this.ended = world;
          this.tellGone();
        },
      });
      this.ended = "";
      stage.say("");
      await stage.begun(client, world);
    } catch (error) {
      if ((error as PneumaError).code === "NOT_FOUND") this.tellGone();
      else stage.say(inWords(error as PneumaError));
    }
  }

  private tellGone(): void {
    const { name_ } = this;
    this.stage.gone(
      this.ended === name_ ? `The world “${name_}” is gone.` : `There is no world “${name_}” on this server.`,
    );
  }

  private applied(applied: Applied): void {
    const request = applied.command?.request;
    if (request?.case === "pause") this.setPaused(true);
    if (request?.case === "resume") this.setPaused(false, request.value.timeScale);
    this.stage.applied(applied);
  }

  private tell(list: readonly WorldList_World[]): void {
    const world = list.find(({ name }) => name === this.name_);
    this.setPaused(world?.paused ?? false, world?.timeScale || 1);
  }

  private setPaused(isPaused: boolean, timeScale?: number): void {
    this.isPaused_ = isPaused;
    this.stage.paced(isPaused, timeScale);
  }

  private listChanged(list: readonly WorldList_World[]): void {
    this.stage.listed(list);
    // Of one that runs, Applied tells it sooner; of a recording nothing does.
    if (this.recording && this.stream) this.tell(list);
    const wanted = wantedWorld() ?? liveliest(list);
    const isIdle = this.client !== undefined && !this.stream && this.opened === this.openings;
    if (isIdle && list.some(({ name }) => name === wanted)) void this.open(); // it has come
  }
}
