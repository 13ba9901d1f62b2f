// A client of one server, over as many connections as it takes.
import { create, type MessageInitShape } from "@bufbuild/protobuf";
import { type Scene, type SceneEditSchema, type Vec3Schema } from "../proto/pneuma/v1/scene_pb.js";
import {
  type CreateWorldSchema,
  type Done,
  type Event,
  Event_Kind,
  type GrabSchema,
  type Grabbed,
  type ImpulseSchema,
  type Stats,
  SubscribeSchema,
  type Subscribed,
  type Welcome,
  type WorldList_World,
} from "../proto/pneuma/v1/session_pb.js";
import { Connection, type Reply, type ReplyKind, type Request, type Update } from "./connection.js";
import { type FrameDecoder, InlineDecoder } from "./decoder.js";
import { type ErrorCode, PneumaError } from "./errors.js";
import { MeshStore, Stream, type StreamListener, type SubscribeOptions } from "./stream.js";

/** A message's fields, those left out at their default. */
type Fields<Schema extends Parameters<typeof create>[0], Without extends string = never> = Omit<
  MessageInitShape<Schema>,
  "$typeName" | Without
>;
export type Point = Fields<typeof Vec3Schema>;

/** `lost`: the connection broke, and another is tried for. `closed`: for good. */
export type ClientState = "open" | "lost" | "closed";

export interface ClientOptions {
  /** Where the server asks for one. */
  readonly token?: string;
  /** For the server's log. */
  readonly clientName?: string;
  readonly connectTimeoutMs?: number;
  readonly replyTimeoutMs?: number;
  /** Whether a connection that broke is made anew, and its streams with it. Unset: yes. */
  readonly reconnect?: boolean;
  /** Unset: frames are decoded on this thread. Closed with the client. */
  readonly decoder?: FrameDecoder;
  /** Called with each change of state, and why. */
  readonly stateChanged?: (state: ClientState, reason?: PneumaError) => void;
  /** What happened in the worlds that are subscribed to. */
  readonly event?: (event: Event) => void;
}

const retryMsMin = 250;
const retryMsMax = 10_000;
// Trying again does not help.
const lastingErrors: ReadonlySet<ErrorCode> = new Set(["UNAUTHENTICATED", "UNSUPPORTED", "INVALID_ARGUMENT"]);

/** How long to wait before the try after `failures`: twice as long each time, less up to a half so that many clients spread. */
export function retryDelayMs(failures: number, random = Math.random()): number {
  return Math.min(retryMsMin * 2 ** failures, retryMsMax) * (1 - random / 2);
}

/**
 * A client of one server. Every request gives the server's reply, or rejects with a PneumaError: the server's own, with
 * its code, what and where, or UNAVAILABLE where the connection is lost or the reply does not come.
 */
export class Client {
  private readonly decoder: FrameDecoder;
  private readonly meshes = new MeshStore();
  private readonly streams = new Set<Stream>();
  private streamsById = new Map<number, Stream>();
  private connection: Connection | undefined;
  private state_: ClientState = "lost";
  private retry: ReturnType<typeof setTimeout> | undefined;
  private streamsMade = 0;

  private constructor(
    private readonly url: string,
    private readonly options: ClientOptions,
  ) {
    this.decoder = options.decoder ?? new InlineDecoder();
  }

  /**
   * Connects, says hello and waits for the welcome.
   * @param url ws://HOST:PORT/ws, or wss:
   */
  static async connect(url: string, options: ClientOptions = {}): Promise<Client> {
    const client = new Client(url, options);
    await client.open();
    return client;
  }

  get state(): ClientState {
    return this.state_;
  }

  /** The server's answer to the last hello. */
  get welcome(): Welcome {
    return this.connected().welcome;
  }

  /** Ends the connection and all streams. */
  close(): void {
    this.closeFor(new PneumaError("UNAVAILABLE", "the client was closed"));
  }

  /** Any request, for those that have no method of their own. */
  async call<Kind extends ReplyKind>(request: Request, expected: Kind): Promise<Reply<Kind>> {
    return this.connected().call(request, expected);
  }

  async worlds(): Promise<WorldList_World[]> {
    return (await this.call({ case: "listWorlds", value: {} }, "worldList")).worlds;
  }

  createWorld(world: Fields<typeof CreateWorldSchema>): Promise<Done> {
    return this.call({ case: "createWorld", value: world }, "done");
  }

  destroyWorld(world: string): Promise<Done> {
    return this.call({ case: "destroyWorld", value: { world } }, "done");
  }

  /**
   * Subscribes to a world's frames. Asking again for the same world, rate and error bound is FAILED_PRECONDITION as long as
   * the first stream lasts.
   */
  async subscribe(world: string, options: SubscribeOptions, listener: StreamListener): Promise<Stream> {
    const failed = (error: PneumaError) => this.connection?.end(error);
    const stream = new Stream(world, options, listener, this.streamsMade++, this.decoder, this.meshes, failed);
    await this.begin(stream);
    return stream;
  }

  async unsubscribe(stream: Stream): Promise<void> {
    if (!this.streams.has(stream)) return;
    const { streamId } = stream.subscribed;
    this.endStream(stream, new PneumaError("UNAVAILABLE", "the stream was closed"));
    if (this.connection) await this.call({ case: "unsubscribe", value: { streamId } }, "done");
  }

  /** All changes take effect between two ticks, or none does. */
  edit(world: string, edit: Fields<typeof SceneEditSchema>): Promise<Done> {
    return this.call({ case: "edit", value: { world, source: { case: "edit", value: edit } } }, "done");
  }

  /** The same, from protobuf's JSON mapping of SceneEdit. */
  editJson(world: string, json: string): Promise<Done> {
    return this.call({ case: "edit", value: { world, source: { case: "editJson", value: json } } }, "done");
  }

  impulse(world: string, impulse: Fields<typeof ImpulseSchema, "world">): Promise<Done> {
    return this.call({ case: "impulse", value: { ...impulse, world } }, "done");
  }

  /** Holds a vertex to a point by a damped spring, until it is released or the connection ends. */
  async grab(world: string, grab: Fields<typeof GrabSchema, "world">): Promise<Grab> {
    const connection = this.connected();
    return new Grab(connection, world, await connection.call({ case: "grab", value: { ...grab, world } }, "grabbed"));
  }

  pause(world: string): Promise<Done> {
    return this.call({ case: "pause", value: { world } }, "done");
  }

  resume(world: string): Promise<Done> {
    return this.call({ case: "resume", value: { world } }, "done");
  }

  /** Steps a paused world; comes back after the last of the ticks, however long they take. */
  async step(world: string, ticks = 1): Promise<Done> {
    return this.connected().call({ case: "step", value: { world, ticks } }, "done", undefined, 0);
  }

  /** Back to the scene as it was created. */
  reset(world: string): Promise<Done> {
    return this.call({ case: "reset", value: { world } }, "done");
  }

  /** Of a recording that is played. */
  seek(world: string, timeS: number): Promise<Done> {
    return this.call({ case: "seek", value: { world, timeS } }, "done");
  }

  stats(world: string): Promise<Stats> {
    return this.call({ case: "getStats", value: { world } }, "stats");
  }

  /** The scene with its edits; soft bodies are where the scene puts them. */
  async scene(world: string): Promise<Scene> {
    const { scene } = await this.call({ case: "getScene", value: { world } }, "scene");
    if (!scene) throw new PneumaError("MALFORMED", "a reply without a scene", "getScene");
    return scene;
  }

  private connected(): Connection {
    if (this.connection) return this.connection;
    throw new PneumaError("UNAVAILABLE", this.state_ === "lost" ? "the connection is lost" : "the client is closed");
  }

  private setState(state: ClientState, reason?: PneumaError): void {
    if (state === this.state_) return;
    this.state_ = state;
    this.options.stateChanged?.(state, reason);
  }

  private async open(): Promise<void> {
    const connection: Connection = await Connection.open(this.url, {
      token: this.options.token ?? "",
      clientName: this.options.clientName ?? "@pneuma/client",
      connectTimeoutMs: this.options.connectTimeoutMs ?? 5_000,
      replyTimeoutMs: this.options.replyTimeoutMs ?? 10_000,
      update: (message, bytes) => this.take(message, bytes),
      ended: (error) => this.lose(error),
    });
    if (this.state_ === "closed") return connection.end(new PneumaError("UNAVAILABLE", "the client was closed"));
    this.connection = connection;
    this.setState("open");
    await Promise.all([...this.streams].map((stream) => this.beginAgain(stream)));
  }

  private lose(error: PneumaError): void {
    this.connection = undefined;
    this.streamsById = new Map();
    if (this.state_ === "closed") return;
    if (this.options.reconnect === false || lastingErrors.has(error.code)) return this.closeFor(error);
    this.setState("lost", error);
    this.tryAgain(0);
  }

  private tryAgain(failures: number): void {
    this.retry = setTimeout(() => {
      this.open().catch((error: PneumaError) => {
        if (lastingErrors.has(error.code)) this.closeFor(error);
        else if (this.state_ === "lost") this.tryAgain(failures + 1);
      });
    }, retryDelayMs(failures));
  }

  private closeFor(error: PneumaError): void {
    if (this.state_ === "closed") return;
    this.setState("closed", error);
    clearTimeout(this.retry);
    for (const stream of this.streams) this.endStream(stream, error);
    this.connection?.end(error);
    this.decoder.close();
  }

  private async begin(stream: Stream): Promise<void> {
    const value = { ...stream.options, world: stream.world, knownTopologies: this.meshes.hashes() };
    let isTaken = false;
    const accepted = (info: Subscribed) => {
      isTaken = this.streamsById.has(info.streamId);
      if (isTaken) return;
      stream.begin(info);
      this.streamsById.set(info.streamId, stream);
      this.streams.add(stream);
    };
    await this.connected().call({ case: "subscribe", value: create(SubscribeSchema, value) }, "subscribed", accepted);
    if (isTaken) throw new PneumaError("FAILED_PRECONDITION", "there is a stream of this world, rate and error bound");
  }

  private async beginAgain(stream: Stream): Promise<void> {
    try {
      await this.begin(stream);
    } catch (error) {
      // Of a connection that broke again, the next one begins it.
      if ((error as PneumaError).code !== "UNAVAILABLE") this.endStream(stream, error as PneumaError);
    }
  }

  private endStream(stream: Stream, error: PneumaError): void {
    this.streams.delete(stream);
    this.streamsById.delete(stream.subscribed.streamId);
    stream.end(error);
  }

  private take(message: Update, bytes: number): void {
    try {
      if (message.case === "topology") this.meshes.add(message.value);
      else if (message.case === "layout") this.streamsById.get(message.value.streamId)?.takeLayout(message.value);
      else if (message.case === "frame") this.streamsById.get(message.value.streamId)?.takeFrame(message.value, bytes);
      else if (message.case === "gap") this.streamsById.get(message.value.streamId)?.takeGap(message.value);
      else if (message.case === "applied") this.streamsById.get(message.value.streamId)?.takeApplied(message.value);
      else if (message.case === "event") this.takeEvent(message.value);
    } catch (error) {
      if (!(error instanceof PneumaError)) throw error;
      this.connection?.end(error);
    }
  }

  private takeEvent(event: Event): void {
    const stream = this.streamsById.get(event.streamId);
    if (event.kind === Event_Kind.STREAM_RATE_CHANGED) {
      stream?.setRate(event.rateHz);
    } else if (event.kind === Event_Kind.STREAM_REPLACED && stream && event.successor) {
      this.streamsById.delete(event.streamId);
      stream.begin(event.successor);
      this.streamsById.set(event.successor.streamId, stream);
    } else if (event.kind === Event_Kind.WORLD_DESTROYED) {
      const gone = [...this.streams].filter(({ world }) => world === event.world);
      for (const each of gone)
        this.endStream(each, new PneumaError("NOT_FOUND", "the world was destroyed", each.world));
    }
    this.options.event?.(event);
  }
}

// So that moves alone do not use up the requests a second that a server takes.
const moveIntervalMs = 25;

/** A vertex that is held. Over when it is released, its body is gone, the world is reset, or the connection ends. */
export class Grab {
  private target: Point | undefined;
  private isMoving = false;

  constructor(
    private readonly connection: Connection,
    private readonly world: string,
    /** What was grabbed, and at which tick. */
    readonly grabbed: Grabbed,
  ) {}

  /**
   * Moves the point that it is held to. May be called as often as the pointer moves: while one target is under way the
   * newest waits, those between are left out. Rejects when the grab is over.
   */
  async moveTo(target: Point): Promise<void> {
    this.target = target;
    if (this.isMoving) return;
    this.isMoving = true;
    try {
      while (this.target) {
        const next: Point = this.target;
        this.target = undefined;
        const { grabId } = this.grabbed;
        const pause = new Promise((resolve) => setTimeout(resolve, moveIntervalMs));
        await this.connection.call({ case: "moveGrab", value: { world: this.world, grabId, target: next } }, "done");
        await pause;
      }
    } finally {
      this.isMoving = false;
    }
  }

  async release(): Promise<void> {
    this.target = undefined;
    const { grabId } = this.grabbed;
    await this.connection.call({ case: "releaseGrab", value: { world: this.world, grabId } }, "done");
  }
}
