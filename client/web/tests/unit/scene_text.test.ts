// A scene as text and back; and what is said of a text that is none.
import { create, equals } from "@bufbuild/protobuf";
import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { fromJsonString } from "@bufbuild/protobuf";
import { type Scene, SceneSchema } from "../../src/index.js";
import { placeOf } from "../../viewer/json_text.js";
import { readScene, sceneText, wholeSceneText } from "../../viewer/scene_text.js";

const folder = join(process.env["PNEUMA_SOURCE"] ?? "../..", "server/scenes");

function sceneOf(text: string, kept: Parameters<typeof readScene>[1] = []): Scene {
  const read = readScene(text, kept);
  assert.ok("scene" in read, JSON.stringify(read));
  return read.scene;
}

/** Each as line and words. */
function problemsOf(text: string): string[] {
  const read = readScene(text, []);
  assert.ok("problems" in read);
  return read.problems.map(({ at, what }) => `${placeOf(text, at.start).line}: ${what}`);
}

for (const file of readdirSync(folder).filter((name) => name.endsWith(".json"))) {
  test(`${file} is read as protobuf reads it, and comes back from its text as it was`, () => {
    const json = readFileSync(join(folder, file), "utf8");
    const scene = fromJsonString(SceneSchema, json);
    assert.ok(equals(SceneSchema, sceneOf(json), scene));
    const { text, kept } = sceneText(scene);
    assert.ok(equals(SceneSchema, sceneOf(text, kept), scene));
    assert.ok(equals(SceneSchema, fromJsonString(SceneSchema, wholeSceneText(scene)), scene));
  });
}

test("each body and each of its fields has a line, what is short has one alone, and fields are named as in files", () => {
  const scene = create(SceneSchema, {
    name: "s",
    softBodies: [
      { name: "ball", mesh: "m", massKg: 2, position: { y: 1 }, springs: { stiffnessNM: 200, dampingNSM: 0.25 } },
    ],
    colliders: [{ name: "floor" }],
  });
  assert.equal(
    sceneText(scene).text,
    `{
  "name": "s",
  "soft_bodies": [
    {
      "name": "ball",
      "mesh": "m",
      "position": {"y": 1},
      "mass_kg": 2,
      "springs": {"stiffness_n_m": 200, "damping_n_s_m": 0.25}
    }
  ],
  "colliders": [{"name": "floor"}]
}`,
  );
});

test("of a large mesh the lists are kept beside the text; bodies are not, however many", () => {
  const positions = Array.from({ length: 16_000 }, (_, i) => ({ x: i, y: 0.1 * i, z: -i }));
  const shape = { case: "triangles", value: { positions, indices: positions.map((_, i) => i) } } as const;
  const scene = create(SceneSchema, {
    meshes: [{ name: "m", shape }],
    colliders: Array.from({ length: 100 }, (_, i) => ({
      name: `c${i}`,
      shape: { shape: { case: "plane" as const, value: {} } },
    })),
  });
  const { text, kept } = sceneText(scene);
  assert.ok(text.length < 6_000 && text.includes('"c99"'));
  assert.match(text, /"positions": "… 16000 entries, kept as list 1"/);
  assert.ok(equals(SceneSchema, sceneOf(text, kept), scene));
  const renamed = text.replace('"name": "m"', '"name": "other"');
  assert.equal(sceneOf(renamed, kept).meshes[0]?.shape.case, "triangles");
  assert.match(problemsOf(text)[0]!, /a list of another text/);
});

test("fields that there are not are told at their lines, with what may have been meant", () => {
  const text = `{
  "gravty": {"y": -9.81},
  "soft_bodies": [
    {"name": "ball", "mas_kg": 1},
    {"name": "ring", "springs": {"stiffness": 5}, "colour": "red"}
  ]
}`;
  const [gravity, mass, stiffness, colour] = problemsOf(text);
  assert.equal(gravity, '2: "gravty" is unknown here; did you mean gravity?');
  assert.equal(mass, '4: "mas_kg" is unknown here; did you mean mass_kg?');
  assert.equal(stiffness, '5: "stiffness" is unknown here; did you mean stiffness_n_m?');
  assert.match(colour!, /^5: "colour" is unknown here; there may be name, mesh, position, /);
});

test("values that cannot be are told at their lines, with what is wanted", () => {
  const text = `{
  "name": 5,
  "gravity": -9.81,
  "stepping": {
    "substeps": 1.5,
    "integrator": "MIDPONT",
    "sleep": "yes",
    "rate_hz": 1e999
  },
  "soft_bodies": {"name": "ball"},
  "colliders": [
    {"name": "floor", "shape": {"plane": {}, "sphere": {"radius_m": 1}}},
    null
  ],
  "name": "again"
}`;
  assert.deepEqual(problemsOf(text), [
    "2: 5 stands here; a string is wanted",
    "3: -9.81 stands here; an object is wanted",
    "5: 1.5 stands here; a whole number from 0 to 4294967295 is wanted",
    '6: "MIDPONT" stands here; one of EXPLICIT_EULER, MIDPOINT, RK4, SYMPLECTIC_EULER, IMPLICIT_EULER, TR_BDF2, XPBD, AUTO is wanted'.replace(
      "AUTO is",
      "AUTO (MIDPOINT?) is",
    ),
    '7: "yes" stands here; true or false is wanted',
    "8: Infinity stands here; a number is wanted",
    "10: an object stands here; a list is wanted",
    "12: sphere stands beside plane; only one of them can be meant",
    "13: null stands here; an object is wanted",
    "15: name is given twice",
  ]);
});

test("what protobuf's JSON allows is read: either spelling, numbers in quotes, null for what is left out", () => {
  const { stepping, softBodies, gravity } = sceneOf(
    '{"gravity": null, "stepping": {"rateHz": "30", "integrator": 4}, "softBodies": [{"massKg": 2, "mesh": null}]}',
  );
  assert.deepEqual([gravity, stepping?.rateHz, stepping?.integrator, softBodies[0]?.massKg], [undefined, 30, 4, 2]);
});

test("a text with very many mistakes tells the first of them", () => {
  assert.equal(problemsOf(`{"soft_bodies": [${Array(1000).fill("1").join()}]}`).length, 20);
});
