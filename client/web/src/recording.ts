// Records a world's stream and the changes made to it, in the file that `pneuma record` writes: proto/WIRE.md, "Recordings".
import { create, type MessageInitShape, toBinary } from "@bufbuild/protobuf";
import {
  type RecordingHeader,
  RecordingHeaderSchema,
  type RecordingIndex,
  RecordingIndexSchema,
} from "../proto/pneuma/v1/recording_pb.js";
import type { Frame } from "../proto/pneuma/v1/frame_pb.js";
import { Event_Kind, SubscribeSchema } from "../proto/pneuma/v1/session_pb.js";
import { Connection, type Update } from "./connection.js";
import { crc32c } from "./crc32c.js";
import { PneumaError } from "./errors.js";
import { PlayClock } from "./play_clock.js";
import { indexMagic, kinds, magic, prefixBytes, version } from "./recording_format.js";
import type { SubscribeOptions } from "./stream.js";

// It is held in memory; a tab of a browser has a few times as much.
const bytesMaxDefault = 512 * 1024 * 1024;

const ascii = new TextEncoder();

function record(kind: number, bytes: Uint8Array): Uint8Array {
  const out = new Uint8Array(prefixBytes + bytes.length);
  out[prefixBytes - 1] = kind;
  out.set(bytes, prefixBytes);
  const prefix = new DataView(out.buffer);
  prefix.setUint32(0, bytes.length, true);
  prefix.setUint32(4, crc32c(out.subarray(prefixBytes - 1)), true);
  return out;
}

/** A recording in memory. */
export class RecordingWriter {
  readonly index: RecordingIndex = create(RecordingIndexSchema);
  private readonly parts: Uint8Array[] = [];
  private bytes_ = 0;
  private layoutOffset = 0n;
  private readonly clock: PlayClock;

  constructor(header: RecordingHeader) {
    this.clock = new PlayClock(header.worldRateHz, header.stream?.tickS ?? 0);
    const preamble = new Uint8Array(magic.length + 4);
    preamble.set(ascii.encode(magic));
    new DataView(preamble.buffer).setUint32(magic.length, version, true);
    this.add(preamble);
    this.add(record(kinds.header, toBinary(RecordingHeaderSchema, header)));
  }

  get bytes(): number {
    return this.bytes_;
  }

  /** @param bytes the message as it was received */
  append(message: Update, bytes: Uint8Array): void {
    const { index } = this;
    const offset = BigInt(this.bytes_);
    if (message.case === "topology") index.topologyOffsets.push(offset);
    if (message.case === "layout") this.layoutOffset = offset;
    if (message.case === "applied") ++index.commands;
    if (message.case === "frame") this.indexFrame(message.value, offset);
    this.add(record(kinds.message, bytes));
  }

  /** The whole file. Nothing is appended after it. */
  finish(): Uint8Array[] {
    const offset = this.bytes_;
    this.add(record(kinds.index, toBinary(RecordingIndexSchema, this.index)));
    const trailer = new Uint8Array(8 + indexMagic.length);
    new DataView(trailer.buffer).setBigUint64(0, BigInt(offset), true);
    trailer.set(ascii.encode(indexMagic), 8);
    this.add(trailer);
    return this.parts;
  }

  private indexFrame(frame: Frame, offset: bigint): void {
    const { index } = this;
    const { tick } = frame;
    this.clock.take(frame);
    index.durationS = this.clock.durationS;
    if (frame.baseTick === undefined) {
      index.keys.push({
        $typeName: "pneuma.v1.RecordingIndex.Key",
        offset,
        layoutOffset: this.layoutOffset,
        tick,
        atS: index.durationS,
        framesBefore: index.frames,
      });
    }
    ++index.frames;
    index.lastTick = tick;
  }

  private add(bytes: Uint8Array): void {
    this.parts.push(bytes);
    this.bytes_ += bytes.length;
  }
}

export interface RecorderOptions extends SubscribeOptions {
  readonly token?: string;
  readonly connectTimeoutMs?: number;
  readonly replyTimeoutMs?: number;
  /** Of the file; past it the recording ends. Unset: 512 MiB. */
  readonly bytesMax?: number;
  /** Called once when it ends without `stop`: the world is gone, the connection broke, or it is full. What came is kept. */
  readonly ended?: (why: PneumaError) => void;
}

export interface RecordingProgress {
  /** Play time. */
  readonly durationS: number;
  readonly frames: number;
  readonly commands: number;
  readonly bytes: number;
}

/** Records one world over a connection of its own, without decoding anything. */
export class Recorder {
  private connection: Connection | undefined;
  private writer: RecordingWriter | undefined;
  /** What comes before the header can be written: the reply to Subscribe tells what is in it. */
  private early: [Update, Uint8Array][] = [];
  private file: Uint8Array[] | undefined;

  private constructor(private readonly options: RecorderOptions) {}

  /** @param url ws://HOST:PORT/ws, or wss: */
  static async start(url: string, world: string, options: RecorderOptions = {}): Promise<Recorder> {
    const {
      token = "",
      connectTimeoutMs = 5_000,
      replyTimeoutMs = 10_000,
      bytesMax: _,
      ended: __,
      ...stream
    } = options;
    const recorder = new Recorder(options);
    const connection = await Connection.open(url, {
      token,
      clientName: "recorder",
      connectTimeoutMs,
      replyTimeoutMs,
      update: (message, bytes) => recorder.take(message, bytes),
      ended: (error) => recorder.end(error),
    });
    recorder.connection = connection;
    try {
      const { rateHz: worldRateHz } = await connection.call({ case: "getStats", value: { world } }, "stats");
      const { scene } = await connection.call({ case: "getScene", value: { world } }, "scene");
      const value: MessageInitShape<typeof SubscribeSchema> = { commands: true, ...stream, world };
      const subscribe = { case: "subscribe", value: create(SubscribeSchema, value) } as const;
      const subscribed = await connection.call(subscribe, "subscribed");
      const header = create(RecordingHeaderSchema, {
        world,
        worldRateHz,
        stream: subscribed,
        startedUnixS: Date.now() / 1000,
        serverVersion: connection.welcome.serverVersion,
      });
      if (scene) header.scene = scene;
      recorder.begin(header);
      return recorder;
    } catch (error) {
      connection.end(error as PneumaError);
      throw error;
    }
  }

  get progress(): RecordingProgress {
    const { index, bytes } = this.writer!;
    return { durationS: index.durationS, frames: Number(index.frames), commands: Number(index.commands), bytes };
  }

  /** Ends it. Gives the parts of the file, in order, as often as it is asked. */
  stop(): readonly Uint8Array[] {
    this.file ??= this.writer!.finish();
    this.connection?.end(new PneumaError("UNAVAILABLE", "the recording was ended"));
    return this.file;
  }

  private begin(header: RecordingHeader): void {
    this.writer = new RecordingWriter(header);
    for (const [message, bytes] of this.early) {
      if (this.file) break; // it ended with the one before
      this.append(message, bytes);
    }
    this.early = [];
  }

  private take(message: Update, bytes: Uint8Array): void {
    if (this.file) return;
    if (this.writer) this.append(message, bytes);
    else this.early.push([message, bytes]);
  }

  private append(message: Update, bytes: Uint8Array): void {
    this.writer!.append(message, bytes);
    const isGone = message.case === "event" && message.value.kind === Event_Kind.WORLD_DESTROYED;
    if (isGone) this.end(new PneumaError("NOT_FOUND", "the world was destroyed", message.value.world));
    else if (this.writer!.bytes > (this.options.bytesMax ?? bytesMaxDefault)) {
      this.end(new PneumaError("LIMIT_EXCEEDED", "the recording is as large as it may be"));
    }
  }

  private end(why: PneumaError): void {
    if (this.file || !this.writer) return;
    this.stop();
    this.options.ended?.(why);
  }
}
