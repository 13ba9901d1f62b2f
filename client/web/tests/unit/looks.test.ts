// What the page computes to show: colours, strains and bounding volumes, against what is known of them.
import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { Color, Matrix4, Vector3 } from "three";
import { Vec3Schema } from "../../proto/pneuma/v1/scene_pb.js";
import type { Frame } from "../../src/index.js";
import { fit } from "../../viewer/bounds_view.js";
import { diverging, niceCeiling, sequential } from "../../viewer/colour_map.js";
import { bodyColour, type Colour } from "../../viewer/colours.js";
import { ContactsView } from "../../viewer/contacts_view.js";
import { JointsView } from "../../viewer/joints_view.js";
import { SoftBodyView } from "../../viewer/soft_body_view.js";
import { Strain } from "../../viewer/strain.js";

/** Ottosson's own formulas, from linear red, green and blue. */
function oklab([r, g, b]: Colour): [number, number, number] {
  const l = Math.cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
  const m = Math.cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
  const s = Math.cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  return [
    0.2104542553 * l + 0.793617785 * m - 0.0040720468 * s,
    1.9779984951 * l - 2.428592205 * m + 0.4505937099 * s,
    0.0259040371 * l + 0.7827717662 * m - 0.808675766 * s,
  ];
}

function distance(one: Colour, other: Colour): number {
  const [a, b] = [oklab(one), oklab(other)];
  return Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

test("the steps of a colour map look alike", () => {
  for (const map of [sequential, diverging]) {
    const steps = Array.from({ length: 16 }, (_, i) => distance(map.at(i / 16), map.at((i + 1) / 16)));
    const mean = steps.reduce((sum, step) => sum + step) / steps.length;
    for (const step of steps)
      assert.ok(Math.abs(step / mean - 1) < 0.35, steps.map((each) => each.toFixed(3)).join(" "));
  }
});

test("lightness grows along the sequential map, and falls to both sides of the diverging one", () => {
  const lightness = (colour: Colour) => oklab(colour)[0];
  for (let i = 0; i < 16; ++i) {
    assert.ok(lightness(sequential.at(i / 16)) < lightness(sequential.at((i + 1) / 16)));
    assert.ok(Math.abs(lightness(diverging.at(i / 32)) - lightness(diverging.at(1 - i / 32))) < 0.03);
  }
});

test("the colours of bodies are told apart, and from the paper, light and dark", () => {
  const papers: Colour[] = [
    [0.9, 0.88, 0.84],
    [0.007, 0.009, 0.014],
  ];
  const colours = Array.from({ length: 7 }, (_, i) => bodyColour(i));
  colours.forEach((colour, i) => {
    for (const other of [...papers, ...colours.slice(0, i)]) assert.ok(distance(colour, other) > 0.1);
  });
});

test("a legend ends at a round number", () => {
  assert.deepEqual([0.021, 1, 3.2, 99, 100].map(niceCeiling), [0.05, 1, 5, 100, 100]);
});

test("what is stretched by a factor along one axis has that strain in its edges there, and none across", () => {
  const indices = Uint32Array.from([0, 1, 2]); // a right angle at vertex 0
  const strain = new Strain(indices, [0, 0, 0, 3, 0, 0, 0, 4, 0]);
  const strains = new Float32Array(3);
  assert.equal(strain.compute([0, 0, 0, 3, 0, 0, 0, 4, 0], strains), 0);
  strain.compute([0, 0, 0, 6, 0, 0, 0, 4, 0], strains);
  const slanted = Math.hypot(6, 4) / 5 - 1;
  [(1 + 0) / 2, (1 + slanted) / 2, (0 + slanted) / 2].forEach((expected, vertex) => {
    assert.ok(Math.abs(strains[vertex]! - expected) < 1e-6);
  });
});

test("the strain at the middle of a fan is the mean of all its edges, however many there are", () => {
  for (const spokes of [255, 256, 257]) {
    const rim = Array.from({ length: spokes }, (_, i) => (2 * Math.PI * i) / spokes);
    const fan = (radius: number) => [
      0,
      0,
      0,
      ...rim.flatMap((angle) => [radius * Math.cos(angle), radius * Math.sin(angle), 0]),
    ];
    const strain = new Strain(Uint32Array.from(rim.flatMap((_, i) => [0, i + 1, ((i + 1) % spokes) + 1])), fan(1));
    const strains = new Float32Array(spokes + 1);
    assert.ok(Math.abs(strain.compute(fan(2), strains) - 1) < 1e-5);
    assert.ok(Math.abs(strains[0]! - 1) < 1e-5);
  }
});

test("bounding volumes hold every point, and touch some", () => {
  const points = Float32Array.from([0, 0, 0, 4, 0, 0, 0, 2, 0, 0, 0, 6]);
  assert.deepEqual(fit("box", points), { centre: [2, 1, 3], half: [2, 1, 3] });
  assert.deepEqual(fit("ellipsoid", points), fit("box", points));
  const { centre, half } = fit("ball", points);
  assert.deepEqual(centre, [1, 0.5, 1.5]);
  assert.equal(half[0], Math.hypot(1, 0.5, 4.5));
});

/** A triangle on the ground, and a frame in which its vertex of this number in the whole mesh touches something below. */
function touching(vertex: number, keptVertices: number[]): { frame: Frame; body: SoftBodyView } {
  const mesh = { hash: "", vertexCount: 3, indices: Uint32Array.from([0, 1, 2]) };
  const places = Float64Array.from([0, 0, 0, 1, 0, 0, 0, 0, 1]);
  const body = new SoftBodyView("body", mesh, new Color(), false);
  body.update(places, places, 1, undefined);
  const contacts = [{ soft: 0, vertex, otherSoft: undefined, otherSolid: 0, normal: create(Vec3Schema, { y: 1 }) }];
  const layout = { softBodies: [{ name: "body", mesh, keptVertices }], solids: [], joints: [] };
  const none = { isKey: true, bytes: 0, velocities: undefined, poses: [], scalars: undefined };
  return { frame: { ...none, layout, tick: 0, timeS: 0, positions: [places], contacts }, body };
}

test("a contact's disc lies on its vertex, across the normal, on a coarse mesh too", () => {
  for (const { frame, body } of [touching(1, []), touching(40, [0, 40, 41])]) {
    const view = new ContactsView();
    view.update(frame, [body], 1);
    assert.equal(view.count, 1);
    const place = new Matrix4();
    view.discs.getMatrixAt(0, place);
    assert.ok(new Vector3().setFromMatrixPosition(place).distanceTo(new Vector3(1, 0, 0)) < 1e-6);
    const across = new Vector3(0, 0, 1).transformDirection(place); // a disc's own normal
    assert.ok(across.distanceTo(new Vector3(0, 1, 0)) < 1e-6);
  }
});

test("contacts of vertices that a coarse mesh does not have are left out", () => {
  const { frame, body } = touching(7, [0, 40, 41]);
  const view = new ContactsView();
  view.update(frame, [body], 1);
  assert.equal(view.count, 0);
});

test("a joint is drawn from point to point, where the bodies are drawn", () => {
  const { frame, body } = touching(1, [0, 40, 41]);
  const nowhere = { soft: undefined, solid: undefined, vertices: [], weights: [], point: create(Vec3Schema) };
  const held = { ...nowhere, soft: 0, vertices: [40, 41], weights: [0.5, 0.5] };
  const pillar = { ...nowhere, point: create(Vec3Schema, { y: 2 }) };
  const joints = [
    { name: "seen", first: held, second: pillar, isRope: false },
    { name: "left out", first: { ...held, vertices: [7], weights: [1] }, second: pillar, isRope: false },
  ];
  const view = new JointsView();
  view.update({ ...frame.layout, joints }, [body], []);
  assert.equal(view.count, 1);
  assert.deepEqual(view.places(), [0.5, 0, 0.5, 0, 2, 0]);
  view.update(frame.layout, [body], []);
  assert.equal(view.count, 0);
});
