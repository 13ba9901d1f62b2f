// The page: connects, shows the worlds and one of them in 3D, and hands what its controls say to the server.
import {
  Client,
  Event_Kind,
  type Frame,
  PneumaError,
  type Stream,
  type SubscribeOptions,
  WorkerDecoder,
  type WorldList_World,
} from "../src/index.js";
import { isLasting, retryDelayMs } from "../src/retry.js";
import { noteView, wantedView, wantedWorld } from "./address.js";
import { Controls } from "./controls.js";
import { refuse } from "./effect.js";
import { Dock } from "./dock.js";
import { element } from "./element.js";
import { Gallery } from "./gallery.js";
import { Gauge } from "./gauge.js";
import { Pointer, type Tool } from "./hands.js";
import { Picture } from "./picture.js";
import { Legend } from "./legend.js";
import { listenToLooks, neededFor, shownNow } from "./looks.js";
import { Plan } from "./plan.js";
import { Playback } from "./playback.js";
import { Plots } from "./plots.js";
import { SlowMotion } from "./slow_motion.js";
import { type Measured, StatsFeed } from "./stats_feed.js";
import { tellStatus } from "./status_line.js";
import { subscribeAsFarAsCanBe } from "./subscribing.js";
import { beginTheme } from "./theme.js";
import { plain } from "./world_view.js";
import { WorldList } from "./world_list.js";

const maxErrorM = 0.0005;
const statusIntervalMs = 500;
const tokenKey = "pneuma-token";

const notice = element("notice");
const worlds = element<HTMLSelectElement>("world");
const pauseButton = element<HTMLButtonElement>("pause");
const stepButton = element<HTMLButtonElement>("step");

function say(text: string): void {
  notice.textContent = text;
  notice.hidden = text === "";
}

const socketUrl = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws`;

/** What to show where the address names none: one that moves. */
function liveliest(list: readonly WorldList_World[]): string | undefined {
  const running = list.filter(({ paused }) => !paused);
  const moving = running.find(({ sceneName }) => sceneName === "five-balls");
  return (moving ?? running.find(({ softBodies }) => softBodies > 0) ?? list[0])?.name;
}

class Page {
  private readonly playback = new Playback();
  private readonly controls: Controls;
  private readonly slowMotion: SlowMotion;
  private readonly legend = new Legend();
  private readonly plots = new Plots();
  private readonly plan = new Plan();
  private readonly statsFeed = new StatsFeed(() => {
    const { client, world, stream } = this;
    return client?.state === "open" && stream ? { client, world } : undefined;
  });
  private shown = plain;
  private readonly dock = new Dock();
  private readonly gallery = new Gallery();
  private readonly worldList = new WorldList((list) => this.listChanged(list));
  private readonly pointer: Pointer;
  private client: Client | undefined;
  private stream: Stream | undefined;
  private wanted = ""; // of the stream, which may have less
  private world = "";
  private isPaused = false;
  // Worlds are opened one after the other, and of those that wait only the last.
  private opening: Promise<void> = Promise.resolve();
  private openings = 0;
  private opened = 0;
  private readonly gauge = new Gauge();
  private decoder: WorkerDecoder | undefined;
  private asleep = 0;
  private failures = 0; // to connect for the first time

  constructor(private readonly picture: Picture) {
    const present = () => {
      const token = sessionStorage.getItem(tokenKey) ?? "";
      return this.client && { client: this.client, world: this.world, isPaused: this.isPaused, url: socketUrl, token };
    };
    this.controls = new Controls(picture, present, (world) => this.turnTo(world));
    this.slowMotion = new SlowMotion(present, (scale) => this.playback.slowTo(scale));
    this.pointer = new Pointer(picture, element<HTMLCanvasElement>("picture"), () => {
      if (this.client?.state !== "open" || !this.stream) return undefined;
      const tool = document.querySelector<HTMLInputElement>("input[name=tool]:checked")!.value as Tool;
      const massKg = (body: string) => this.controls.massKg(body);
      const clicked = (x: number, y: number) => this.controls.clicked(x, y, tool);
      return { client: this.client, world: this.world, tool, massKg, clicked, failed: refuse };
    });
    this.listen();
    setInterval(() => this.tell(), statusIntervalMs);
    const draw = (nowMs: number) => {
      requestAnimationFrame(draw);
      const moment = this.playback.at(nowMs);
      const begin = performance.now();
      if (moment) this.picture.update(moment);
      const shown = moment && (moment.fraction < 1 ? moment.from : moment.to);
      if (shown) element("status").dataset["shown"] = String(shown.tick);
      this.gauge.add({ pictures: 1, updateMs: performance.now() - begin });
      this.picture.draw(nowMs);
      this.pointer.draw();
    };
    requestAnimationFrame(draw);
  }

  async connect(token: string): Promise<void> {
    say("Connecting…");
    this.decoder = new WorkerDecoder(new Worker("decode-worker.js", { type: "module" }));
    try {
      this.client = await Client.connect(socketUrl, {
        token,
        clientName: "page",
        decoder: this.decoder,
        stateChanged: (state, reason) => {
          document.body.classList.toggle("lost", state !== "open");
          if (state === "open") void this.resume();
          else if (state === "lost") say("The connection is lost. Reconnecting…");
          else if (reason) this.turnedAway(reason, token);
        },
        event: ({ kind, world, body }) => {
          if (kind === Event_Kind.BODY_FROZEN && world === this.world) this.picture.frozen.add(body);
          if (kind === Event_Kind.WORLD_RESET && world === this.world) void this.readScene();
          if (kind === Event_Kind.WORLD_DESTROYED) this.worldList.refresh().catch(() => {});
        },
      });
      sessionStorage.setItem(tokenKey, token);
      await this.open();
    } catch (error) {
      this.notConnected(error as PneumaError, token);
    }
  }

  private notConnected(error: PneumaError, token: string): void {
    if (isLasting(error)) return this.turnedAway(error, token);
    say(`${error.message}. Trying again…`);
    setTimeout(() => void this.connect(token), retryDelayMs(this.failures++, error.retryAfterS));
  }

  /** Of a token that was refused, also where the server asks for another one than before. */
  private turnedAway({ code, message }: PneumaError, token: string): void {
    element("sign-in").hidden = code !== "UNAUTHENTICATED";
    say(code === "UNAUTHENTICATED" && token === "" ? "" : message);
  }

  private listen(): void {
    const show = () => {
      this.shown = shownNow();
      document.documentElement.classList.toggle("dark", this.shown.dark);
      this.picture.show(this.shown);
      this.gallery.show(this.shown.dark);
      this.plots.redraw();
      const options = this.streamOptions();
      if (this.stream && JSON.stringify(options) !== this.wanted) void this.open();
    };
    listenToLooks(show);
    beginTheme(element<HTMLInputElement>("dark"));
    show();
    this.dock.on("gallery", (isOpen) => this.gallery.open(isOpen));
    const toPlots = (measured: Measured) => this.plots.takeStats(measured);
    const toPlan = (measured: Measured) => this.plan.take(measured);
    this.dock.on("plots", (isOpen) => {
      this.plots.open(isOpen);
      this.statsFeed.watch(toPlots, isOpen);
    });
    this.dock.on("plan", (isOpen) => {
      this.plan.clear();
      this.statsFeed.watch(toPlan, isOpen);
    });

    worlds.addEventListener("change", () => {
      location.hash = new URLSearchParams({ world: worlds.value }).toString();
    });
    addEventListener("hashchange", () => void this.open());
    this.picture.orbit.addEventListener("end", () => noteView(this.world, this.picture.view));
    element("frame-all").addEventListener("click", () => {
      this.picture.frameAll();
      noteView(this.world, this.picture.view);
    });
    pauseButton.addEventListener("click", () => {
      void this.ask((client) =>
        this.isPaused ? client.resume(this.world, this.slowMotion.wished) : client.pause(this.world),
      );
    });
    stepButton.addEventListener("click", () => void this.ask((client) => client.step(this.world)));
    const confirm = element<HTMLDialogElement>("reset-confirm");
    const reset = () => void this.ask((client) => client.reset(this.world));
    element("reset").addEventListener("click", () => (this.controls.hasDeeds ? confirm.showModal() : reset()));
    element("reset-no").addEventListener("click", () => confirm.close());
    element("reset-yes").addEventListener("click", () => {
      confirm.close();
      reset();
    });
    const keys: Record<string, string> = {
      " ": "pause",
      ".": "step",
      r: "reset",
      w: "wireframe",
      v: "velocities",
      l: "dark",
      f: "frame-all",
      1: "tool-pull",
      2: "tool-poke",
      3: "tool-throw",
      t: "throw",
      a: "add",
      u: "upload-open",
      n: "new-world-open",
      c: "record",
      delete: "remove",
      g: "show-gallery",
      i: "show-view",
      p: "show-plots",
      s: "show-plan",
    };
    addEventListener("keydown", (event) => {
      const { key, target } = event;
      const isOn = (controls: string) => target instanceof HTMLElement && target.matches(controls);
      const isText = isOn("#token, input[type=text], input[type=number]");
      const isTaken = isText || isOn("select") || (key === " " && isOn("button, summary, input"));
      const isCommand = event.ctrlKey || event.metaKey;
      const command = key?.toLowerCase() === "z" ? (event.shiftKey ? "redo" : "undo") : undefined;
      const id = isCommand ? command : keys[key?.toLowerCase()]; // what fills in a field sends events without a key
      if ((event.repeat && id !== "step") || document.querySelector("dialog[open]")) return;
      if (!id || (isCommand ? isText : isTaken) || event.altKey) return;
      event.preventDefault();
      element(id).click();
    });
    element<HTMLFormElement>("sign-in").addEventListener("submit", (event) => {
      event.preventDefault();
      element("sign-in").hidden = true;
      void this.connect(element<HTMLInputElement>("token").value);
    });
  }

  /** Shows the world that the address names, or a lively one. */
  private open(): Promise<void> {
    const own = ++this.openings;
    this.opening = this.opening.then(async () => {
      if (own !== this.openings) return;
      await this.show();
      this.opened = own;
    });
    return this.opening;
  }

  private async show(): Promise<void> {
    const { client } = this;
    if (!client) return;
    try {
      const list = await this.worldList.refresh(client);
      const world = wantedWorld() ?? (this.stream ? this.world : liveliest(list));
      if (wantedWorld() === null) this.dock.open("gallery");
      const view = wantedView();
      const isSame = this.stream !== undefined && world === this.world;
      const options = this.streamOptions();
      if (this.stream && isSame && JSON.stringify(options) === this.wanted) {
        if (view) this.picture.look(view);
        return this.tellWorld(list);
      }
      if (this.stream) await client.unsubscribe(this.stream);
      if (!isSame) this.playback.clear();
      if (world === undefined) return say("This server has no worlds.");
      this.world = world;
      this.tellWorld(list);
      if (!isSame) {
        this.picture.forget(view);
        this.plots.clear();
        this.controls.end();
      }
      this.wanted = JSON.stringify(options);
      this.stream = await subscribeAsFarAsCanBe(client, world, options, {
        frame: (frame) => this.take(frame),
        // A pause or an edit may be among what was left out.
        gap: (from, to) => {
          this.gauge.add({ dropped: to - from + 1 });
          this.controls.missed();
          void this.ask(async () => this.tellWorld(await client.worlds()));
        },
        applied: (applied) => {
          const request = applied.command?.request;
          if (request?.case === "pause" || request?.case === "resume") this.setPaused(request.case === "pause");
          if (request?.case === "resume" && request.value.timeScale) this.slowMotion.follow(request.value.timeScale);
          this.controls.applied(applied);
        },
        ended: (error) => {
          this.stream = undefined;
          if (error.code === "NOT_FOUND") this.noWorld(`The world “${world}” is gone.`);
        },
      });
      document.body.classList.remove("gone");
      document.title = `${world} · Pneuma`;
      say("");
      await this.readScene();
    } catch (error) {
      if ((error as PneumaError).code === "NOT_FOUND")
        this.noWorld(`There is no world “${this.world}” on this server.`);
      else say((error as PneumaError).message);
    }
  }

  private streamOptions(): SubscribeOptions {
    return { maxErrorM, commands: true, ...neededFor(this.shown) };
  }

  private noWorld(why: string): void {
    say(why);
    this.controls.end();
    document.body.classList.add("gone");
    this.dock.open("gallery");
  }

  private listChanged(list: readonly WorldList_World[]): void {
    const options = list.map(({ name, vertices }) => new Option(`${name} (${vertices} vertices)`, name));
    const isSame = options.length === worlds.length && options.every(({ text }, i) => text === worlds.options[i]!.text);
    if (!isSame) worlds.replaceChildren(...options); // an open selection would close
    worlds.value = this.world;
    if (!this.client) return;
    this.gallery.update(this.client, list, this.world);
    const wanted = wantedWorld() ?? liveliest(list);
    const isIdle = !this.stream && this.opened === this.openings;
    if (isIdle && list.some(({ name }) => name === wanted)) void this.open(); // it has come
  }

  private tellWorld(list: readonly WorldList_World[]): void {
    worlds.value = this.world;
    const world = list.find(({ name }) => name === this.world);
    this.setPaused(world?.paused ?? false);
    this.slowMotion.follow(world?.timeScale || 1);
  }

  /** After a connection that was lost. */
  private async resume(): Promise<void> {
    if (!this.client) return;
    if (!this.stream) return this.open();
    try {
      say("");
      this.tellWorld(await this.worldList.refresh());
      await this.readScene();
    } catch (error) {
      say((error as PneumaError).message);
    }
  }

  private async readScene(): Promise<void> {
    const { client, world } = this;
    if (!client) return;
    try {
      const [{ softBodies }] = await Promise.all([client.stats(world), this.controls.begin(client, world)]);
      if (world !== this.world) return;
      this.picture.frozen.clear();
      for (const { name, frozen } of softBodies) if (frozen) this.picture.frozen.add(name);
    } catch (error) {
      refuse(error as PneumaError);
    }
  }

  /** Any, where it is null. */
  private turnTo(world: string | null): void {
    const next = world === null ? "" : new URLSearchParams({ world }).toString();
    if (location.hash.slice(1) === next) void this.open();
    else location.hash = next;
  }

  private async ask(request: (client: Client) => Promise<unknown>): Promise<void> {
    try {
      if (this.client) await request(this.client);
    } catch (error) {
      refuse(error as PneumaError);
    }
  }

  private setPaused(isPaused: boolean): void {
    this.isPaused = isPaused;
    pauseButton.textContent = isPaused ? "Resume" : "Pause";
    stepButton.disabled = !isPaused;
  }

  private take(frame: Frame): void {
    this.playback.push(frame);
    this.controls.take(frame);
    this.plots.takeFrame(frame);
    this.gauge.add({ frames: 1, bytes: frame.bytes });
    this.asleep = frame.scalars?.asleep.filter((isAsleep) => isAsleep).length ?? 0;
    element("status").dataset["tick"] = String(frame.tick);
    element("status").dataset["time"] = frame.timeS.toFixed(1);
  }

  private tell(): void {
    this.gauge.add({ decodeMs: Math.max(0, (this.decoder?.decodeMs ?? 0) - this.gauge.all.decodeMs) });
    tellStatus(this.gauge, { asleep: this.asleep, frozen: this.picture.frozen.size });
    this.picture.tell(this.legend, this.shown.field);
    element<HTMLOutputElement>("contact-count").value = this.shown.contacts ? String(this.picture.contactCount) : "";
  }
}

try {
  const page = new Page(
    new Picture(element<HTMLCanvasElement>("picture"), [element("header"), element("panel"), element("sheets")]),
  );
  void page.connect(sessionStorage.getItem(tokenKey) ?? "");
} catch (error) {
  say(`This browser shows no 3D picture: ${(error as Error).message}`);
}
