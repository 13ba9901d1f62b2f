// A skin that is drawn finer than it is: through the vertices, without gaps, and rounder than its faces.
import assert from "node:assert/strict";
import { test } from "node:test";
import { IcosahedronGeometry, Vector3 } from "three";
import { mergeVertices } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { SmoothSkin } from "../../viewer/smooth_skin.js";

function ball(): { indices: Uint32Array; points: Float32Array } {
  const bare = new IcosahedronGeometry(1, 1).deleteAttribute("normal").deleteAttribute("uv");
  const geometry = mergeVertices(bare, 1e-5);
  const indices = Uint32Array.from(geometry.index!.array);
  return { indices, points: Float32Array.from(geometry.getAttribute("position").array) };
}

test("a ball of few faces gets rounder, and its vertices stay where they are", () => {
  const { indices, points } = ball();
  const skin = new SmoothSkin(indices, points.length / 3, 4);
  skin.update(points, points); // of a unit ball the normals are the places
  const fine = skin.geometry.getAttribute("position").array as Float32Array;
  assert.deepEqual(fine.subarray(0, points.length), points);
  const radii = Array.from({ length: fine.length / 3 }, (_, i) => Math.hypot(...fine.subarray(3 * i, 3 * i + 3)));
  assert.ok(Math.max(...radii.map((radius) => Math.abs(radius - 1))) < 0.01, `${Math.min(...radii)}`);
  const corner = (i: number) => new Vector3().fromArray(points, 3 * indices[i]!);
  const flat = corner(0).add(corner(1)).add(corner(2)).divideScalar(3).length();
  assert.ok(flat < 0.95, `the faces' middles are at ${flat}`);
});

test("a closed skin stays closed: each edge is of two faces, which run along it in opposite ways", () => {
  const { indices, points } = ball();
  for (const segments of [2, 3, 4]) {
    const { geometry } = new SmoothSkin(indices, points.length / 3, segments);
    const fine = geometry.index!.array;
    assert.equal(fine.length, indices.length * segments ** 2);
    const edges = new Set<string>();
    for (let face = 0; face < fine.length; face += 3) {
      for (let i = 0; i < 3; ++i) edges.add(`${fine[face + i]} ${fine[face + ((i + 1) % 3)]}`);
    }
    assert.equal(edges.size, fine.length);
    for (const edge of edges) assert.ok(edges.has(edge.split(" ").reverse().join(" ")));
  }
});

test("a flat sheet stays flat", () => {
  const skin = new SmoothSkin(Uint32Array.from([0, 1, 2, 2, 1, 3]), 4, 3);
  const points = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 1]);
  skin.update(points, Float32Array.from([0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0]));
  const fine = skin.geometry.getAttribute("position").array;
  for (let i = 1; i < fine.length; i += 3) assert.ok(Math.abs(fine[i]!) < 1e-6);
});
