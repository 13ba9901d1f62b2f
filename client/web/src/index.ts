// @pneuma/client: a client of pneuma-server for browsers and Node.
export { Client, type ClientOptions, type ClientState, type Point } from "./client.js";
export type { ReplyKind, Reply, Request, RequestKind } from "./connection.js";
export type { Triangles } from "./codec/mesh_order.js";
export { type FrameDecoder, InlineDecoder } from "./decoder.js";
export { type ErrorCode, PneumaError } from "./errors.js";
export { Grab } from "./grab.js";
export { RecordingPlayer } from "./recording_player.js";
export { readRecording, type RecordedFrame, type RecordingFile } from "./recording_reader.js";
export { Recorder, type RecorderOptions, type RecordingProgress } from "./recording.js";
export {
  type Contact,
  type Frame,
  type Layout,
  type Mesh,
  type SolidPose,
  type SolidSurface,
  Stream,
  type StreamListener,
  type SubscribeOptions,
} from "./stream.js";
export type { Socket } from "./socket.js";
export { WorkerDecoder } from "./worker_decoder.js";
export * from "../proto/pneuma/v1/scene_pb.js";
export { Event_Kind, Welcome_Role } from "../proto/pneuma/v1/session_pb.js";
export type {
  Applied,
  Done,
  Event,
  Grabbed,
  MendedMesh,
  Stats,
  Stats_Body,
  Subscribed,
  Welcome,
  WorldList_Recording,
  WorldList_World,
} from "../proto/pneuma/v1/session_pb.js";
