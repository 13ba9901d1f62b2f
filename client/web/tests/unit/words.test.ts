// What the server says of a request, as the page says it: no path of the wire's messages, no name twice.
import assert from "node:assert/strict";
import { test } from "node:test";
import { counted, inWords } from "../../viewer/words.js";

test("a reason that is a sentence stands alone, without the path of the field", () => {
  const where = "edit.edit.changes[1].add_soft_body.mesh";
  assert.equal(inWords({ what: "gas needs a closed mesh", where }), "Gas needs a closed mesh");
  assert.equal(
    inWords({ what: "the world runs; pause it first", where: "step.world" }),
    "The world runs; pause it first",
  );
});

test("a reason without a subject gets the field as one", () => {
  const words = (what: string, where: string) => inWords({ what, where });
  assert.equal(
    words("is -1; must be positive", "edit.edit.changes[0].change_soft_body.mass_kg"),
    "Mass: is -1; must be positive",
  );
  assert.equal(words("32 are too few", "edit.edit.stepping.substeps"), "Substeps: 32 are too few");
  assert.equal(words("1 are too few", "edit.edit_json.changes[0].set_stepping.substeps"), "Substeps: 1 are too few");
  assert.equal(
    words("is not finite", "edit.edit.changes[0].add_mesh.triangles.positions[1].x"),
    "Positions x: is not finite",
  );
  assert.equal(words("may hold letters", "create_world.name"), "Name: may hold letters");
});

test("of a scene that somebody wrote the path is told, as it is in the file", () => {
  const where = "create_world.scene_json.soft_bodies[0].mesh";
  assert.equal(inWords({ what: "no mesh is named q", where }), "soft_bodies[0].mesh: no mesh is named q");
});

test("a file is named once", () => {
  assert.equal(
    inWords({ what: "there are no triangles in it", where: "a.obj" }),
    "a.obj: there are no triangles in it",
  );
  assert.equal(inWords({ what: "a.obj: empty", where: "a.obj" }), "a.obj: empty");
});

test("one thing is told of in the singular", () => {
  assert.deepEqual(
    [0, 1, 12_000].map((number) => counted(number, "face", "faces")),
    ["0 faces", "1 face", "12,000 faces"],
  );
});
