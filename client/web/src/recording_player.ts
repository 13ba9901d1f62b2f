// Plays a recording to a client in the same program, without a server: it answers as `pneuma play` does. proto/WIRE.md,
// "Recordings".
import { create, fromBinary, type MessageInitShape, toBinary } from "@bufbuild/protobuf";
import type { Layout } from "../proto/pneuma/v1/frame_pb.js";
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
import { PneumaError } from "./errors.js";
import { checkSubscribe, Refusal } from "./played_stream.js";
import type { RecordedFrame, RecordingFile } from "./recording_reader.js";
import type { Socket } from "./socket.js";

// Frames that a display does not show need not be decoded on time.
const speedMax = 4;
const speedMin = 0.125;
const messageBytes = 1 << 20;
// As a timer has it: further behind, after a sleep, it goes on from where it is.
const lateMaxS = 0.5;
// As a server: a client takes a longer silence for a connection that broke.
const pingIntervalMs = 15_000;
// Frames' times are sums: one that is meant to be at the time sought may be this much behind it.
const roundingS = 1e-6;
const stepTicksMax = 36_000; // as a server

type Answer = NonNullable<MessageInitShape<typeof ServerMessageSchema>["message"]>;

function bytesOf(message: MessageInitShape<typeof ServerMessageSchema>): Uint8Array {
  return toBinary(ServerMessageSchema, create(ServerMessageSchema, message) as ServerMessage);
}

/** A client's connection. */
class PlayedSocket implements Socket {
  binaryType = "arraybuffer";
  onopen: (() => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  onclose: ((event: { code: number; reason: string }) => void) | null = null;
  onerror: (() => void) | null = null;
  private isClosed = false;
  private readonly pings: ReturnType<typeof setInterval>;

  constructor(
    private readonly take: (data: Uint8Array) => void,
    private readonly closed: () => void,
  ) {
    setTimeout(() => this.onopen?.()); // whoever asked for it listens by then
    this.pings = setInterval(() => this.post(bytesOf({ message: { case: "ping", value: {} } })), pingIntervalMs);
  }

  send(data: Uint8Array): void {
    if (!this.isClosed) this.take(data);
  }

  close(): void {
    if (this.isClosed) return;
    this.isClosed = true;
    clearInterval(this.pings);
    this.closed();
  }

  /** In the turn of whoever hears it, as a socket's message does. */
  post(bytes: Uint8Array): void {
    const data = new Uint8Array(bytes).buffer;
    queueMicrotask(() => this.isClosed || this.onmessage?.({ data }));
  }
}

/** A recording that is played. Its place, pause and speed outlive a connection; it has one at a time, with one stream. */
export class RecordingPlayer {
  private socket: PlayedSocket | undefined;
  /** The place of the frame that is shown. */
  private at = 0;
  private isPaused = false;
  private speed = 1;
  private isSubscribed = false;
  private tellsCommands = false; // Subscribe.commands
  private dueAtMs = 0; // the frame that is shown was
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly file: RecordingFile) {}

  /** For `ClientOptions.openSocket`. Throws PneumaError FAILED_PRECONDITION while another client is connected. */
  readonly open = async (): Promise<Socket> => {
    if (this.socket) throw new PneumaError("FAILED_PRECONDITION", "the recording is played to another client");
    const take = (data: Uint8Array) => this.take(data);
    this.socket = new PlayedSocket(take, () => this.closed());
    return this.socket;
  };

  private closed(): void {
    this.socket = undefined;
    this.isSubscribed = false;
    clearTimeout(this.timer);
  }

  private take(data: Uint8Array): void {
    const { requestId, request } = fromBinary(ClientMessageSchema, data);
    if (request.case === "pong") return;
    let shows = false;
    try {
      this.checkWorld(request);
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

  private get frames(): readonly RecordedFrame[] {
    return this.file.frames;
  }

  private get shown(): RecordedFrame {
    return this.frames[this.at]!;
  }

  private get durationS(): number {
    return this.frames.at(-1)!.atS;
  }

  private get isAtEnd(): boolean {
    return this.at + 1 === this.frames.length;
  }

  private get layout(): Layout {
    return fromBinary(ServerMessageSchema, this.shown.layout).message.value as Layout;
  }

  /** Refuses what is asked of another world. */
  private checkWorld({ case: kind, value }: ClientMessage["request"]): void {
    if (!value || !("world" in value) || value.world === this.file.header.world) return;
    const field = ClientMessageSchema.fields.find(({ localName }) => localName === kind)!.name;
    throw new Refusal(Error_Code.NOT_FOUND, `no world ${value.world}`, `${field}.world`);
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
        this.checkStream(request.value.streamId, "unsubscribe");
        this.isSubscribed = false;
        return [this.done()];
      case "requestKey":
        this.checkStream(request.value.streamId, "request_key");
        return [this.done(), true];
      case "pause":
        this.isPaused = true;
        return [this.done()];
      case "resume":
        return this.resume(request.value.timeScale);
      case "step":
        return this.step(request.value.ticks);
      case "reset":
        return this.reset();
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
    const { world, worldRateHz: rateHz, scene, stream } = this.file.header;
    const { timeS, frame } = this.shown;
    const { softBodies, solids } = this.layout;
    const recording = {
      durationS: this.durationS,
      firstTick: this.frames[0]!.frame.tick,
      lastTick: this.frames.at(-1)!.frame.tick,
      velocities: stream!.velocityGridStepMS > 0,
    };
    return {
      name: world,
      sceneName: scene?.name ?? "",
      tick: frame.tick,
      timeS,
      softBodies: softBodies.length,
      rigidBodies: solids.filter(({ dynamic }) => dynamic).length,
      rateHz,
      paused: this.isPaused || this.isAtEnd,
      timeScale: this.speed,
      subscribers: this.isSubscribed ? 1 : 0,
      recording,
    };
  }

  private done(): Answer {
    return { case: "done", value: { tick: this.shown.frame.tick, world: this.file.header.world } };
  }

  private checkStream(streamId: number, request: string): void {
    if (this.isSubscribed && streamId === this.file.header.stream!.streamId) return;
    throw new Refusal(Error_Code.NOT_FOUND, "this session has no such stream", `${request}.stream_id`);
  }

  private subscribe(asked: Subscribe): Answer {
    checkSubscribe(
      asked,
      this.file,
      this.layout.softBodies.map(({ name }) => name),
    );
    if (this.isSubscribed) throw new Refusal(Error_Code.LIMIT_EXCEEDED, "one stream at a time", "subscribe.world");
    this.isSubscribed = true;
    this.tellsCommands = asked.commands;
    this.dueAtMs = performance.now(); // it stood still until now
    return { case: "subscribed", value: this.file.header.stream! };
  }

  private resume(timeScale: number | undefined): [Answer, boolean] {
    if (timeScale !== undefined && !(timeScale >= speedMin && timeScale <= speedMax)) {
      const isPace = timeScale > 0 && Number.isFinite(timeScale);
      const code = isPace ? Error_Code.LIMIT_EXCEEDED : Error_Code.INVALID_ARGUMENT;
      throw new Refusal(code, `is ${timeScale}; may be ${speedMin} to ${speedMax}`, "resume.time_scale");
    }
    const speed = timeScale ?? this.speed;
    const isOver = this.isAtEnd;
    const nowMs = performance.now();
    // Between two frames it goes on from where it is: many changes of speed in a row would stop it otherwise.
    const passedMs = this.isPaused || isOver ? 0 : ((nowMs - this.dueAtMs) * this.speed) / speed;
    this.dueAtMs = nowMs - passedMs;
    if (isOver) this.at = 0; // from the end, to the start
    this.speed = speed;
    this.isPaused = false;
    return [this.done(), isOver];
  }

  private step(ticks: number): [Answer] {
    const refusal = (code: Error_Code, what: string, field: string) => new Refusal(code, what, `step.${field}`);
    if (!this.isPaused) {
      throw refusal(Error_Code.FAILED_PRECONDITION, "the recording plays; pause it first", "world");
    }
    if (ticks === 0) throw refusal(Error_Code.INVALID_ARGUMENT, "must be 1 or more", "ticks");
    if (ticks > stepTicksMax) {
      throw refusal(Error_Code.LIMIT_EXCEEDED, `is ${ticks}; may be at most ${stepTicksMax}`, "ticks");
    }
    const until = this.shown.frame.tick + BigInt(ticks);
    while (!this.isAtEnd && this.frames[this.at + 1]!.frame.tick <= until) this.advance();
    if (this.shown.frame.tick < until && this.isAtEnd) {
      const what = `the recording ends at tick ${this.shown.frame.tick}`;
      throw refusal(Error_Code.FAILED_PRECONDITION, what, "ticks");
    }
    return [this.done()];
  }

  private reset(): [Answer, boolean] {
    this.goTo(0);
    const value = { kind: Event_Kind.WORLD_RESET, world: this.file.header.world, tick: this.shown.frame.tick };
    if (this.isSubscribed) this.post({ message: { case: "event", value } });
    return [this.done(), true];
  }

  private seek(timeS: number): [Answer, boolean] {
    const wrong = (what: string) => new Refusal(Error_Code.INVALID_ARGUMENT, what, "seek.time_s");
    if (!(timeS >= 0)) throw wrong("must be 0 or more");
    if (timeS > this.durationS) throw wrong(`the recording ends at ${this.durationS} s`);
    const past = this.frames.findIndex(({ atS }) => atS > timeS + roundingS);
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
    if (!this.isSubscribed) return;
    for (const { happening, bytes } of this.shown.before) {
      const isTold =
        happening.case === "applied"
          ? this.tellsCommands
          : happening.value.streamId === 0 && happening.value.kind !== Event_Kind.WORLD_DESTROYED;
      if (isTold) this.postBytes(bytes);
    }
    this.postFrame(this.at);
  }

  private postFrame(at: number): void {
    const { layout, bytes } = this.frames[at]!;
    if (layout !== this.frames[at - 1]!.layout) this.postBytes(layout);
    this.postBytes(bytes);
  }

  private wait(): void {
    clearTimeout(this.timer);
    if (this.isPaused || this.isAtEnd || !this.isSubscribed) return;
    const stepMs = (1000 * (this.frames[this.at + 1]!.atS - this.shown.atS)) / this.speed;
    this.timer = setTimeout(() => this.play(stepMs), this.dueAtMs + stepMs - performance.now());
  }

  private play(stepMs: number): void {
    this.dueAtMs = Math.max(this.dueAtMs + stepMs, performance.now() - 1000 * lateMaxS);
    this.advance();
    this.wait();
  }

  private post(message: MessageInitShape<typeof ServerMessageSchema>): void {
    this.postBytes(bytesOf(message));
  }

  private postBytes(bytes: Uint8Array): void {
    this.socket?.post(bytes);
  }
}
