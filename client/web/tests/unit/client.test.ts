// The client against a server that follows a script: connections that are lost, requests and events that cross.
import { create, fromBinary } from "@bufbuild/protobuf";
import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";
import { FrameSchema, GapSchema, LayoutSchema, TopologySchema } from "../../proto/pneuma/v1/frame_pb.js";
import {
  ClientMessageSchema,
  DoneSchema,
  Event_Kind,
  EventSchema,
  SubscribedSchema,
} from "../../proto/pneuma/v1/session_pb.js";
import {
  Client,
  type ClientOptions,
  type Frame,
  type FrameDecoder,
  PneumaError,
  type Stream,
  type StreamListener,
} from "../../src/index.js";
import { Frames } from "../frames.js";
import { type GoldenFrame, goldenStreams } from "../golden.js";
import { type Asked, type Peer, ScriptedServer } from "./peer.js";

const world = "somewhere";
const emptyPayload = Uint8Array.of(5); // of a world without soft bodies, in format 5
const listener: StreamListener = { frame: () => {} };

/** Keeps the first frame until it is told to finish. */
class SlowDecoder implements FrameDecoder {
  isFull = false;
  isClosed = false;
  finish!: () => void;
  askedFirst!: () => void;
  readonly asked = new Promise<void>((resolve) => (this.askedFirst = resolve));
  private readonly finished = new Promise<void>((resolve) => (this.finish = resolve));

  begin(): void {}
  async decode(): Promise<Float64Array> {
    this.askedFirst();
    await this.finished;
    return new Float64Array();
  }
  isBehind(): boolean {
    return this.isFull;
  }
  end(): void {}
  close(): void {
    this.isClosed = true;
  }
}

let server: ScriptedServer;
let client: Client;

beforeEach(async () => {
  server = await ScriptedServer.start();
});
afterEach(() => {
  client.close();
  server.close();
});

async function connect(options: ClientOptions = {}): Promise<Peer> {
  const peer = server.peer();
  client = await Client.connect(server.url, options);
  return peer;
}

async function subscribed(peer: Peer, streamId: number, to = listener, rateHz = 0): Promise<Stream> {
  const stream = client.subscribe(world, { rateHz }, to);
  (await peer.next("subscribe")).subscribed(streamId);
  return stream;
}

function sendLayout(peer: Peer, streamId: number): void {
  peer.send({ case: "layout", value: create(LayoutSchema, { streamId, layoutId: 1 }) });
}

function sendKey(peer: Peer, streamId: number, tick: number, payload = emptyPayload): void {
  peer.send({ case: "frame", value: create(FrameSchema, { streamId, layoutId: 1, tick: BigInt(tick), payload }) });
}

function sendReplaced(peer: Peer, streamId: number, by: number): void {
  const successor = create(SubscribedSchema, { streamId: by, gridStepM: 0.002 });
  const event = create(EventSchema, { kind: Event_Kind.STREAM_REPLACED, world, streamId, successor });
  peer.send({ case: "event", value: event });
}

function done(asked: Pick<Asked, "reply">): void {
  asked.reply({ case: "done", value: create(DoneSchema) });
}

test("waits grow over connections that open but do not last", async (t) => {
  const waitsMs: number[] = [];
  const setTimer = setTimeout;
  t.mock.method(Math, "random", () => 0);
  t.mock.method(globalThis, "setTimeout", (action: () => void, delayMs: number) => {
    if (delayMs > 2000) return setTimer(action, delayMs); // not a retry
    waitsMs.push(delayMs);
    return setTimer(action, 0);
  });
  let peer = await connect();
  for (let i = 0; i < 4; ++i) {
    const next = server.peer();
    peer.drop();
    peer = await next;
  }
  assert.deepEqual(waitsMs, [250, 500, 1000, 2000]);
});

test("frames of another format end the client for good", async () => {
  const states: string[] = [];
  const ended = new Promise<PneumaError>((resolve) => {
    const stateChanged: ClientOptions["stateChanged"] = (state) => states.push(state);
    void connect({ stateChanged }).then(async (peer) => {
      await subscribed(peer, 1, { ...listener, ended: resolve });
      sendLayout(peer, 1);
      sendKey(peer, 1, 1, Uint8Array.of(99));
    });
  });
  assert.equal((await ended).code, "UNSUPPORTED");
  assert.deepEqual(states, ["open", "closed"]);
});

test("a contact of a vertex that its mesh has not, or of no finite normal, is no frame", async () => {
  const decoder = new SlowDecoder();
  decoder.finish();
  let peer = await connect({ decoder });
  let tell!: (frame: Frame) => void;
  const told = new Promise<Frame>((resolve) => (tell = resolve));
  const asked = client.subscribe(world, { contacts: true }, { ...listener, frame: tell });
  const hash = Uint8Array.of(1);
  const send = (vertex: number, y: number): void => {
    const contacts = [{ soft: 0, vertex, normal: { y } }];
    const topology = create(TopologySchema, { hash, vertexCount: 3, indices: [0, 1, 2] });
    const softBodies = [{ name: "sail", topologyHash: hash }];
    peer.send({ case: "topology", value: topology });
    peer.send({ case: "layout", value: create(LayoutSchema, { streamId: 1, layoutId: 1, softBodies }) });
    peer.send({ case: "frame", value: create(FrameSchema, { streamId: 1, layoutId: 1, tick: 1n, contacts }) });
  };
  for (const [vertex, y] of [
    [3, 1],
    [2, NaN],
  ] as const) {
    (await peer.next("subscribe")).subscribed(1);
    const next = server.peer(); // since the connection cannot be trusted
    send(vertex, y);
    const first = await Promise.race([next, told]);
    assert.ok(!("contacts" in first), "it was taken");
    peer = first;
  }
  (await peer.next("subscribe")).subscribed(1);
  await asked;
  send(2, 1);
  assert.equal((await told).contacts[0]!.vertex, 2);
});

test("a collider that is a mesh comes with its triangles, which name no vertex that it has not", async () => {
  let peer = await connect();
  let tell!: (frame: Frame) => void;
  const told = new Promise<Frame>((resolve) => (tell = resolve));
  const asked = client.subscribe(world, {}, { ...listener, frame: tell });
  const send = (index: number): void => {
    const surface = { positions: [{ x: 1 }, { y: 2 }, { z: 3 }], indices: [0, 1, index] };
    const solids = [{ name: "ground", shape: { shape: { case: "mesh" as const, value: "m" } }, surface }];
    peer.send({ case: "layout", value: create(LayoutSchema, { streamId: 1, layoutId: 1, solids }) });
    sendKey(peer, 1, 1);
  };
  (await peer.next("subscribe")).subscribed(1);
  const next = server.peer(); // since the connection cannot be trusted
  send(3);
  peer = await next;
  (await peer.next("subscribe")).subscribed(1);
  await asked;
  send(2);
  const { surface } = (await told).layout.solids[0]!;
  assert.deepEqual([...surface!.positions], [1, 0, 0, 0, 2, 0, 0, 0, 3]);
  assert.deepEqual([...surface!.indices], [0, 1, 2]);
});

test("a decoder that is broken ends the client for good", async () => {
  const decoder = new SlowDecoder();
  decoder.decode = () => Promise.reject(new PneumaError("INTERNAL", "the worker cannot be loaded"));
  const peer = await connect({ decoder });
  const ended = new Promise<PneumaError>((resolve) => {
    void client.subscribe(world, {}, { ...listener, ended: resolve });
  });
  (await peer.next("subscribe")).subscribed(1);
  sendLayout(peer, 1);
  sendKey(peer, 1, 1);
  assert.equal((await ended).code, "INTERNAL");
  assert.equal(client.state, "closed");
});

test("connecting in vain closes the decoder", async () => {
  await connect();
  const { url } = server;
  server.close();
  const decoder = new SlowDecoder();
  await assert.rejects(Client.connect(url, { decoder }), { code: "UNAVAILABLE" });
  assert.ok(decoder.isClosed);
});

test("a stream that ends leaves another that has its former id", async () => {
  const peer = await connect();
  const frames = new Frames();
  await subscribed(peer, 1, frames);
  let end: () => void;
  const isOver = new Promise<void>((resolve) => (end = resolve));
  await subscribed(peer, 2, { ...listener, ended: () => end() }, 30);
  const next = server.peer();
  peer.drop();
  const again = await next;
  const [first, second] = [await again.next("subscribe"), await again.next("subscribe")];
  first.subscribed(2);
  second.refuse("NOT_FOUND");
  await isOver;
  const frame = frames.next();
  sendLayout(again, 2);
  sendKey(again, 2, 7);
  assert.equal((await frame).tick, 7);
});

test("a stream that is left while it begins again is left at the server, too", async () => {
  const peer = await connect();
  let ends = 0;
  const stream = await subscribed(peer, 1, { ...listener, ended: () => ++ends });
  const next = server.peer();
  peer.drop();
  const again = await next;
  const asked = await again.next("subscribe");
  await client.unsubscribe(stream);
  asked.subscribed(5);
  assert.equal((await again.next("unsubscribe")).value.streamId, 5);
  assert.equal(ends, 1);
});

test("a stream goes on as its successor", async () => {
  const peer = await connect();
  const frames = new Frames();
  const stream = await subscribed(peer, 1, frames);
  const frame = frames.next();
  sendReplaced(peer, 1, 2);
  sendLayout(peer, 2);
  sendKey(peer, 2, 3);
  assert.equal((await frame).tick, 3);
  assert.equal(stream.subscribed.gridStepM, 0.002);
  const left = client.unsubscribe(stream);
  const asked = await peer.next("unsubscribe");
  assert.equal(asked.value.streamId, 2);
  done(asked);
  await left;
});

test("a successor that crosses the Unsubscribe is left, too", async () => {
  const peer = await connect();
  const left = client.unsubscribe(await subscribed(peer, 1));
  const asked = await peer.next("unsubscribe");
  sendReplaced(peer, 1, 2);
  asked.refuse("NOT_FOUND");
  await left;
  assert.equal((await peer.next("unsubscribe")).value.streamId, 2);
});

test("a stream that is accepted too late is left", async () => {
  const peer = await connect({ replyTimeoutMs: 500 });
  await assert.rejects(client.subscribe(world, {}, listener), { code: "UNAVAILABLE" });
  (await peer.next("subscribe")).subscribed(7);
  assert.equal((await peer.next("unsubscribe")).value.streamId, 7);
});

test("a stream for which there was no room is asked for again", async () => {
  const peer = await connect();
  await subscribed(peer, 1);
  const next = server.peer();
  peer.drop();
  const again = await next;
  (await again.next("subscribe")).refuse("UNAVAILABLE", 0.01);
  await again.next("subscribe");
});

test("the same stream again is refused without asking the server", async () => {
  const peer = await connect();
  await subscribed(peer, 1);
  await assert.rejects(client.subscribe(world, { maxErrorM: 0.001, commands: true }, listener), {
    code: "FAILED_PRECONDITION",
  });
  client.worlds().catch(() => {});
  await peer.next("listWorlds");
});

test("a gap is told", async () => {
  const peer = await connect();
  const told = new Promise((resolve) => {
    void client.subscribe(world, {}, { ...listener, gap: (...ticks) => resolve(ticks) });
  });
  (await peer.next("subscribe")).subscribed(1);
  peer.send({ case: "gap", value: create(GapSchema, { streamId: 1, fromTick: 3n, toTick: 5n }) });
  assert.deepEqual(await told, [3, 5]);
});

test("a frame that fails its check is told once, and the stream goes on with the key frame that is asked for", async () => {
  const golden = goldenStreams().find(({ name }) => name === "one vertex")!;
  const [key, delta] = golden.frames as [GoldenFrame, GoldenFrame];
  const peer = await connect();
  const told: unknown[] = [];
  let fault!: (error: PneumaError) => void;
  const faulted = new Promise<PneumaError>((resolve) => (fault = resolve));
  const frames = new Frames();
  const frame = (one: Frame) => {
    told.push(one.tick);
    frames.frame(one);
  };
  const asked = client.subscribe(world, {}, { frame, fault: (error) => (told.push(error.code), fault(error)) });
  (await peer.next("subscribe")).subscribed(1);
  await asked;
  const hash = Uint8Array.of(1);
  const softBodies = [{ name: "dot", topologyHash: hash }];
  peer.send({ case: "topology", value: create(TopologySchema, { hash, vertexCount: 1 }) });
  peer.send({ case: "layout", value: create(LayoutSchema, { streamId: 1, layoutId: 1, softBodies }) });
  const send = (tick: number, of: GoldenFrame, check = of.check) => {
    const ticks = { tick: BigInt(tick), ...(of.isKey ? { layoutId: 1 } : { baseTick: BigInt(tick - 1) }) };
    const value = create(FrameSchema, { streamId: 1, payload: of.payload, check: check!, ...ticks });
    peer.send({ case: "frame", value });
  };
  send(1, key);
  send(2, delta, delta.check! ^ 1);
  send(3, delta); // under way when the fault is found
  const error = await faulted;
  assert.match(error.message, /the points are not the server's: their check is \d+, not \d+ \(tick 2\)/);
  const wanted = await peer.next("requestKey");
  assert.equal(wanted.value.streamId, 1);
  wanted.refuse("LIMIT_EXCEEDED");
  send(4, delta);
  const next = frames.next(({ tick }) => tick === 6);
  send(5, key);
  send(6, delta);
  assert.deepEqual(
    [...(await next).positions[0]!],
    delta.points![0]!.map((steps) => steps * 0.001),
  );
  assert.deepEqual(told, [1, "WRONG_STATE", 5, 6]);
});

test("a stream that is decoded too slowly is left until that is done, and goes on with a key frame", async () => {
  const decoder = new SlowDecoder();
  const peer = await connect({ decoder });
  const told: unknown[] = [];
  const isTold = new Promise<void>((resolve) => {
    const gap = (...ticks: number[]) => told.push(ticks);
    const frame = ({ tick }: Frame) => {
      told.push(tick);
      if (tick === 9) resolve();
    };
    void client.subscribe(world, {}, { frame, gap });
  });
  (await peer.next("subscribe")).subscribed(1);
  sendLayout(peer, 1);
  sendKey(peer, 1, 1);
  await decoder.asked;
  decoder.isFull = true;
  sendKey(peer, 1, 2);
  done(await peer.next("unsubscribe"));
  client.worlds().catch(() => {});
  await peer.next("listWorlds"); // and no Subscribe before it
  decoder.isFull = false;
  decoder.finish();
  (await peer.next("subscribe")).subscribed(1);
  sendLayout(peer, 1);
  sendKey(peer, 1, 9);
  await isTold;
  assert.deepEqual(told, [1, [2, 8], 9]);
});

test("a request that is larger than the server takes at once goes in parts, and one larger than those is not sent", async () => {
  server.welcome = { messageBytesMax: 200, partsBytesMax: 1000 };
  const peer = await connect();
  const json = "x".repeat(800);
  const edited = client.editJson(world, json);
  const bytes: number[] = [];
  for (;;) {
    const part = await peer.next("part");
    bytes.push(...part.value.data);
    assert.ok(part.value.data.length <= 200 - 32);
    if (part.value.last) {
      done(part);
      break;
    }
  }
  await edited;
  const { request } = fromBinary(ClientMessageSchema, Uint8Array.from(bytes));
  assert.ok(request.case === "edit" && request.value.source.value === json);

  await assert.rejects(client.editJson(world, json + json), (error: PneumaError) => error.code === "LIMIT_EXCEEDED");
});
