// Reads the file of a recording into memory, as it is to be played.
import { fromBinary } from "@bufbuild/protobuf";
import type { Frame } from "../proto/pneuma/v1/frame_pb.js";
import { type RecordingHeader, RecordingHeaderSchema } from "../proto/pneuma/v1/recording_pb.js";
import { type Applied, type Event, ServerMessageSchema } from "../proto/pneuma/v1/session_pb.js";
import { crc32c } from "./crc32c.js";
import { PneumaError } from "./errors.js";
import { PlayClock } from "./play_clock.js";
import { kinds, lengthMax, magic, prefixBytes, version } from "./recording_format.js";

export interface RecordedFrame {
  readonly frame: Frame;
  /** The message as it was received. */
  readonly bytes: Uint8Array;
  /** Play time. */
  readonly atS: number;
  /** The world's time, also where the frame does not tell its own. */
  readonly timeS: number;
  /** The message of the layout that it follows. */
  readonly layout: Uint8Array;
  /** What happened since the frame before: events, and what was applied. */
  readonly before: readonly RecordedHappening[];
}

export interface RecordedHappening {
  readonly happening:
    | { readonly case: "event"; readonly value: Event }
    | { readonly case: "applied"; readonly value: Applied };
  readonly bytes: Uint8Array;
}

export interface RecordingFile {
  readonly header: RecordingHeader;
  readonly topologies: readonly Uint8Array[];
  /** One at least, the first one a key frame. */
  readonly frames: readonly RecordedFrame[];
}

function malformed(what: string): PneumaError {
  return new PneumaError("MALFORMED", what);
}

/** The records up to the first one that is not whole: a file that was cut off is played up to there. */
function* recordsOf(file: Uint8Array): Generator<{ kind: number; bytes: Uint8Array }> {
  const view = new DataView(file.buffer, file.byteOffset, file.byteLength);
  const begin = magic.length + 4;
  const isOne = file.length >= begin && new TextDecoder().decode(file.subarray(0, magic.length)) === magic;
  if (!isOne) throw malformed("this is no recording");
  const found = view.getUint32(magic.length, true);
  if (found !== version) throw new PneumaError("UNSUPPORTED", `a recording of version ${found}; this reads ${version}`);
  for (let at = begin; at + prefixBytes <= file.length; ) {
    const length = view.getUint32(at, true);
    const end = at + prefixBytes + length;
    if (length > lengthMax || end > file.length) return;
    if (crc32c(file.subarray(at + 8, end)) !== view.getUint32(at + 4, true)) return;
    yield { kind: file[at + 8]!, bytes: file.subarray(at + prefixBytes, end) };
    at = end;
  }
}

/** Throws PneumaError for what is no recording, or one without a frame. */
export function readRecording(file: Uint8Array): RecordingFile {
  let header: RecordingHeader | undefined;
  let clock: PlayClock | undefined;
  let layout: Uint8Array | undefined;
  let before: RecordedHappening[] = [];
  const topologies: Uint8Array[] = [];
  const frames: RecordedFrame[] = [];
  try {
    for (const { kind, bytes } of recordsOf(file)) {
      if (kind === kinds.header) {
        header = fromBinary(RecordingHeaderSchema, bytes);
        clock = new PlayClock(header.worldRateHz, header.stream?.tickS ?? 0);
      }
      if (kind !== kinds.message) continue;
      const { message } = fromBinary(ServerMessageSchema, bytes);
      if (message.case === "topology") topologies.push(bytes);
      if (message.case === "layout") layout = bytes;
      if (message.case === "event" || message.case === "applied") before.push({ happening: message, bytes });
      if (message.case !== "frame" || !clock) continue;
      const frame = message.value;
      if (!layout || (frames.length === 0 && frame.baseTick !== undefined))
        throw malformed("frames before a key frame");
      clock.take(frame);
      frames.push({ frame, bytes, atS: clock.durationS, timeS: clock.timeS, layout, before });
      before = [];
    }
  } catch (error) {
    throw error instanceof PneumaError ? error : malformed("a record that is no message");
  }
  if (!header?.stream || frames.length === 0) throw malformed("a recording without a frame");
  return { header, topologies, frames };
}
