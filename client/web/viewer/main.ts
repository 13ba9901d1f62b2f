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
import { Sliders } from "./changes.js";
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
import { type Measured, StatsFeed } from "./stats_feed.js";
import { tellStatus } from "./status_line.js";
import { beginTheme } from "./theme.js";
import { plain } from "./world_view.js";
import { WorldList } from "./world_list.js";

const phoneWidthPx = 600; // as in style.css
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

/** The address holds the world: `#world=five-balls`. */
function wantedWorld(): string | null {
  return new URLSearchParams(location.hash.slice(1)).get("world");
}

/** What to show where the address names none: one that moves. */
function liveliest(list: readonly WorldList_World[]): string | undefined {
  const running = list.filter(({ paused }) => !paused);
  const moving = running.find(({ sceneName }) => sceneName === "five-balls");
  return (moving ?? running.find(({ softBodies }) => softBodies > 0) ?? list[0])?.name;
}

class Page {
  private readonly playback = new Playback();
  private readonly sliders = new Sliders();
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
  private world = "";
  private isPaused = false;
  // Worlds are opened one after the other, and of those that wait only the last.
  private opening: Promise<void> = Promise.resolve();
  private openings = 0;
  private opened = 0;
  private readonly gauge = new Gauge();
  private decoder: WorkerDecoder | undefined;
  private asleep = 0;

  constructor(private readonly picture: Picture) {
    this.pointer = new Pointer(picture, element<HTMLCanvasElement>("picture"), () => {
      if (this.client?.state !== "open" || !this.stream) return undefined;
      const tool = document.querySelector<HTMLInputElement>("input[name=tool]:checked")!.value as Tool;
      const massKg = (body: string) => this.sliders.massKg(body);
      return { client: this.client, world: this.world, tool, massKg, failed: (error) => this.refused(error) };
    });
    this.listen();
    setInterval(() => this.tell(), statusIntervalMs);
    const draw = (nowMs: number) => {
      requestAnimationFrame(draw);
      const moment = this.playback.at(nowMs);
      const begin = performance.now();
      if (moment) this.picture.update(moment);
      this.gauge.add({ pictures: 1, updateMs: performance.now() - begin });
      this.picture.draw(nowMs);
      this.pointer.draw();
    };
    requestAnimationFrame(draw);
  }

  async connect(token: string): Promise<void> {
    say("Connecting…");
    this.decoder = new WorkerDecoder(new Worker("decode-worker.js", { type: "module" }));
    const url = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws`;
    try {
      this.client = await Client.connect(url, {
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
      this.turnedAway(error as PneumaError, token);
    }
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
      if (this.stream && JSON.stringify(options) !== JSON.stringify(this.stream.options)) void this.open();
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
    element("frame-all").addEventListener("click", () => this.picture.frameAll());
    pauseButton.addEventListener("click", () => {
      void this.ask((client) => (this.isPaused ? client.resume(this.world) : client.pause(this.world)));
    });
    stepButton.addEventListener("click", () => void this.ask((client) => client.step(this.world)));
    element("reset").addEventListener("click", () => void this.ask((client) => client.reset(this.world)));
    const keys: Record<string, string> = {
      " ": "pause",
      ".": "step",
      r: "reset",
      w: "wireframe",
      v: "velocities",
      l: "dark",
      f: "frame-all",
      g: "show-gallery",
      c: "show-view",
      p: "show-plots",
      t: "show-plan",
    };
    addEventListener("keydown", (event) => {
      const { key, target } = event;
      const isOn = (controls: string) => target instanceof HTMLElement && target.matches(controls);
      const isTaken = isOn("select, #token") || (key === " " && isOn("button, summary, input"));
      const id = keys[key?.toLowerCase()]; // a browser that fills in a field sends events without a key
      if (!id || isTaken || event.ctrlKey || event.metaKey || event.altKey) return;
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
      const isSame = this.stream !== undefined && world === this.world;
      const options = this.streamOptions();
      if (this.stream && isSame && JSON.stringify(options) === JSON.stringify(this.stream.options)) {
        return this.tellWorld(list);
      }
      if (this.stream) await client.unsubscribe(this.stream);
      if (!isSame) this.playback.clear();
      if (world === undefined) return say("This server has no worlds.");
      this.world = world;
      this.tellWorld(list);
      if (!isSame) this.picture.forget();
      if (!isSame) this.plots.clear();
      this.stream = await client.subscribe(world, options, {
        frame: (frame) => this.take(frame),
        // A pause may be among what was left out.
        gap: () => void this.ask(async () => this.tellWorld(await client.worlds())),
        applied: ({ command }) => {
          const kind = command?.request.case;
          if (kind === "pause" || kind === "resume") this.setPaused(kind === "pause");
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
    this.setPaused(list.find(({ name }) => name === this.world)?.paused ?? false);
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
      const [scene, { softBodies }] = await Promise.all([client.scene(world), client.stats(world)]);
      if (world !== this.world) return;
      this.picture.frozen.clear();
      for (const { name, frozen } of softBodies) if (frozen) this.picture.frozen.add(name);
      this.sliders.begin(client, world, scene);
    } catch (error) {
      this.refused(error as PneumaError);
    }
  }

  private async ask(request: (client: Client) => Promise<unknown>): Promise<void> {
    try {
      if (this.client) await request(this.client);
    } catch (error) {
      this.refused(error as PneumaError);
    }
  }

  private refused(error: PneumaError): void {
    this.sliders.say(error.message, true);
  }

  private setPaused(isPaused: boolean): void {
    this.isPaused = isPaused;
    pauseButton.textContent = isPaused ? "Resume" : "Pause";
    stepButton.disabled = !isPaused;
  }

  private take(frame: Frame): void {
    this.playback.push(frame);
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
  const panel = element<HTMLDetailsElement>("panel");
  panel.open = innerWidth > phoneWidthPx;
  const page = new Page(
    new Picture(element<HTMLCanvasElement>("picture"), [element("header"), panel, element("sheets")]),
  );
  void page.connect(sessionStorage.getItem(tokenKey) ?? "");
} catch (error) {
  say(`This browser shows no 3D picture: ${(error as Error).message}`);
}
