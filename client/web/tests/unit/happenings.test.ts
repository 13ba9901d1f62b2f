// What the server tells of a world, in words.
import assert from "node:assert/strict";
import { test } from "node:test";
import { create, type MessageInitShape } from "@bufbuild/protobuf";
import { SceneChangeSchema } from "../../proto/pneuma/v1/scene_pb.js";
import { AppliedSchema, ClientMessageSchema, EventSchema } from "../../proto/pneuma/v1/session_pb.js";
import { Event_Kind } from "../../src/index.js";
import { changeWords } from "../../viewer/change_words.js";
import { deedText, happeningText, Surprises, surpriseText } from "../../viewer/happenings.js";

test("what happens to a body is said with its name and the server's reason", () => {
  for (const kind of [Event_Kind.BODY_BURST, Event_Kind.BODY_INVERTED, Event_Kind.BODY_FROZEN]) {
    const text = happeningText(create(EventSchema, { kind, body: "ball", detail: "because" }));
    assert.match(text, /^ball .*: because$/);
  }
});

test("a joint that breaks is named", () => {
  const event = create(EventSchema, { kind: Event_Kind.JOINT_BROKEN, joint: "thread", detail: "it takes at most 2 N" });
  assert.equal(happeningText(event), "thread has broken: it takes at most 2 N");
});

test("a world that began again is told of, and what the page shows otherwise is not", () => {
  const text = (kind: Event_Kind) => happeningText(create(EventSchema, { kind, world: "world" }));
  assert.notEqual(text(Event_Kind.WORLD_RESET), "");
  for (const kind of [Event_Kind.WORLD_SLOWED, Event_Kind.WORLD_DESTROYED, Event_Kind.STREAM_RATE_CHANGED]) {
    assert.equal(text(kind), "");
  }
});

test("what somebody did is told in words, and what a hand does many times a second is not", () => {
  const text = (request: MessageInitShape<typeof ClientMessageSchema>["request"]) =>
    deedText({ command: create(ClientMessageSchema, { request: request! }), sessionId: 0n });
  const change = { change: { case: "setGravity", value: { y: -1 } } } as const;
  assert.equal(
    text({ case: "edit", value: { source: { case: "edit", value: { changes: [change, change] } } } }),
    "gravity",
  );
  assert.equal(text({ case: "edit", value: { source: { case: "editJson", value: "{}" } } }), "the scene");
  assert.equal(text({ case: "resume", value: {} }), "time goes on");
  assert.equal(text({ case: "resume", value: { timeScale: 0.25 } }), "time goes at 0.25 ×");
  assert.equal(text({ case: "impulse", value: { body: "ball" } }), "ball was hit");
  assert.equal(text({ case: "moveGrab", value: {} }), "");
});

test("an edit is told by what it changes, and of which bodies", () => {
  const words = (...changes: MessageInitShape<typeof SceneChangeSchema>["change"][]) =>
    changeWords(changes.map((change) => create(SceneChangeSchema, { change: change! })));
  const ofBody = (name: string, value: object) => ({ case: "changeSoftBody", value: { name, ...value } }) as const;
  assert.equal(words(ofBody("ball", { gas: { moles: 2 } })), "gas of ball");
  assert.equal(
    words(ofBody("ball", { gas: { flowMolS: 0 } }), ofBody("ring", { gas: { flowMolS: 0 } })),
    "pump of ball and ring",
  );
  const stiff = ["a", "b", "c"].map((name) => ofBody(name, { springs: { stiffnessNM: 9 } }));
  assert.equal(words(...stiff, { case: "setWind", value: { x: 1 } }), "stiffness of 3 bodies, wind");
  assert.equal(words(ofBody("ball", { massKg: 2, drag: { normal: 1 } })), "mass of ball, drag of ball");
  assert.equal(words({ case: "removeSoftBody", value: "ball" }, { case: "removeMesh", value: "m" }), "ball removed");
  assert.equal(words({ case: "addRigidBody", value: { name: "thrown-1" } }), "thrown-1 added");
});

test("who did it is told, and of others what nobody would see coming is said aloud", () => {
  const by = (sessionId: bigint, request: MessageInitShape<typeof ClientMessageSchema>["request"]) =>
    create(AppliedSchema, { sessionId, command: { request: request! } });
  const pause = { case: "pause", value: {} } as const;
  const hit = { case: "impulse", value: { body: "ball" } } as const;
  assert.equal(deedText(by(7n, hit), 7n), "ball was hit, by you");
  assert.equal(deedText(by(8n, hit), 7n), "ball was hit, by visitor 8");
  assert.equal(deedText(by(0n, hit), 7n), "ball was hit");
  assert.equal(surpriseText(by(8n, pause), 7n), "Visitor 8: paused");
  const edit = { case: "edit", value: { source: { case: "editJson", value: "{}" } } } as const;
  assert.equal(surpriseText(by(8n, edit), 7n), "Visitor 8: the scene");
  for (const seen of [by(7n, pause), by(0n, pause), by(8n, hit)]) assert.equal(surpriseText(seen, 7n), "");
});

test("what goes on is said once, and again after a rest", () => {
  const surprises = new Surprises();
  const said = [0, 1000, 5500, 11_000].map((nowMs) => surprises.isNew("Visitor 8: changed", nowMs));
  assert.deepEqual(said, [true, false, false, true]);
  assert.ok(surprises.isNew("Visitor 9: changed", 11_001));
});
