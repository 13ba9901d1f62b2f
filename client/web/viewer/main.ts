// The page: connects, shows the worlds and one of them in 3D, and hands what its controls say to the server.
import {
  Client,
  Event_Kind,
  type Frame,
  PneumaError,
  type Stream,
  WorkerDecoder,
  type WorldList_World,
} from "../src/index.js";
import { retryDelayMs } from "../src/retry.js";
import { noteView, wantedView, wantedWorld } from "./address.js";
import { Controls } from "./controls.js";
import { refuse } from "./effect.js";
import { element } from "./element.js";
import { Pointer, type Tool } from "./hands.js";
import { Picture } from "./picture.js";
import { Playback } from "./playback.js";
import { SlowMotion } from "./slow_motion.js";

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

const socketUrl = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws`;

class Page {
  private readonly playback = new Playback();
  private readonly controls: Controls;
  private readonly slowMotion: SlowMotion;
  private readonly pointer: Pointer;
  private client: Client | undefined;
  private stream: Stream | undefined;
  private world = "";
  private isPaused = false;
  // Worlds are opened one after the other, and of those that wait only the last.
  private opening: Promise<void> = Promise.resolve();
  private openings = 0;
  private failures = 0; // to connect at first
  private pictures = 0;
  private counted = { frames: 0, bytes: 0 };

  constructor(private readonly picture: Picture) {
    const present = () => {
      const token = sessionStorage.getItem(tokenKey) ?? "";
      return this.client && { client: this.client, world: this.world, isPaused: this.isPaused, url: socketUrl, token };
    };
    this.controls = new Controls(picture, present, (world) => this.turnTo(world));
    this.slowMotion = new SlowMotion(present, (scale) => (this.playback.scale = scale));
    this.pointer = new Pointer(picture, element<HTMLCanvasElement>("picture"), () => {
      if (this.client?.state !== "open" || !this.stream) return undefined;
      const tool = document.querySelector<HTMLInputElement>("input[name=tool]:checked")!.value as Tool;
      const massKg = (body: string) => this.controls.massKg(body);
      const clicked = (x: number, y: number) => this.controls.clicked(x, y, tool);
      return { client: this.client, world: this.world, tool, massKg, clicked, failed: refuse };
    });
    this.listen();
    setInterval(() => this.tellStatus(), statusIntervalMs);
    const draw = (nowMs: number) => {
      requestAnimationFrame(draw);
      this.picture.draw(this.playback.at(nowMs));
      this.pointer.draw();
      ++this.pictures;
    };
    requestAnimationFrame(draw);
  }

  async connect(token: string): Promise<void> {
    say("Connecting…");
    try {
      this.client = await Client.connect(socketUrl, {
        token,
        clientName: "page",
        decoder: new WorkerDecoder(new Worker("decode-worker.js", { type: "module" })),
        stateChanged: (state, reason) => {
          document.body.classList.toggle("lost", state !== "open");
          if (state === "open") void this.resume();
          else if (state === "lost") say("The connection is lost. Reconnecting…");
          else if (reason) this.turnedAway(reason, token);
        },
        event: ({ kind, world }) => {
          if (kind === Event_Kind.WORLD_RESET && world === this.world) void this.readScene();
        },
      });
      sessionStorage.setItem(tokenKey, token);
      await this.open();
    } catch (error) {
      const failure = error as PneumaError;
      this.turnedAway(failure, token);
      // A browser that is busy may be late with its first word, a server full or about to start.
      if (failure.code === "UNAVAILABLE") {
        setTimeout(() => void this.connect(token), retryDelayMs(this.failures++, failure.retryAfterS));
      }
    }
  }

  /** Of a token that was refused, also where the server asks for another one than before. */
  private turnedAway({ code, message }: PneumaError, token: string): void {
    element("sign-in").hidden = code !== "UNAUTHENTICATED";
    say(code === "UNAUTHENTICATED" && token === "" ? "" : message);
  }

  private listen(): void {
    const show = () => {
      const isOn = (id: string) => element<HTMLInputElement>(id).checked;
      document.documentElement.classList.toggle("dark", isOn("dark"));
      this.picture.show({ wireframe: isOn("wireframe"), velocities: isOn("velocities"), dark: isOn("dark") });
    };
    for (const id of ["wireframe", "velocities", "dark"]) element(id).addEventListener("change", show);
    element<HTMLInputElement>("dark").checked = matchMedia("(prefers-color-scheme: dark)").matches;
    show();

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
    element("reset").addEventListener("click", () => void this.ask((client) => client.reset(this.world)));
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
    };
    addEventListener("keydown", (event) => {
      const { key, target } = event;
      const isOn = (controls: string) => target instanceof HTMLElement && target.matches(controls);
      const isText = isOn("#token, input[type=text], input[type=number]");
      const isTaken = isText || isOn("select, dialog *") || (key === " " && isOn("button, summary, input"));
      const isCommand = event.ctrlKey || event.metaKey;
      const command = key?.toLowerCase() === "z" ? (event.shiftKey ? "redo" : "undo") : undefined;
      const id = isCommand ? command : keys[key?.toLowerCase()]; // what fills in a field sends events without a key
      if (event.repeat && id !== "step") return;
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

  /** Shows the world that the address names, or the first one. */
  private open(): Promise<void> {
    const own = ++this.openings;
    this.opening = this.opening.then(() => (own === this.openings ? this.show() : undefined));
    return this.opening;
  }

  private async show(): Promise<void> {
    const { client } = this;
    if (!client) return;
    try {
      const list = await this.listWorlds(client);
      const world = wantedWorld() ?? list[0]?.name;
      const view = wantedView();
      if (this.stream && world === this.world) {
        if (view) this.picture.look(view);
        return this.tellWorld(list);
      }
      if (this.stream) await client.unsubscribe(this.stream);
      this.playback.clear();
      if (world === undefined) return say("This server has no worlds.");
      this.world = world;
      this.tellWorld(list);
      this.picture.forget(view);
      this.stream = await client.subscribe(
        world,
        { maxErrorM, commands: true },
        {
          frame: (frame) => this.take(frame),
          // A pause or an edit may be among what was left out.
          gap: () => {
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
            if (error.code === "NOT_FOUND") say(error.message);
          },
        },
      );
      document.title = `${world} · Pneuma`;
      say("");
      await this.readScene();
    } catch (error) {
      say((error as PneumaError).message);
    }
  }

  private async listWorlds(client: Client): Promise<WorldList_World[]> {
    const list = (await client.worlds()).filter(({ damaged }) => !damaged);
    worlds.replaceChildren(...list.map(({ name, vertices }) => new Option(`${name} (${vertices} vertices)`, name)));
    worlds.value = this.world;
    return list;
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
      this.tellWorld(await this.listWorlds(this.client));
      await this.readScene();
    } catch (error) {
      say((error as PneumaError).message);
    }
  }

  private async readScene(): Promise<void> {
    const { client, world } = this;
    if (!client) return;
    try {
      await this.controls.begin(client, world);
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
    this.counted = { frames: this.counted.frames + 1, bytes: this.counted.bytes + frame.bytes };
    element("status").dataset["tick"] = String(frame.tick);
    element("status").dataset["time"] = frame.timeS.toFixed(1);
  }

  private tellStatus(): void {
    const status = element<HTMLOutputElement>("status");
    const perS = 1000 / statusIntervalMs;
    const { frames, bytes } = this.counted;
    const text = [
      `tick ${status.dataset["tick"] ?? "–"}`,
      `${status.dataset["time"] ?? "–"} s`,
      `${Math.round(frames * perS)} frames/s`,
      `${Math.round((bytes * perS) / 1000)} kB/s`,
      `${Math.round(this.pictures * perS)} drawn/s`,
    ];
    status.value = text.join(" · ");
    this.counted = { frames: 0, bytes: 0 };
    this.pictures = 0;
  }
}

try {
  const panel = element<HTMLDetailsElement>("panel");
  panel.open = innerWidth > phoneWidthPx;
  const page = new Page(new Picture(element<HTMLCanvasElement>("picture"), panel));
  void page.connect(sessionStorage.getItem(tokenKey) ?? "");
} catch (error) {
  say(`This browser shows no 3D picture: ${(error as Error).message}`);
}
