// A client of one server, over as many connections as it takes.
import { create, type MessageInitShape } from "@bufbuild/protobuf";
import { type Scene, type SceneEditSchema, type Vec3Schema } from "../proto/pneuma/v1/scene_pb.js";
import {
  type CreateWorldSchema,
  type Done,
  type Event,
  Event_Kind,
  type GrabSchema,
  type ImpulseSchema,
  type Stats,
  SubscribeSchema,
  type Subscribed,
  type Welcome,
  type WorldList_World,
} from "../proto/pneuma/v1/session_pb.js";
import { Connection, type Reply, type ReplyKind, type Request, type Update } from "./connection.js";
import { type FrameDecoder, InlineDecoder } from "./decoder.js";
import { callUser, PneumaError } from "./errors.js";
import { Grab } from "./grab.js";
import { isLasting, retryDelayMs, steadyMs } from "./retry.js";
import type { Socket } from "./socket.js";
import { type Feed, MeshStore, Stream, type StreamListener, type SubscribeOptions } from "./stream.js";

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
  /** Unset: frames are decoded on this thread. Closed with the client, or when connecting fails. */
  readonly decoder?: FrameDecoder;
  /** Unset: a WebSocket. With another one the client speaks to what is no server, as with `RecordingPlayer.open`. */
  readonly openSocket?: (url: string) => Promise<Socket>;
  /** Called with each change of state, and why. */
  readonly stateChanged?: (state: ClientState, reason?: PneumaError) => void;
  /** What happened in the worlds that are subscribed to. */
  readonly event?: (event: Event) => void;
}

function streamExists(): PneumaError {
  return new PneumaError("FAILED_PRECONDITION", "there is a stream of this world with these frames");
}

/**
 * A client of one server. Every request gives the server's reply, or rejects with a PneumaError: the server's own, with
 * its code, what and where, or UNAVAILABLE where the connection is lost or the reply does not come.
 */
export class Client {
  private readonly decoder: FrameDecoder;
  private readonly meshes = new MeshStore();
  /** Those that were accepted once and are not over. */
  private readonly streams = new Set<Stream>();
  /** Those whose first Subscribe has no answer yet. */
  private readonly asked = new Set<Stream>();
  /** Of this connection. */
  private streamsById = new Map<number, Stream>();
  /** By id, those of this connection whose Unsubscribe has no answer yet. */
  private leaving = new Map<number, Promise<unknown>>();
  private connection: Connection | undefined;
  private state_: ClientState = "lost";
  private openedAtMs = 0;
  /** Connections in a row that failed or did not last. */
  private failures = 0;
  private readonly timers = new Set<ReturnType<typeof setTimeout>>();
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
    try {
      await client.open();
    } catch (error) {
      client.decoder.close();
      throw error;
    }
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
   * Subscribes to a world's frames. Asking again for the same frames of the same world is FAILED_PRECONDITION as long as the
   * first stream lasts.
   */
  async subscribe(world: string, options: SubscribeOptions, listener: StreamListener): Promise<Stream> {
    const stream = new Stream(world, options, listener, this.streamsMade++, this.decoder, this.meshes);
    if (this.hasLike(stream)) throw streamExists();
    this.asked.add(stream);
    try {
      // An Unsubscribe sent after this Subscribe, for the successor of a stream that was left, could be for this one.
      if (this.leaving.size > 0) await Promise.all(this.leaving.values());
      await this.begin(stream);
    } finally {
      this.asked.delete(stream);
    }
    return stream;
  }

  async unsubscribe(stream: Stream): Promise<void> {
    if (!this.streams.has(stream)) return;
    const { streamId } = stream.subscribed;
    const isOpen = this.streamsById.get(streamId) === stream;
    this.endStream(stream, new PneumaError("UNAVAILABLE", "the stream was closed"));
    if (isOpen) await this.leave(streamId);
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

  /** @param timeScale simulated over real time from now on, 0.125 to 1, also of a world that runs; unset: as it was */
  resume(world: string, timeScale?: number): Promise<Done> {
    const value = timeScale === undefined ? { world } : { world, timeScale };
    return this.call({ case: "resume", value }, "done");
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
    callUser(() => this.options.stateChanged?.(state, reason));
  }

  private async open(): Promise<void> {
    const connection: Connection = await Connection.open(this.url, {
      token: this.options.token ?? "",
      clientName: this.options.clientName ?? "@pneuma/client",
      connectTimeoutMs: this.options.connectTimeoutMs ?? 5_000,
      replyTimeoutMs: this.options.replyTimeoutMs ?? 10_000,
      update: (message, bytes) => this.take(message, bytes.length),
      ended: (error) => this.lose(error),
      ...(this.options.openSocket ? { openSocket: this.options.openSocket } : {}),
    });
    if (this.state_ === "closed") return connection.end(new PneumaError("UNAVAILABLE", "the client was closed"));
    this.connection = connection;
    this.openedAtMs = Date.now();
    this.setState("open");
    for (const stream of this.streams) void this.beginAgain(stream);
  }

  private lose(error: PneumaError): void {
    this.connection = undefined;
    this.streamsById = new Map();
    this.leaving = new Map();
    if (this.state_ === "closed") return;
    if (this.options.reconnect === false || isLasting(error)) return this.closeFor(error);
    if (Date.now() - this.openedAtMs >= steadyMs) this.failures = 0;
    this.setState("lost", error);
    this.tryAgain(error);
  }

  private tryAgain({ retryAfterS }: PneumaError): void {
    this.later(retryDelayMs(this.failures++, retryAfterS), () => {
      this.open().catch((error: PneumaError) => {
        if (isLasting(error)) this.closeFor(error);
        else if (this.state_ === "lost") this.tryAgain(error);
      });
    });
  }

  /** Not past the client's end. */
  private later(delayMs: number, action: () => void): void {
    if (this.state_ === "closed") return;
    const timer = setTimeout(() => {
      this.timers.delete(timer);
      action();
    }, delayMs);
    this.timers.add(timer);
  }

  private closeFor(error: PneumaError): void {
    if (this.state_ === "closed") return;
    this.setState("closed", error);
    for (const timer of this.timers) clearTimeout(timer);
    for (const stream of this.streams) this.endStream(stream, error);
    this.connection?.end(error);
    this.decoder.close();
  }

  private hasLike(stream: Stream): boolean {
    return [...this.streams, ...this.asked].some((other) => other !== stream && other.isLike(stream));
  }

  /** @param timeoutMs unset: that of all replies; 0: as long as the connection lasts */
  private async begin(stream: Stream, timeoutMs?: number): Promise<void> {
    const connection = this.connected();
    let holder: Stream | undefined;
    let isGivenUp = false;
    const accepted = (info: Subscribed) => {
      holder = this.streamsById.get(info.streamId);
      if (holder) return;
      if (stream.isOver || isGivenUp) {
        if (!this.hasLike(stream)) this.leaveUnasked(info.streamId);
        return;
      }
      stream.begin(info, this.feedOf(stream, connection));
      this.streamsById.set(info.streamId, stream);
      this.streams.add(stream);
    };
    try {
      await connection.call(this.subscribeRequest(stream), "subscribed", accepted, timeoutMs);
    } catch (error) {
      isGivenUp = true;
      throw error;
    }
    if (!holder) return;
    // Only the server could tell that the two are one. The first keeps the wishes it had.
    await connection.call(this.subscribeRequest(holder), "subscribed");
    throw streamExists();
  }

  private subscribeRequest(stream: Stream): Request {
    const value = { ...stream.options, world: stream.world, knownTopologies: this.meshes.hashes() };
    return { case: "subscribe", value: create(SubscribeSchema, value) };
  }

  /** On a connection on which it is not begun; of one that breaks, the next begins it. */
  private async beginAgain(stream: Stream, failures = 0): Promise<void> {
    const { connection } = this;
    const isStale = () => stream.isOver || connection === undefined || connection !== this.connection;
    if (isStale()) return;
    try {
      await this.begin(stream, 0);
    } catch (error) {
      if (isStale()) return;
      const { code, retryAfterS } = error as PneumaError;
      if (code !== "UNAVAILABLE") return this.endStream(stream, error as PneumaError);
      this.later(retryDelayMs(failures, retryAfterS), () => {
        if (!isStale()) void this.beginAgain(stream, failures + 1);
      });
    }
  }

  private feedOf(stream: Stream, connection: Connection): Feed {
    return {
      failed: (error) => {
        if (connection !== this.connection) return;
        // Bytes may be broken once. What cannot be read for another reason, or by a decoder that is broken, never can.
        if (error.code === "MALFORMED") connection.end(error);
        else this.closeFor(error);
      },
      behind: (caughtUp) => void this.catchUp(stream, caughtUp),
      keyWanted: () => {
        // Nothing comes of its reply: the key frame says it, and where none comes the stream asks again.
        const { streamId } = stream.subscribed;
        connection.call({ case: "requestKey", value: { streamId } }, "done").catch(() => {});
      },
    };
  }

  /** Leaves the stream at the server until what was received of it is decoded; it begins anew with a key frame. */
  private async catchUp(stream: Stream, caughtUp: Promise<unknown>): Promise<void> {
    const { connection } = this;
    const { streamId } = stream.subscribed;
    this.streamsById.delete(streamId);
    await Promise.allSettled([this.leave(streamId), caughtUp]);
    if (connection === this.connection) await this.beginAgain(stream);
  }

  private endStream(stream: Stream, error: PneumaError): void {
    this.streams.delete(stream);
    const { streamId } = stream.subscribed;
    // Its id may be of an earlier connection, and another's by now.
    if (this.streamsById.get(streamId) === stream) this.streamsById.delete(streamId);
    stream.end(error);
  }

  /** Ends a stream at the server. One that is not there any more is left, too. */
  private leave(streamId: number): Promise<void> {
    const { leaving } = this;
    const left = this.call({ case: "unsubscribe", value: { streamId } }, "done").then(
      () => {},
      (error: PneumaError) => {
        if (error.code !== "NOT_FOUND") throw error;
      },
    );
    const done = () => void leaving.delete(streamId);
    leaving.set(streamId, left.then(done, done));
    return left;
  }

  /** Nobody waits to hear that it failed. */
  private leaveUnasked(streamId: number): void {
    this.leave(streamId).catch(() => {});
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
    const { successor } = event;
    if (event.kind === Event_Kind.STREAM_RATE_CHANGED) {
      stream?.setRate(event.rateHz);
    } else if (event.kind === Event_Kind.STREAM_REPLACED && successor) {
      this.streamsById.delete(event.streamId);
      if (stream && this.connection) {
        stream.begin(successor, this.feedOf(stream, this.connection));
        this.streamsById.set(successor.streamId, stream);
      } else if (this.leaving.has(event.streamId)) {
        this.leaveUnasked(successor.streamId); // it crossed the Unsubscribe
      }
    } else if (event.kind === Event_Kind.WORLD_DESTROYED) {
      const gone = [...this.streams].filter(({ world }) => world === event.world);
      for (const each of gone)
        this.endStream(each, new PneumaError("NOT_FOUND", "the world was destroyed", each.world));
    }
    callUser(() => this.options.event?.(event));
  }
}
