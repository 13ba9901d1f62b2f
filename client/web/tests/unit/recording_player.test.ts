// A recording that is played without a server, over its socket: what it answers, that it is heard of while nothing
// happens, and that it is where it was for the next connection. Its frames hold no bodies; the timers are the test's own.
import assert from "node:assert/strict";
import { type TestContext, test } from "node:test";
import { create, fromBinary, type MessageInitShape, toBinary } from "@bufbuild/protobuf";
import { RecordingHeaderSchema } from "../../proto/pneuma/v1/recording_pb.js";
import {
  ClientMessageSchema,
  Error_Code,
  Event_Kind,
  ServerMessageSchema,
  type ServerMessage,
} from "../../proto/pneuma/v1/session_pb.js";
import { type RecordingFile, RecordingPlayer, type Socket } from "../../src/index.js";

const world = "w";
const firstTick = 100;
const frameCount = 61; // of a second
const intervalMs = 1000 / 60;

type Request = MessageInitShape<typeof ClientMessageSchema>["request"];

function bytesOf(message: MessageInitShape<typeof ServerMessageSchema>["message"]): Uint8Array {
  return toBinary(ServerMessageSchema, create(ServerMessageSchema, { message: message! }));
}

function recording(): RecordingFile {
  const stream = { streamId: 7, world, rateHz: 60, maxErrorM: 0.001, tickS: 1 / 60 };
  const layout = bytesOf({ case: "layout", value: { streamId: 7, softBodies: [{ name: "ball" }] } });
  const frames = Array.from({ length: frameCount }, (_, i) => {
    const tick = BigInt(firstTick + i);
    const frame = i === 0 ? { tick, timeS: 5 } : { tick, baseTick: tick - 1n };
    const bytes = bytesOf({ case: "frame", value: frame });
    const message = fromBinary(ServerMessageSchema, bytes).message;
    assert.ok(message.case === "frame");
    return { frame: message.value, bytes, atS: i / 60, timeS: 5 + i / 60, layout, before: [] };
  });
  const header = create(RecordingHeaderSchema, { world, worldRateHz: 60, stream });
  return { header, topologies: [], frames };
}

/** What a client would do with a socket. */
class Talk {
  readonly heard: ServerMessage["message"][] = [];
  private readonly replies: ServerMessage["message"][] = [];

  constructor(readonly socket: Socket) {
    socket.onmessage = ({ data }) => {
      const { requestId, message } = fromBinary(ServerMessageSchema, new Uint8Array(data as ArrayBuffer));
      (requestId === 0n ? this.heard : this.replies).push(message);
    };
  }

  async ask(request: Request) {
    this.socket.send(toBinary(ClientMessageSchema, create(ClientMessageSchema, { requestId: 1n, request: request! })));
    await new Promise(setImmediate); // messages come in a turn of their own
    const reply = this.replies.pop();
    assert.ok(reply);
    return reply;
  }

  async refusal(request: Request): Promise<[string | undefined, string]> {
    const reply = await this.ask(request);
    assert.ok(reply.case === "error", `${reply.case}`);
    return [Error_Code[reply.value.code], reply.value.where];
  }

  async listing() {
    const reply = await this.ask({ case: "listWorlds", value: {} });
    assert.ok(reply.case === "worldList");
    return reply.value.worlds[0]!;
  }
}

async function playing(t: TestContext, player = new RecordingPlayer(recording())): Promise<Talk> {
  const talk = new Talk(await player.open());
  t.after(() => talk.socket.close());
  return talk;
}

test("its listing tells its length, its ticks, and the time of a frame that does not tell it", async (t) => {
  const talk = await playing(t);
  await talk.ask({ case: "seek", value: { world, timeS: 0.5 } });
  const { tick, timeS, softBodies, recording: facts } = await talk.listing();
  assert.deepEqual([tick, timeS, softBodies], [130n, 5.5, 1]);
  assert.deepEqual([facts?.durationS, facts?.firstTick, facts?.lastTick, facts?.velocities], [1, 100n, 160n, false]);
});

test("a seek to a frame's time finds it, though both are sums that were rounded", async (t) => {
  const talk = await playing(t);
  const done = await talk.ask({ case: "seek", value: { world, timeS: 29 / 60 - 1e-9 } });
  assert.ok(done.case === "done" && done.value.tick === 129n);
});

test("it is heard of while nothing happens", async (t) => {
  const repeated: (() => void)[] = [];
  t.mock.method(globalThis, "setInterval", (action: () => void, afterMs: number) => {
    if (afterMs < 20_000) repeated.push(action); // a client gives up whoever is silent for 40 s
    return undefined;
  });
  const talk = await playing(t);
  for (const action of repeated) action();
  await new Promise(setImmediate);
  assert.deepEqual(
    talk.heard.map(({ case: kind }) => kind),
    ["ping"],
  );
});

test("place, pause and speed outlive a connection, of which there is one at a time", async (t) => {
  const player = new RecordingPlayer(recording());
  const before = await playing(t, player);
  await assert.rejects(player.open(), { code: "FAILED_PRECONDITION" });
  await before.ask({ case: "resume", value: { world, timeScale: 0.5 } });
  await before.ask({ case: "pause", value: { world } });
  await before.ask({ case: "seek", value: { world, timeS: 0.5 } });
  before.socket.close();
  const { tick, paused, timeScale } = await (await playing(t, player)).listing();
  assert.deepEqual([tick, paused, timeScale], [130n, true, 0.5]);
});

test("it plays from where it stands when it is subscribed to, however long that took", async (t) => {
  const talk = await playing(t);
  await new Promise((resolve) => setTimeout(resolve, 300));
  await talk.ask({ case: "subscribe", value: { world } });
  const frames = talk.heard.filter(({ case: kind }) => kind === "frame");
  assert.ok(frames.length <= 1 + 100 / intervalMs, `${frames.length} frames at once`);
});

test("what cannot be had without a server is refused, not left out", async (t) => {
  const talk = await playing(t);
  const refusal = (value: object) => talk.refusal({ case: "subscribe", value: { world, ...value } });
  assert.deepEqual(await refusal({ bodies: ["nobody"] }), ["NOT_FOUND", "subscribe.bodies[0]"]);
  assert.deepEqual(await refusal({ bodies: ["ball"] }), ["UNSUPPORTED", "subscribe.bodies"]);
  assert.deepEqual(await refusal({ maxErrorM: 1e-4 }), ["LIMIT_EXCEEDED", "subscribe.max_error_m"]);
  assert.deepEqual(await refusal({ maxErrorM: NaN }), ["INVALID_ARGUMENT", "subscribe.max_error_m"]);
  assert.deepEqual(await refusal({ rateHz: 30 }), ["UNSUPPORTED", "subscribe.rate_hz"]);
  assert.deepEqual(await refusal({ rateHz: -1 }), ["INVALID_ARGUMENT", "subscribe.rate_hz"]);
  assert.deepEqual(await refusal({ levelOfDetail: 1 }), ["UNSUPPORTED", "subscribe.level_of_detail"]);
  const subscribed = await talk.ask({ case: "subscribe", value: { world, rateHz: 50, maxErrorM: 0.002 } });
  assert.equal(subscribed.case, "subscribed");
  const elsewhere = await talk.refusal({ case: "pause", value: { world: "elsewhere" } });
  assert.deepEqual(elsewhere, ["NOT_FOUND", "pause.world"]);
});

test("a step is refused while it plays, and where it is none or too many", async (t) => {
  const talk = await playing(t);
  const refusal = (ticks: number) => talk.refusal({ case: "step", value: { world, ticks } });
  assert.deepEqual(await refusal(1), ["FAILED_PRECONDITION", "step.world"]);
  await talk.ask({ case: "pause", value: { world } });
  assert.deepEqual(await refusal(0), ["INVALID_ARGUMENT", "step.ticks"]);
  assert.deepEqual(await refusal(36_001), ["LIMIT_EXCEEDED", "step.ticks"]);
  const done = await talk.ask({ case: "step", value: { world, ticks: 3 } });
  assert.ok(done.case === "done" && done.value.tick === 103n);
});

test("a reset is told to who is subscribed", async (t) => {
  const talk = await playing(t);
  await talk.ask({ case: "pause", value: { world } });
  await talk.ask({ case: "subscribe", value: { world } });
  await talk.ask({ case: "reset", value: { world } });
  const kinds = talk.heard.flatMap(({ case: kind, value }) => (kind === "event" ? [value.kind] : []));
  assert.deepEqual(kinds, [Event_Kind.WORLD_RESET]);
});
