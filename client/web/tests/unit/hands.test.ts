// What the page makes of a wish, by closed forms: where a thrown ball flies, what holds an added one up, and how slow motion
// is shown.
import { create } from "@bufbuild/protobuf";
import assert from "node:assert/strict";
import { test } from "node:test";
import { Box3, Matrix4, Ray, Vector3 } from "three";
import { type Frame, QuaternionSchema, type Scene, SceneSchema, ShapeSchema, Vec3Schema } from "../../src/index.js";
import { molesFor, skinFor } from "../../viewer/additions.js";
import { Playback } from "../../viewer/playback.js";
import { freePlace, insideFrom } from "../../viewer/surroundings.js";
import { throwAt } from "../../viewer/throwing.js";

const emptyFrame: Frame = {
  layout: { softBodies: [], solids: [], joints: [] },
  tick: 0,
  timeS: 0,
  isKey: true,
  bytes: 0,
  positions: [],
  velocities: undefined,
  poses: [],
  scalars: undefined,
  contacts: [],
};

function sceneWith(rigidBodies: readonly string[]): Scene {
  return create(SceneSchema, { gravity: { y: -10 }, rigidBodies: rigidBodies.map((name) => ({ name })) });
}

test("a thrown ball is at its target in the end, gravity and all", () => {
  const [eye, target] = [new Vector3(0, 1, 5), new Vector3(1, 0.5, -2)];
  const { name, changes } = throwAt(sceneWith([]), emptyFrame, eye, target);
  assert.equal(name, "thrown-1");
  const change = changes[0]!.change;
  assert.ok(change?.case === "addRigidBody");
  const { position, velocity } = change.value;
  const [from, speed] = [position, velocity].map((at) => new Vector3(at!.x, at!.y, at!.z)) as [Vector3, Vector3];
  const fallM = (timeS: number) => new Vector3(0, -5 * timeS * timeS, 0);
  const missM = (timeS: number) => from.clone().addScaledVector(speed, timeS).add(fallM(timeS)).distanceTo(target);
  assert.ok(missM(0.45) < 1e-9, `${missM(0.45)} m off`);
});

test("of more than twelve thrown balls the oldest go, and other bodies stay", () => {
  const there = ["stone", ...Array.from({ length: 13 }, (_, i) => `thrown-${i + 4}`)];
  const { name, changes } = throwAt(sceneWith(there), emptyFrame, new Vector3(0, 0, 5), new Vector3());
  assert.equal(name, "thrown-17");
  const gone = changes.map(({ change }) => (change?.case === "removeRigidBody" ? change.value : ""));
  assert.deepEqual(gone, ["thrown-4", "thrown-5", ""]);
});

test("a ball thrown from outside a room begins within it", () => {
  const room = { pose: new Matrix4().makeRotationY(0.5).setPosition(1, 0, 0), halfExtents: new Vector3(2, 1, 2) };
  const from = insideFrom(new Ray(new Vector3(1, 0, 9), new Vector3(0, 0, -1)), room, 0.1);
  const local = from.clone().applyMatrix4(room.pose.clone().invert());
  const half = new Vector3(2, 1, 2).subScalar(0.1);
  assert.ok(new Box3(half.clone().negate(), half).containsPoint(local), local.toArray().join(" "));
  assert.ok(Math.abs(from.x - 1) < 1e-9 && from.z > 0, "on its way");
  const inside = new Vector3(1, 0.2, 0.3);
  assert.ok(insideFrom(new Ray(inside, new Vector3(0, 1, 0)), room, 0.1).distanceTo(inside) < 1e-9);
});

test("a free place is no nearer to a body than the thing that it is for reaches", () => {
  const positions = [Float64Array.from([-1, -1, -1, 1, 1, 1])];
  const mesh = { hash: "", vertexCount: 2, indices: new Uint32Array() };
  const layout = { softBodies: [{ name: "ball", mesh, keptVertices: [] }], solids: [], joints: [] };
  const place = freePlace({ ...emptyFrame, layout, positions }, new Vector3(), 0.5);
  assert.ok(new Box3(new Vector3(-1, -1, -1), new Vector3(1, 1, 1)).distanceToPoint(place) >= 0.5 - 1e-9);
});

test("above a floor, and in a room full of bodies within its walls", () => {
  const floor = create(ShapeSchema, { shape: { case: "plane", value: {} } });
  const at = (y: number) => ({ position: create(Vec3Schema, { y }), orientation: create(QuaternionSchema, { w: 1 }) });
  const onFloor = { softBodies: [], solids: [{ name: "floor", shape: floor, isDynamic: false }], joints: [] };
  const place = freePlace({ ...emptyFrame, layout: onFloor, poses: [at(1)] }, new Vector3(0, -3, 0), 0.5);
  assert.ok(place.y >= 1.5, `at ${place.y} m`);

  const halfExtents = { x: 1, y: 1, z: 1 };
  const room = create(ShapeSchema, { shape: { case: "room", value: { halfExtents } } });
  const mesh = { hash: "", vertexCount: 2, indices: new Uint32Array() };
  const full = {
    softBodies: [{ name: "ball", mesh, keptVertices: [] }],
    solids: [{ name: "room", shape: room, isDynamic: false }],
    joints: [],
  };
  const positions = [Float64Array.from([-1, -1, -1, 1, 1, 1])];
  const inside = freePlace({ ...emptyFrame, layout: full, positions, poses: [at(0)] }, new Vector3(9, 9, 9), 0.25);
  assert.ok(Math.max(...inside.toArray().map(Math.abs)) <= 0.75, inside.toArray().join(" "));
});

// P = 2 T / R with T = sqrt(3) k (1 - rest scale), and the law of ideal gases.
test("the gas of an added ball is at the pressure that its drawn skin holds", () => {
  const skin = { massKg: 1, stiffnessNM: 200, dampingNSM: 0, restScale: 0.9 };
  const volumeM3 = (4 / 3) * Math.PI * 0.5 ** 3;
  const pressurePa = (molesFor(skin, volumeM3, 100) * 8.314462618 * 293.15) / volumeM3;
  assert.ok(Math.abs(pressurePa - 100 - 4 * Math.sqrt(3) * 200 * 0.1) < 1e-6, `${pressurePa} Pa`);
});

test("a body of more vertices has softer springs, so that its steps are as stable", () => {
  const scene = create(SceneSchema, { softBodies: [{ name: "ball", springs: { stiffnessNM: 200, dampingNSM: 0.1 } }] });
  const mesh = { hash: "", vertexCount: 162, indices: new Uint32Array() };
  const frame = {
    ...emptyFrame,
    layout: { softBodies: [{ name: "ball", mesh, keptVertices: [] }], solids: [], joints: [] },
  };
  const [same, finer] = [skinFor(scene, frame, 162), skinFor(scene, frame, 1620)];
  assert.equal(same.stiffnessNM, 200);
  assert.ok(Math.abs(finer.stiffnessNM - 20) < 1e-9 && Math.abs(finer.dampingNSM - 0.01) < 1e-12);
});

test("in slow motion the picture goes as slowly as the world", () => {
  const playback = new Playback();
  playback.slowTo(0.25);
  const shown: number[] = [];
  let next = 0;
  // A frame of a sixtieth every fifteenth of a second, a picture every sixtieth.
  for (let picture = 0; picture < 240; ++picture) {
    if (picture % 4 === 0) playback.push({ ...emptyFrame, tick: next, timeS: next++ / 60 }, (1000 * picture) / 60);
    const { from, to, fraction } = playback.at((1000 * picture) / 60)!;
    shown.push(from.timeS + fraction * (to.timeS - from.timeS));
  }
  const steps = shown.slice(121).map((timeS, i) => timeS - shown[120 + i]!);
  for (const step of steps) assert.ok(Math.abs(step * 240 - 1) < 0.1, `${step * 240} of what it should be`);
});
