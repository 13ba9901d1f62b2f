// The page: connects, shows the worlds and one of them in 3D, and hands what its controls say to the server.
import {
  type Applied,
  Client,
  type Event,
  Event_Kind,
  type Frame,
  PneumaError,
  RecordingPlayer,
  type SubscribeOptions,
  WorkerDecoder,
  type WorldList_World,
} from "../src/index.js";
import { isLasting, retryDelayMs } from "../src/retry.js";
import { noteView, type View, wantedWorld } from "./address.js";
import { steered, wayOf } from "./camera_keys.js";
import { BodyCard } from "./body_card.js";
import { Controls } from "./controls.js";
import { Dock } from "./dock.js";
import { refuse, say, unsay } from "./effect.js";
import { element } from "./element.js";
import { shownOf } from "./frame_facts.js";
import { Gallery } from "./gallery.js";
import { Gauge } from "./gauge.js";
import { Pointer, type Tool } from "./hands.js";
import { deedText, happeningText, Surprises, surpriseText } from "./happenings.js";
import { listenToKeys } from "./keyboard.js";
import { Legend } from "./legend.js";
import { listenToLooks, maxErrorM, neededFor, shownNow } from "./looks.js";
import { tellNotice } from "./notice.js";
import { ownRecording } from "./one_file.js";
import { PaceTold } from "./pace.js";
import { mayEdit, permit, permitRecording, permitServer, turnOffWithout } from "./permitted.js";
import { Picture } from "./picture.js";
import { Plan } from "./plan.js";
import { type Moment, Playback } from "./playback.js";
import { Plots } from "./plots.js";
import type { Recording } from "./recording.js";
import { ShownWorld, type Stage } from "./shown_world.js";
import { SlowMotion } from "./slow_motion.js";
import { type Measured, often, StatsFeed } from "./stats_feed.js";
import { clearStatus, tellStatus } from "./status_line.js";
import { recall, remember } from "./storage.js";
import { beginTheme } from "./theme.js";
import { Timeline } from "./timeline.js";
import { inWords } from "./words.js";
import { plain } from "./world_view.js";

const statusIntervalMs = 500;
const tokenKey = "pneuma-token";
const fastScales = [2, 4]; // of a recording without a server

const worlds = element<HTMLSelectElement>("world");
const canvas = element<HTMLCanvasElement>("picture");
const pauseButton = element<HTMLButtonElement>("pause");
const playButton = element<HTMLButtonElement>("play");
const stepButton = element<HTMLButtonElement>("step");

const ofThisPage = ownRecording();
const player = ofThisPage && new RecordingPlayer(ofThisPage);
const socketUrl = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws`;

class Page implements Stage {
  private readonly playback = new Playback();
  private readonly controls: Controls;
  private readonly slowMotion: SlowMotion;
  private readonly legend = new Legend();
  private readonly plots = new Plots();
  private readonly plan = new Plan();
  private readonly dock = new Dock();
  private readonly gallery = new Gallery(() => this.newest);
  private readonly world = new ShownWorld(this);
  private readonly statsFeed = new StatsFeed(() => this.world.live);
  private readonly card = new BodyCard(this.statsFeed, () => {
    const { selected, scene } = this.controls;
    const hasContacts = this.options().contacts ?? false;
    const { moment, recording, newest: frame } = this;
    const past = this.timeline.pastTold;
    return { selected, scene, frame, hasContacts, moment, isRecording: recording !== undefined, past };
  });
  private readonly paceTold = new PaceTold(() => this.world.live);
  private readonly pointer: Pointer;
  private readonly gauge = new Gauge();
  private readonly timeline: Timeline;
  private readonly surprises = new Surprises();
  private shown = plain;
  private client: Client | undefined;
  private decoder: WorkerDecoder | undefined;
  private decodeMs = 0; // of the decoder, as told last
  private asleep = 0;
  private others = 0; // who watch this world
  private failures = 0; // to connect for the first time
  private isConnected = false;
  private hasWorld = false;
  private newest: Frame | undefined;
  private moment: Moment | undefined; // that is drawn
  private recording: Recording | undefined;

  constructor(private readonly picture: Picture) {
    const present = () => {
      const { client } = this;
      const token = recall("sessionStorage", tokenKey) ?? "";
      return client && { client, world: this.world.name, isPaused: this.world.isPaused, url: socketUrl, token };
    };
    this.controls = new Controls(picture, present, (world) => this.world.turnTo(world));
    this.slowMotion = new SlowMotion(present, (scale) => this.playback.slowTo(scale));
    this.pointer = new Pointer(picture, canvas, () => {
      const { live } = this.world;
      const tool = document.querySelector<HTMLInputElement>("input[name=tool]:checked")!.value as Tool;
      const massKg = (body: string) => this.controls.massKg(body);
      const mayTouch = mayEdit() && !this.timeline.isPast;
      const clicked = (x: number, y: number) => this.controls.clicked(x, y, mayTouch ? tool : "pull");
      return live && { ...live, tool, mayTouch, massKg, clicked, failed: refuse };
    });
    this.timeline = new Timeline(
      () => this.world.live?.client,
      () => this.timeMoved(),
    );
    permitServer(!player);
    if (player) this.slowMotion.offer(fastScales);
    this.setPresent(false, false);
    this.listenToLooks();
    this.listenToSheets();
    this.listenToTime();
    this.listenToCamera();
    listenToKeys();
    element("make-first").addEventListener("click", () => element("new-world-open").click());
    worlds.addEventListener("change", () => this.world.turnTo(worlds.value));
    element<HTMLFormElement>("sign-in").addEventListener("submit", (event) => {
      event.preventDefault();
      element("sign-in").hidden = true;
      void this.connect(element<HTMLInputElement>("token").value);
    });
    setInterval(() => this.tell(), statusIntervalMs);
    requestAnimationFrame((nowMs) => this.draw(nowMs));
  }

  async connect(token: string): Promise<void> {
    tellNotice("Connecting…");
    if (!player) this.decoder = new WorkerDecoder(new Worker("decode-worker.js", { type: "module" }));
    this.decodeMs = 0;
    try {
      this.client = await Client.connect(socketUrl, {
        token,
        clientName: "page",
        ...(this.decoder ? { decoder: this.decoder } : {}),
        ...(player ? { openSocket: player.open } : {}),
        stateChanged: (state, reason) => {
          this.setPresent(state === "open", this.hasWorld);
          if (state === "open") {
            if (this.client) permit(this.client.welcome.role); // it may have another one than before
            void this.world.resume();
          } else if (state === "lost") {
            unsay(""); // it was about what may be another world by the time that it is back
            tellNotice("The connection is lost. Reconnecting…");
          } else if (reason) this.turnedAway(reason, token);
        },
        event: (event) => this.happened(event),
      });
      permit(this.client.welcome.role);
      remember("sessionStorage", tokenKey, token);
      await this.world.connect(this.client);
    } catch (error) {
      this.notConnected(error as PneumaError, token);
    }
  }

  private notConnected(error: PneumaError, token: string): void {
    if (isLasting(error)) return this.turnedAway(error, token);
    tellNotice(`${inWords(error)}. Trying again…`);
    setTimeout(() => void this.connect(token), retryDelayMs(this.failures++, error.retryAfterS));
  }

  /** Of a token that was refused, also where the server asks for another one than before. */
  private turnedAway(error: PneumaError, token: string): void {
    const isForToken = error.code === "UNAUTHENTICATED";
    element("sign-in").hidden = !isForToken;
    element("token-refusal").textContent = token === "" ? "" : "The server does not know this token.";
    tellNotice(isForToken ? "" : inWords(error));
  }

  /** Whether there is a server, and a world that it shows: without them, controls do nothing. */
  private setPresent(isConnected: boolean, hasWorld: boolean): void {
    [this.isConnected, this.hasWorld] = [isConnected, hasWorld];
    document.body.classList.toggle("lost", !isConnected);
    turnOffWithout({ isConnected, hasWorld });
  }

  private happened(event: Event): void {
    const { kind, world, body } = event;
    if (kind === Event_Kind.WORLD_DESTROYED) this.world.refresh().catch(() => {});
    if (world !== this.world.name) return;
    if (kind === Event_Kind.BODY_FROZEN) this.picture.frozen.add(body);
    // A recording tells when its world once was late, but nothing is simulated now.
    if (kind === Event_Kind.WORLD_SLOWED && !this.recording) this.paceTold.late(world);
    if (kind === Event_Kind.BODY_BURST) this.controls.missed(); // its gas is gone
    if (kind === Event_Kind.WORLD_RESET) {
      this.pointer.letGo(); // and so has the server
      if (this.client) void this.begun(this.client, world);
    }
    // A recording goes to its beginning where that is asked for.
    const isBeginning = kind === Event_Kind.WORLD_RESET && Number(event.tick) === this.recording?.firstTick;
    const text = happeningText(event);
    if (text === "" || isBeginning) return;
    this.timeline.mark("event", text, event.tick);
    say(text, kind === Event_Kind.WORLD_RESET ? "began" : "");
  }

  /** The timeline went elsewhere, or a recording came to its end or left it. */
  private timeMoved(): void {
    if (this.timeline.isPast) this.pointer.letGo();
    this.card.follow();
    stepButton.disabled = !this.world.isPaused || this.timeline.isAtEnd;
    if (this.recording) this.world.refresh().catch(() => {}); // whether it goes on
  }

  private listenToLooks(): void {
    const show = () => {
      this.shown = shownNow();
      document.documentElement.classList.toggle("dark", this.shown.dark);
      this.picture.show(this.shown);
      this.gallery.show(this.shown.dark);
      this.plots.redraw();
      this.world.followOptions();
    };
    listenToLooks(show);
    beginTheme(element<HTMLInputElement>("dark"));
    show();
  }

  private listenToSheets(): void {
    this.dock.on("gallery", (isOpen) => this.gallery.open(isOpen));
    this.dock.on("scene", (isOpen) => this.controls.openScene(isOpen));
    const toPlots = (measured: Measured) => this.plots.takeStats(measured);
    const toPlan = (measured: Measured) => this.plan.take(measured);
    this.dock.on("plots", (isOpen) => {
      this.plots.open(isOpen);
      this.statsFeed.watch(toPlots, isOpen, { ...often, hasRoundTrip: true });
    });
    this.dock.on("plan", (isOpen) => {
      this.plan.clear();
      this.statsFeed.watch(toPlan, isOpen, often);
    });
  }

  private listenToTime(): void {
    pauseButton.addEventListener("click", () => {
      void this.ask((client, world) =>
        this.world.isPaused ? client.resume(world, this.slowMotion.wished) : client.pause(world),
      );
    });
    playButton.addEventListener("click", () => pauseButton.click());
    stepButton.addEventListener("click", () => void this.ask((client, world) => client.step(world)));
    const confirm = element<HTMLDialogElement>("reset-confirm");
    const reset = () => void this.ask((client, world) => client.reset(world));
    element("reset").addEventListener("click", () => {
      const isAsked = this.controls.hasDeeds || (this.others > 0 && !this.recording);
      if (isAsked) confirm.showModal();
      else reset();
    });
    element("reset-no").addEventListener("click", () => confirm.close());
    element("reset-yes").addEventListener("click", () => {
      confirm.close();
      reset();
    });
  }

  private listenToCamera(): void {
    const note = () => {
      if (this.picture.isLooking) noteView(this.world.name, this.picture.view);
    };
    this.picture.orbit.addEventListener("end", note);
    element("frame-all").addEventListener("click", () => {
      if (!this.picture.isLooking) return;
      this.picture.frameAll();
      note();
    });
    canvas.addEventListener("blur", () => this.pointer.letGo());
    canvas.addEventListener("keydown", ({ key, shiftKey, ctrlKey, metaKey, altKey, repeat }) => {
      if (ctrlKey || metaKey || altKey || !this.picture.isLooking) return;
      if (key === "Enter" && !repeat) this.pointer.press(this.picture.hitOn(this.controls.selected));
      if (key === "Escape") this.pointer.letGo();
      const way = shiftKey ? undefined : wayOf(this.picture.view, key);
      if (way && this.pointer.pullBy(way)) return;
      const view = steered(this.picture.view, key, shiftKey);
      if (!view) return;
      this.picture.look(view);
      note();
    });
    canvas.addEventListener("webglcontextlost", () =>
      tellNotice("The browser has taken the picture away. Wait, or reload."),
    );
    canvas.addEventListener("webglcontextrestored", () => tellNotice(""));
  }

  private async ask(request: (client: Client, world: string) => Promise<unknown>): Promise<void> {
    try {
      if (this.client) await request(this.client, this.world.name);
      if (this.recording) await this.world.refresh(); // nothing else tells of it
    } catch (error) {
      refuse(error as PneumaError);
    }
  }

  private draw(nowMs: number): void {
    requestAnimationFrame((nextMs) => this.draw(nextMs));
    const now = this.playback.at(nowMs);
    const moment = this.timeline.moment(now?.resets ?? 0) ?? now;
    this.moment = moment;
    const begin = performance.now();
    if (moment) this.picture.update(moment);
    this.gauge.add({ pictures: 1, updateMs: performance.now() - begin });
    this.picture.draw(nowMs);
    this.pointer.draw();
    if (moment) element("status").dataset["shown"] = String(shownOf(moment).tick);
  }

  private tell(): void {
    const decodeMs = this.decoder?.decodeMs ?? 0;
    this.gauge.add({ decodeMs: decodeMs - this.decodeMs });
    this.decodeMs = decodeMs;
    const { frozen, contactCount, hasShadows } = this.picture;
    tellStatus(this.gauge, { asleep: this.asleep, frozen: frozen.size, hasShadows, others: this.others });
    this.picture.tell(this.legend, this.shown.field);
    this.timeline.tell();
    this.card.follow();
    element<HTMLOutputElement>("contact-count").value = this.shown.contacts ? String(contactCount) : "";
  }

  // Of Stage.

  options(): SubscribeOptions {
    const needed = neededFor(this.shown);
    const contacts = (needed.contacts ?? false) && !this.recording;
    // A recording that stands still sends one frame, which tells a speed by its velocities alone.
    const velocities = (needed.velocities ?? false) || (this.recording?.hasVelocities ?? false);
    return { maxErrorM, commands: true, ...needed, contacts, velocities };
  }

  say(text: string): void {
    tellNotice(text);
  }

  listed(list: readonly WorldList_World[]): void {
    const options = list.map(
      ({ name, vertices }) => new Option(vertices > 0 ? `${name} (${vertices} vertices)` : name, name),
    );
    const isSame = options.length === worlds.length && options.every(({ text }, i) => text === worlds.options[i]!.text);
    if (!isSame) worlds.replaceChildren(...options); // an open selection would close
    worlds.value = this.world.name;
    const ours = 1 + Number(this.controls.isRecording);
    const all = list.find(({ name }) => name === this.world.name)?.subscribers ?? 0;
    this.others = Math.max(0, all - ours);
    element("make-first").hidden = list.length > 0;
    if (this.client) this.gallery.update(this.client, list, this.world.name);
  }

  turn(view: View | undefined): void {
    if (wantedWorld() === null && worlds.length > 1) this.dock.open("gallery");
    this.newest = undefined;
    this.moment = undefined;
    clearStatus();
    document.title = "Pneuma";
    this.setPresent(this.isConnected, false);
    unsay("");
    this.paceTold.end();
    this.playback.clear();
    this.slowMotion.forget();
    this.pointer.letGo();
    this.picture.forget(view);
    this.plots.clear();
    this.controls.end();
  }

  look(view: View): void {
    this.picture.look(view);
  }

  paced(isPaused: boolean, timeScale: number | undefined): void {
    worlds.value = this.world.name;
    pauseButton.textContent = isPaused ? "Resume" : "Pause";
    playButton.textContent = isPaused ? "▶" : "❚❚";
    playButton.setAttribute("aria-label", isPaused ? "Play" : "Pause");
    stepButton.disabled = !isPaused || this.timeline.isAtEnd;
    if (timeScale) this.slowMotion.follow(timeScale, isPaused);
  }

  frame(frame: Frame): void {
    // A server that was started again may tell of nothing else.
    const isBack = this.newest !== undefined && frame.timeS < this.newest.timeS;
    if (isBack && !this.recording) say("The world began again", "began");
    this.newest = frame;
    this.playback.push(frame);
    this.timeline.take(frame);
    this.controls.take(frame);
    this.plots.takeFrame(frame);
    this.gauge.add({ frames: 1, bytes: frame.bytes });
    this.asleep = frame.scalars?.asleep.filter((isAsleep) => isAsleep).length ?? 0;
    element("status").dataset["tick"] = String(frame.tick);
    element("status").dataset["time"] = frame.timeS.toFixed(1);
  }

  gap(fromTick: number, toTick: number): void {
    this.gauge.add({ dropped: toTick - fromTick + 1 });
    this.controls.missed(); // an edit may be among what was left out
  }

  fault(error: PneumaError): void {
    refuse(error);
  }

  applied(applied: Applied): void {
    // A recording's session ids are those of its own time: none is ours.
    const own = this.recording ? undefined : this.world.live?.client.welcome.sessionId;
    this.timeline.mark("deed", deedText(applied, own), applied.tick);
    const surprise = own === undefined ? "" : surpriseText(applied, own);
    if (surprise !== "" && this.surprises.isNew(surprise, performance.now())) say(surprise, "visitor");
    this.controls.applied(applied);
  }

  found(recording: Recording | undefined): void {
    this.recording = recording;
    permitRecording(recording !== undefined);
    const velocities = element<HTMLInputElement>("velocities");
    velocities.disabled = recording?.hasVelocities === false;
    velocities.parentElement!.title = velocities.disabled ? "It was recorded without them" : "V";
    this.timeline.begin(recording);
    if (ofThisPage) this.timeline.markAll(ofThisPage);
  }

  async begun(client: Client, world: string): Promise<void> {
    document.body.classList.remove("gone");
    this.setPresent(this.isConnected, true);
    document.title = `${world} · Pneuma`;
    // At once when they are told: what freezes later is told of as an event.
    const findFrozen = async () => {
      const { softBodies, timeRatio } = await client.stats(world);
      if (world !== this.world.name) return;
      if (timeRatio < 1 && !this.recording) this.paceTold.late(world);
      this.picture.frozen.clear();
      for (const { name, frozen } of softBodies) if (frozen) this.picture.frozen.add(name);
    };
    try {
      await Promise.all([findFrozen(), this.controls.begin(client, world)]);
    } catch (error) {
      refuse(error as PneumaError);
    }
  }

  gone(why: string): void {
    tellNotice(why);
    unsay("");
    this.setPresent(this.isConnected, false);
    this.controls.end();
    document.body.classList.add("gone");
    this.dock.open("gallery");
  }
}

function pictureOf(covers: readonly HTMLElement[]): Picture | undefined {
  try {
    return new Picture(canvas, covers);
  } catch (error) {
    tellNotice(`This browser shows no 3D picture: ${(error as Error).message}`);
    return undefined;
  }
}

const picture = pictureOf(["header", "panel", "sheets", "timeline"].map((id) => element(id)));
if (picture) void new Page(picture).connect(recall("sessionStorage", tokenKey) ?? "");
