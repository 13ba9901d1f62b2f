// A body's card, of frames whose places tell their time: what they hold, and what they do not.
import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { type Frame, SceneSchema } from "../../src/index.js";
import { factsOfFrame, type Seen } from "../../viewer/frame_facts.js";

const scene = create(SceneSchema, {
  softBodies: [{ name: "ball", massKg: 5, gas: { moles: 1 } }, { name: "cloth" }],
  rigidBodies: [{ name: "box", massKg: 3 }],
  colliders: [{ name: "floor" }],
});
const layout = {
  softBodies: [{ name: "ball" }, { name: "cloth" }],
  solids: [
    { name: "box", isDynamic: true },
    { name: "floor", isDynamic: false },
  ],
};
const scalars = {
  ...{ volumeM3: [4.2, 0], pressurePa: [120, 0], kineticJ: [8, 0], elasticJ: [2, 0] },
  asleep: [false, true],
};

/** The ball goes along x by 3 m/s, the box down by 2 m/s. */
function frameAt(timeS: number, rest: Partial<Frame> = {}): Frame {
  const positions = [
    [3 * timeS - 1, 0, 0, 3 * timeS + 1, 2, 0],
    [0, 0, 0],
  ].map((points) => Float64Array.from(points));
  const poses = [{ position: { x: 0, y: -2 * timeS, z: 0 } }, { position: { x: 0, y: 0, z: 0 } }];
  return { layout, timeS, positions, poses, scalars, ...rest } as unknown as Frame;
}

function facts(name: string, from: Frame, to: Frame, of: Partial<Seen> = {}): Record<string, string> {
  return Object.fromEntries(
    factsOfFrame(name, { moment: { from, to, fraction: 1 }, scene, absent: "not recorded", ...of }),
  );
}

test("a soft body's place, speed and scalars are those of the frame, and what no frame tells is said to be absent", () => {
  assert.deepEqual(facts("ball", frameAt(1), frameAt(1.05)), {
    Mass: "5 kg",
    Volume: "4.2 m³",
    Gas: "not recorded",
    "Over-pressure": "120 Pa",
    Temperature: "not recorded",
    "Place, m": "3.15, 1.00, 0.00",
    Speed: "3 m/s",
    "Kinetic energy": "8 J",
    "Elastic energy": "2 J",
    "Gas energy": "not recorded",
    "Gravity energy": "not recorded",
    State: "awake",
  });
  assert.equal(facts("cloth", frameAt(1), frameAt(1.05))["State"], "asleep");
});

test("frames without scalars tell the place and the speed", () => {
  const without = { scalars: undefined };
  const ball = facts("ball", frameAt(1, without), frameAt(1.05, without));
  assert.deepEqual([ball["Place, m"], ball["Speed"]], ["3.15, 1.00, 0.00", "3 m/s"]);
  for (const name of ["Volume", "Over-pressure", "Kinetic energy", "State"]) assert.equal(ball[name], "not recorded");
});

test("one frame, or two far from each other, tell no speed, but velocities do", () => {
  assert.equal(facts("ball", frameAt(1), frameAt(1))["Speed"], "–");
  assert.equal(facts("ball", frameAt(1), frameAt(3))["Speed"], "–");
  const velocities = [Float64Array.from([0, 4, 0, 0, 0, 0]), new Float64Array(3)];
  assert.equal(facts("ball", frameAt(1), frameAt(1, { velocities }))["Speed"], "2 m/s");
});

test("a rigid body has its pose, and an obstacle no card", () => {
  const box = facts("box", frameAt(1), frameAt(1.05));
  assert.deepEqual([box["Mass"], box["Place, m"], box["Speed"]], ["3 kg", "0.00, -2.10, 0.00", "2 m/s"]);
  assert.deepEqual(facts("floor", frameAt(1), frameAt(1.05)), {});
});

test("the place is by the vertices' shares of the mass, where the mesh is whole", () => {
  const heavy = create(SceneSchema, { softBodies: [{ name: "ball", vertexMassScale: [1, 3] }] });
  assert.equal(facts("ball", frameAt(1), frameAt(1), { scene: heavy })["Place, m"], "3.50, 1.50, 0.00");
  const finer = create(SceneSchema, { softBodies: [{ name: "ball", vertexMassScale: [1, 3, 3] }] });
  assert.equal(facts("ball", frameAt(1), frameAt(1), { scene: finer })["Place, m"], "3.00, 1.00, 0.00");
});
