// The edit that a changed text becomes, on a real server: it makes the scene what the text says, is taken back like any
// other, and what the server refuses of it is found in the text. The world rests.
import { create, equals } from "@bufbuild/protobuf";
import assert from "node:assert/strict";
import { after, afterEach, before, beforeEach, test } from "node:test";
import { Client, PneumaError, type Scene, SceneSchema } from "../../src/index.js";
import { spanOf, parseJson, placeOf } from "../../viewer/json_text.js";
import { difference, isSame } from "../../viewer/scene_difference.js";
import { refusalOfEdit } from "../../viewer/scene_refusal.js";
import { readScene, sceneText } from "../../viewer/scene_text.js";
import { WorldEdits } from "../../viewer/world_edits.js";
import { Server } from "../server.js";

const world = "w";
const scene = {
  name: "all-kinds",
  gravity: { y: -9.81 },
  stepping: { substeps: 32, on_unstable: "REFUSE", error_target: 0.02 },
  meshes: [
    { name: "ball", icosphere: { subdivisions: 1, radius_m: 0.5 } },
    { name: "sheet", grid: { columns: 2, rows: 2 } },
    { name: "stone", box: { half_extents: { x: 0.1, y: 0.1, z: 0.1 } } },
    { name: "unused", box: { half_extents: { x: 1, y: 1, z: 1 } } },
  ],
  soft_bodies: [
    {
      name: "full",
      mesh: "ball",
      position: { x: 2 },
      springs: { stiffness_n_m: 50, damping_n_s_m: 0.01 },
      gas: { moles: 0.01 },
      volume: { method: "SUBDIVIDED", resolution: 8 },
    },
    { name: "empty", mesh: "ball", position: { x: -2 }, springs: { stiffness_n_m: 50 }, mass_kg: 2, pins: [1, 2] },
    { name: "cloth", mesh: "sheet", position: { z: 3 }, springs: { stiffness_n_m: 20 }, surface: { friction: 0.5 } },
  ],
  rigid_bodies: [
    { name: "stone", shape: { mesh: "stone" }, position: { y: 3 }, velocity: { x: 1 } },
    { name: "bob", shape: { sphere: { radius_m: 0.1 } }, position: { y: 5 }, locked: { rotation: { x: true } } },
  ],
  colliders: [
    { name: "floor", shape: { plane: {} }, position: { y: -2 }, surface: { friction: 0.5 } },
    { name: "block", shape: { mesh: "unused" }, position: { y: -9 } },
  ],
  joints: [
    { name: "rope", first: { rigid_body: "bob" }, second: { point: { y: 6 } }, distance_limit: { longest_m: 2 } },
  ],
};

let server: Server;
let client: Client;
let edits: WorldEdits;

before(async () => {
  server = await Server.start([]);
  client = await Client.connect(server.url);
});
after(async () => {
  client.close();
  await server.kill();
});
beforeEach(async () => {
  const value = JSON.stringify(scene);
  await client.createWorld({ name: world, source: { case: "sceneJson", value }, paused: true });
  edits = new WorldEdits(
    () => {},
    (error) => assert.fail(error),
    (now) => now,
  );
  await edits.begin(client, world);
});
afterEach(() => client.destroyWorld(world));

/** The lists in the order of their names: what begins anew is at the end of its list. */
function inOrder(of: Scene): Scene {
  const lists = ["meshes", "softBodies", "rigidBodies", "colliders", "joints"] as const;
  const sorted = lists.map((list) => [list, [...of[list]].sort((a, b) => a.name.localeCompare(b.name))]);
  return create(SceneSchema, { ...of, ...Object.fromEntries(sorted) });
}

interface Rewritten {
  readonly text: string;
  readonly was: Scene;
  readonly is: Scene;
}

/** The world's scene as text, each of `words` replaced, and read again. */
async function rewritten(words: readonly (readonly [string, string])[]): Promise<Rewritten> {
  const was = await client.scene(world);
  const { text, kept } = sceneText(was);
  let changed = text;
  for (const [from, to] of words) {
    assert.equal(changed.split(from).length, 2, `${from} once in\n${changed}`);
    changed = changed.replace(from, to);
  }
  const read = readScene(changed, kept);
  assert.ok("scene" in read, JSON.stringify(read));
  return { text: changed, was, is: read.scene };
}

const rewritings: Record<string, readonly (readonly [string, string])[]> = {
  "another gravity": [['"gravity": {"y": -9.81}', '"gravity": {"x": 1}']],
  "no gravity": [['  "gravity": {"y": -9.81},\n', ""]],
  air: [['"gravity"', '"atmosphere": {"density_kg_m3": 1.2, "wind": {"x": 2}}, "gravity"']],
  "other steps": [['"substeps": 32', '"substeps": 40, "sleep": false']],
  "more gas, and another mass": [
    ['"moles": 0.01', '"moles": 0.02'],
    ['"mass_kg": 2', '"mass_kg": 3'],
  ],
  "gas where there was none": [['"mass_kg": 2', '"mass_kg": 2, "gas": {"moles": 0.01, "temperature_k": 300}']],
  "another method of the volume": [['"method": "SUBDIVIDED"', '"method": "MONTE_CARLO"']],
  "other pins, and factors of mass": [
    ['"pins": [1, 2]', `"pins": [3], "vertex_mass_scale": [${Array(42).fill(2).join()}]`],
  ],
  "stiffer vertices": [
    [
      '"springs": {"stiffness_n_m": 20}',
      `"springs": {"stiffness_n_m": 20, "vertex_stiffness_scale": [1,2,1,1,1,1,1,1,1]}`,
    ],
  ],
  "a body elsewhere": [['"position": {"x": -2}', '"position": {"x": -3}']],
  "a finer mesh under two bodies": [
    ['"subdivisions": 1', '"subdivisions": 2'],
    ['"pins": [1, 2]', '"pins": [3]'],
  ],
  "another body of the mesh of one": [['"mesh": "sheet"', '"mesh": "ball"']],
  "a body of another name": [['"name": "cloth"', '"name": "flag"']],
  "a rigid body of another shape under its joint": [['"radius_m": 0.1', '"radius_m": 0.2']],
  "a mesh of a rigid body, and one of an obstacle": [
    ['"half_extents": {"x": 0.1,', '"half_extents": {"x": 0.2,'],
    ['"half_extents": {"x": 1,', '"half_extents": {"x": 2,'],
  ],
  "other locks, and elsewhere": [
    ['"rotation": {"x": true}', '"translation": {"z": true}'],
    ['"position": {"y": 5}', '"position": {"y": 5.5}'],
  ],
  "another floor": [['"shape": {"plane": {}}', '"shape": {"sphere": {"radius_m": 1}}']],
  "a longer rope": [['"longest_m": 2', '"longest_m": 3']],
  "an obstacle of something else, and its mesh gone": [
    ['"shape": {"mesh": "unused"}', '"shape": {"plane": {}}'],
    [',\n    {"name": "unused", "box": {"half_extents": {"x": 1, "y": 1, "z": 1}}}', ""],
  ],
  "one body less and two more": [
    ['"name": "cloth"', '"name": "new"'],
    [
      '"colliders": [',
      '"colliders": [\n{"name": "wall", "shape": {"plane": {"normal": {"x": 1}}}, "position": {"x": -9}},',
    ],
  ],
};

for (const [what, words] of Object.entries(rewritings)) {
  test(`the scene becomes what the text says, and goes back: ${what}`, async () => {
    const { was, is } = await rewritten(words);
    const { changes, problems } = difference(was, is);
    assert.deepEqual(problems, []);
    assert.ok(!isSame(was, is));
    await edits.make(() => ({ says: what, changes: changes.map(({ change }) => change) }));
    const now = await client.scene(world);
    const left = difference(inOrder(now), inOrder(is)).changes;
    assert.deepEqual(left, []);
    const undone = await edits.undo();
    assert.ok(undone?.isWhole, "others did nothing");
    assert.deepEqual(difference(await client.scene(world), was).changes, []);
  });
}

test("a text that says the same makes no change", async () => {
  const { was, is } = await rewritten([]);
  assert.ok(equals(SceneSchema, was, is));
  assert.deepEqual(difference(was, is), { changes: [], anew: [], problems: [] });
});

test("a field that is left out is set to what unset means, and one that cannot be is told", async () => {
  const { was, is } = await rewritten([
    [', "error_target": 0.02', ""],
    [',\n      "mass_kg": 2', ""],
    [',\n      "surface": {"friction": 0.5}\n    }\n  ],\n  "rigid', '\n    }\n  ],\n  "rigid'],
  ]);
  const { changes, problems } = difference(was, is);
  assert.deepEqual(problems, [
    { at: ["soft_bodies", 2, "surface", "friction"], what: "a running world cannot forget friction; give it a value" },
  ]);
  await client.edit(world, { changes: changes.map(({ change }) => change) });
  const { stepping, softBodies } = await client.scene(world);
  assert.deepEqual([stepping?.errorTarget, softBodies[1]?.massKg], [0.01, 1]);
});

test("the scene's name, its precision, and a name that is there twice are no edits", async () => {
  const { was, is } = await rewritten([
    ['"name": "all-kinds"', '"name": "other"'],
    ['"substeps": 32', '"substeps": 32, "precision": "SINGLE"'],
    ['"name": "empty"', '"name": "full"'],
  ]);
  const told = difference(was, is).problems.map(({ at, what }) => `${at.join(".")}: ${what}`);
  assert.deepEqual(told, [
    "name: a world's scene keeps its name",
    "stepping.precision: a running world keeps its precision",
    'soft_bodies.1.name: "full" is there twice',
  ]);
});

test("only what was changed in the text is sent: the rest stays as others have it by then", async () => {
  const { was, is } = await rewritten([['"mass_kg": 2', '"mass_kg": 3']]);
  await client.edit(world, { changes: [{ change: { case: "setGravity", value: { y: -1 } } }] });
  await client.edit(world, { changes: difference(was, is).changes.map(({ change }) => change) });
  const { gravity, softBodies } = await client.scene(world);
  assert.deepEqual([gravity?.y, softBodies[1]?.massKg], [-1, 3]);
});

const refusals: Record<string, { words: readonly (readonly [string, string])[]; at: string; told: RegExp }> = {
  "a mass below zero": { words: [['"mass_kg": 2', '"mass_kg": -2']], at: '"mass_kg": -2', told: /^Mass: is -2/ },
  "a pin past the mesh": { words: [['"pins": [1, 2]', '"pins": [1, 200]']], at: "200", told: /200/ },
  "factors that are too few": {
    words: [['"pins": [1, 2]', '"pins": [1, 2], "vertex_mass_scale": [1, 2]']],
    at: '"vertex_mass_scale": [1, 2]',
    told: /2 factors/,
  },
  "a new body of no mesh": { words: [['"mesh": "sheet"', '"mesh": "nosuch"']], at: '"mesh": "nosuch"', told: /nosuch/ },
  "gas in a sheet": {
    words: [['"springs": {"stiffness_n_m": 20}', '"springs": {"stiffness_n_m": 20}, "gas": {"moles": 1}']],
    at: '"gas": {"moles": 1}',
    told: /closed/i,
  },
  "a floor without a shape": {
    words: [['"shape": {"plane": {}}', '"shape": {}']],
    at: '"shape": {}',
    told: /is missing/,
  },
  "a joint of no body": {
    words: [['{"rigid_body": "bob"}', '{"rigid_body": "nobody"}']],
    at: '"rigid_body": "nobody"',
    told: /nobody/,
  },
  "steps that are unstable": {
    words: [
      ['"stiffness_n_m": 20', '"stiffness_n_m": 9e8'],
      ['"substeps": 32', '"substeps": 1, "integrator": "MIDPOINT"'],
    ],
    at: '"substeps": 1',
    told: /stable|substeps/i,
  },
  "steps that are as they were, of stiffer springs": {
    words: [
      ['"stiffness_n_m": 20', '"stiffness_n_m": 9e8'],
      ['"substeps": 32', '"substeps": 32, "integrator": "MIDPOINT"'],
    ],
    at: '"substeps": 32',
    told: /^Substeps: 32 are too few/,
  },
  "a body less that a joint holds": {
    words: [['"name": "bob"', '"name": "bill"']],
    at: '"rigid_bodies"',
    told: /^"bob": Joint "rope" holds it$/,
  },
};

for (const [what, { words, at, told }] of Object.entries(refusals)) {
  test(`what the server refuses is found in the text: ${what}`, async () => {
    const { text, was, is } = await rewritten(words);
    const { changes, problems } = difference(was, is);
    assert.deepEqual(problems, []);
    const edit = client.edit(world, { changes: changes.map(({ change }) => change) });
    const error = await edit.then(
      () => assert.fail("it was done"),
      (refusal: PneumaError) => refusal,
    );
    const refusal = refusalOfEdit(changes, error);
    const { start, end } = spanOf(parseJson(text), refusal.at);
    const found = `${error.where} at ${placeOf(text, start).line}: ${text.slice(start, end)}`;
    assert.ok(text.slice(start, end).includes(at), `${error.message}; ${found}`);
    assert.match(refusal.what, told);
    assert.ok(isSame(await client.scene(world), was), "all or nothing");
  });
}
