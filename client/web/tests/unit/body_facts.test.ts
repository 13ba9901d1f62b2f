// A body's card, of statistics whose figures are plain.
import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { StatsSchema } from "../../proto/pneuma/v1/session_pb.js";
import { type Frame, SceneSchema } from "../../src/index.js";
import { factsOf } from "../../viewer/body_facts.js";

const stats = create(StatsSchema, {
  softBodies: [
    {
      ...{ name: "ball", volumeM3: 4.2, pressurePa: 120, temperatureK: 293.15, moles: 2, kineticJ: 8 },
      ...{ centreOfMass: { x: 1, y: 2 }, momentum: { x: 6, y: 8 } },
    },
    { name: "cloth", frozen: true },
  ],
  rigidBodies: [{ name: "box", position: { z: 3 }, velocity: { y: -2 }, asleep: true }],
});
const scene = create(SceneSchema, {
  softBodies: [{ name: "ball", massKg: 5 }, { name: "cloth" }],
  rigidBodies: [{ name: "box", massKg: 3 }],
});
const layout = { softBodies: [{ name: "ball" }, { name: "cloth" }], solids: [{ name: "box" }] };
const contacts = [
  { soft: 0, otherSoft: 1 },
  { soft: 0, otherSolid: 0 },
];
const known = { stats, scene, frame: { layout, contacts } as unknown as Frame, hasContacts: true };

function facts(name: string, of = known): Record<string, string> {
  return Object.fromEntries(factsOf(name, of));
}

test("a soft body's card has its gas in units, its speed as momentum over mass, and its contacts", () => {
  const ball = facts("ball");
  assert.equal(ball["Mass"], "5 kg");
  assert.equal(ball["Over-pressure"], "120 Pa");
  assert.equal(ball["Temperature"], "20 °C");
  assert.equal(ball["Place, m"], "1.00, 2.00, 0.00");
  assert.equal(ball["Speed"], "2 m/s");
  assert.equal(ball["Contacts"], "2");
  assert.equal(ball["State"], "awake");
});

test("what has no gas tells of none, and what is not known is left out", () => {
  const cloth = facts("cloth");
  assert.ok(!("Gas" in cloth) && cloth["State"] === "frozen" && cloth["Contacts"] === "1");
  assert.ok(!("Contacts" in facts("cloth", { ...known, hasContacts: false })));
  assert.deepEqual(facts("box"), {
    Mass: "3 kg",
    "Place, m": "0.00, 0.00, 3.00",
    Speed: "2 m/s",
    Contacts: "1",
    State: "asleep",
  });
  assert.deepEqual(facts("floor"), {});
});
