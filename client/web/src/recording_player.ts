// Plays a recording to a client in the same program, without a server: it answers as `pneuma play` does. proto/WIRE.md,
// "Recordings".
import { create, fromBinary, type MessageInitShape, toBinary } from "@bufbuild/protobuf";
import {
  type ClientMessage,
  ClientMessageSchema,
  Error_Code,
  Event_Kind,
  type ServerMessage,
  ServerMessageSchema,
  type Subscribe,
  Welcome_Role,
} from "../proto/pneuma/v1/session_pb.js";
import { protocolVersion } from "./connection.js";
import type { RecordedFrame, RecordingFile } from "./recording_reader.js";
import type { Socket } from "./socket.js";

// Frames that a display does not show need not be decoded on time.
const speedMax = 4;
const speedMin = 0.125;
const messageBytes = 1 << 20;
// As a timer has it: further behind, after a sleep, it goes on from where it is.
const lateMaxS = 0.5;

type Answer = NonNullable<MessageInitShape<typeof ServerMessageSchema>["message"]>;

class Refusal extends Error {
  constructor(
    readonly code: Error_Code,
    what: string,
    readonly where: string,
  ) {
    super(what);
  }
}

/** One client's connection to a recording. It has one stream at a time. */
export class RecordingPlayer implements Socket {
  binaryType = "arraybuffer";
  onopen: (() => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  onclose: ((event: { code: number; reason: string }) => void) | null = null;
  onerror: (() => void) | null = null;
  /** The place of the frame that is shown. */
  private at = 0;
  private isPaused = false;
  private speed = 1;
  private isSubscribed = false;
  private dueAtMs = 0; // the frame that is shown was
  private timer: ReturnType<typeof setTimeout> | undefined;
  private isClosed = false;

  constructor(private readonly file: RecordingFile) {
    setTimeout(() => this.onopen?.()); // whoever made it listens by then
  }

  send(data: Uint8Array): void {
    const { requestId, request } = fromBinary(ClientMessageSchema, data);
    if (request.case === "pong") return;
    let shows = false;
    try {
      const [message, isShown = false] = this.answer(request);
      shows = isShown;
      this.post({ requestId, message });
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      const { code, message: what, where } = error;
      this.post({ requestId, message: { case: "error", value: { code, what, where } } });
    }
    if (shows) this.show();
    this.wait();
  }

  close(): void {
    this.isClosed = true;
    clearTimeout(this.timer);
  }

  private get frames(): readonly RecordedFrame[] {
    return this.file.frames;
  }

  private get shown(): RecordedFrame {
    return this.frames[this.at]!;
  }

  private get durationS(): number {
    return this.frames.at(-1)!.atS;
  }

  private get isAtRest(): boolean {
    return this.isPaused || this.at + 1 === this.frames.length;
  }

  /** And whether the frame that is shown is another one by that. */
  private answer(request: ClientMessage["request"]): [Answer, boolean?] {
    const { header } = this.file;
    switch (request.case) {
      case "hello": {
        const value = { protocolVersion, messageBytesMax: messageBytes, role: Welcome_Role.EDIT, worlds: header.world };
        return [{ case: "welcome", value }];
      }
      case "listWorlds":
        return [{ case: "worldList", value: { worlds: [this.listing()] } }];
      case "subscribe":
        return [this.subscribe(request.value), true];
      case "unsubscribe":
        this.isSubscribed = false;
        return [this.done()];
      case "requestKey":
        return [this.done(), true];
      case "pause":
        this.isPaused = true;
        return [this.done()];
      case "resume":
        return this.resume(request.value.timeScale);
      case "step":
        return this.step(request.value.ticks || 1);
      case "reset":
        this.goTo(0);
        return [this.done(), true];
      case "seek":
        return this.seek(request.value.timeS);
      case "getStats": {
        const { tick, timeS, paused, timeScale, rateHz } = this.listing();
        return [{ case: "stats", value: { world: header.world, tick, timeS, paused, timeScale, rateHz } }];
      }
      case "getScene":
        return [
          { case: "scene", value: { ...(header.scene ? { scene: header.scene } : {}), tick: this.shown.frame.tick } },
        ];
      case "ping":
        return [{ case: "pong", value: { nonce: request.value.nonce } }];
      default:
        throw new Refusal(
          Error_Code.FAILED_PRECONDITION,
          `${header.world} is a recording that is played: it cannot be changed`,
          request.case ?? "",
        );
    }
  }

  private listing() {
    const { world, worldRateHz: rateHz, scene } = this.file.header;
    const { tick, timeS = 0 } = this.shown.frame;
    const softBodies = scene?.softBodies.length ?? 0;
    const own = { name: world, sceneName: scene?.name ?? "", tick, timeS, softBodies, rateHz };
    return { ...own, paused: this.isAtRest, timeScale: this.speed, subscribers: this.isSubscribed ? 1 : 0 };
  }

  private done(): Answer {
    return { case: "done", value: { tick: this.shown.frame.tick, world: this.file.header.world } };
  }

  private subscribe({ velocities, scalars, contacts }: Subscribe): Answer {
    const stream = this.file.header.stream!;
    const lacks = (what: string) =>
      new Refusal(Error_Code.FAILED_PRECONDITION, "was not recorded", `subscribe.${what}`);
    if (velocities && !stream.velocityGridStepMS) throw lacks("velocities");
    if (scalars && !this.frames[0]!.frame.scalars) throw lacks("scalars");
    if (contacts) throw lacks("contacts");
    if (this.isSubscribed) throw new Refusal(Error_Code.LIMIT_EXCEEDED, "one stream at a time", "subscribe.world");
    this.isSubscribed = true;
    return { case: "subscribed", value: stream };
  }

  private resume(timeScale: number | undefined): [Answer, boolean] {
    if (timeScale !== undefined && !(timeScale >= speedMin && timeScale <= speedMax)) {
      const what = `must be ${speedMin} to ${speedMax}`;
      throw new Refusal(Error_Code.LIMIT_EXCEEDED, what, "resume.time_scale");
    }
    const isOver = this.at + 1 === this.frames.length;
    if (isOver) this.at = 0; // from the end, to the start
    this.speed = timeScale ?? this.speed;
    this.isPaused = false;
    this.dueAtMs = performance.now();
    return [this.done(), isOver];
  }

  private step(ticks: number): [Answer] {
    const until = this.shown.frame.tick + BigInt(ticks);
    while (this.at + 1 < this.frames.length && this.frames[this.at + 1]!.frame.tick <= until) this.advance();
    if (this.shown.frame.tick < until && this.at + 1 === this.frames.length) {
      const what = `the recording ends at tick ${this.shown.frame.tick}`;
      throw new Refusal(Error_Code.FAILED_PRECONDITION, what, "step.ticks");
    }
    return [this.done()];
  }

  private seek(timeS: number): [Answer, boolean] {
    const wrong = (what: string) => new Refusal(Error_Code.INVALID_ARGUMENT, what, "seek.time_s");
    if (!(timeS >= 0)) throw wrong("must be 0 or more");
    if (timeS > this.durationS) throw wrong(`the recording ends at ${this.durationS} s`);
    const past = this.frames.findIndex(({ atS }) => atS > timeS);
    this.goTo((past < 0 ? this.frames.length : past) - 1);
    return [this.done(), true];
  }

  private goTo(at: number): void {
    this.at = at;
    this.dueAtMs = performance.now();
  }

  /** Sends the frame that is shown, and what it builds on: from the last key frame on. */
  private show(): void {
    if (!this.isSubscribed) return;
    let key = this.at;
    while (this.frames[key]!.frame.baseTick !== undefined) --key;
    for (const topology of this.file.topologies) this.postBytes(topology);
    this.postBytes(this.frames[key]!.layout);
    this.postBytes(this.frames[key]!.bytes);
    for (let at = key + 1; at <= this.at; ++at) this.postFrame(at);
  }

  private advance(): void {
    ++this.at;
    for (const { happening, bytes } of this.shown.before) {
      const isOfWorld =
        happening.case === "applied" ||
        (happening.value.streamId === 0 && happening.value.kind !== Event_Kind.WORLD_DESTROYED);
      if (isOfWorld) this.postBytes(bytes);
    }
    if (this.isSubscribed) this.postFrame(this.at);
  }

  private postFrame(at: number): void {
    const { layout, bytes } = this.frames[at]!;
    if (layout !== this.frames[at - 1]!.layout) this.postBytes(layout);
    this.postBytes(bytes);
  }

  private wait(): void {
    clearTimeout(this.timer);
    if (this.isAtRest || !this.isSubscribed || this.isClosed) return;
    const stepMs = (1000 * (this.frames[this.at + 1]!.atS - this.shown.atS)) / this.speed;
    this.timer = setTimeout(() => this.play(stepMs), this.dueAtMs + stepMs - performance.now());
  }

  private play(stepMs: number): void {
    this.dueAtMs = Math.max(this.dueAtMs + stepMs, performance.now() - 1000 * lateMaxS);
    this.advance();
    this.wait();
  }

  private post(message: MessageInitShape<typeof ServerMessageSchema>): void {
    this.postBytes(toBinary(ServerMessageSchema, create(ServerMessageSchema, message) as ServerMessage));
  }

  /** In the turn of whoever hears it, as a socket's message does. */
  private postBytes(bytes: Uint8Array): void {
    const data = new Uint8Array(bytes).buffer;
    queueMicrotask(() => this.isClosed || this.onmessage?.({ data }));
  }
}
