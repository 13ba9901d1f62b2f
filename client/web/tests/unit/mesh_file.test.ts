// What of files is no mesh is refused before it takes memory; those that are read are tried on the page.
import assert from "node:assert/strict";
import { File } from "node:buffer";
import { test } from "node:test";
import { checkSize } from "../../viewer/files.js";
import { readMesh } from "../../viewer/mesh_file.js";

type PageFile = Parameters<typeof checkSize>[0];

function file(name: string, text: string): PageFile {
  return new File([text], name) as unknown as PageFile;
}

function ply(vertices: number, lines: readonly string[]): string {
  const head = ["ply", "format ascii 1.0", `element vertex ${vertices}`];
  return [...head, ...["x", "y", "z"].map((axis) => `property float ${axis}`), ...lines].join("\n");
}

test("a file of more than 64 MiB is not read", async () => {
  const huge = { name: "huge.obj", size: 2 ** 26 + 1, arrayBuffer: () => assert.fail("it was read") };
  await assert.rejects(readMesh([huge as unknown as PageFile]), /huge\.obj: 65 MiB/);
  checkSize({ name: "fits.obj", size: 2 ** 26 } as PageFile);
});

test("points without faces are no mesh", async () => {
  const points = ply(3, ["end_header", "0 0 0", "1 0 0", "0 1 0"]);
  await assert.rejects(readMesh([file("points.ply", points)]), /no faces/);
  const faces = ["element face 1", "property list uchar int vertex_indices", "end_header"];
  const { indices } = await readMesh([file("face.ply", ply(3, [...faces, "0 0 0", "1 0 0", "0 1 0", "3 0 1 2"]))]);
  assert.deepEqual([...indices], [0, 1, 2]);
});

test("a glTF file that says it has more numbers than any mesh is refused", async () => {
  const gltf = (count: number) => ({
    asset: { version: "2.0" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
    accessors: [{ componentType: 5126, count, type: "VEC3" }],
  });
  await assert.rejects(readMesh([file("zeros.gltf", JSON.stringify(gltf(2 ** 31)))]), /up to 65536 vertices/);
  await assert.rejects(readMesh([file("zeros.gltf", JSON.stringify(gltf(3)))]), /no surface/);
});

test("a file of another kind is refused, whatever its name says", async () => {
  const picture = "\x89PNG\r\n\x1a\n" + "IHDR".repeat(200);
  for (const name of ["a.obj", "a.stl", "a.ply", "a.glb", "a.gltf"]) {
    await assert.rejects(readMesh([file(name, picture)]), /cannot be read as|no triangles|no faces/, name);
  }
  const nowhere = ["v 0 0 0", "v 1 0 0", "v nan 1 0", "f 1 2 3"].join("\n");
  await assert.rejects(readMesh([file("nan.obj", nowhere)]), /nowhere/);
  const point = ["v 1 1 1", "v 1 1 1", "v 1 1 1", "f 1 2 3"].join("\n");
  await assert.rejects(readMesh([file("point.obj", point)]), /no surface/);
});

test("a mesh of more vertices than the server takes is refused", async () => {
  const corners = Array.from({ length: 65_537 }, (_, i) => `v ${i} 0 0`);
  const faces = Array.from({ length: 65_535 }, (_, i) => `f ${i + 1} ${i + 2} ${i + 3}`);
  await assert.rejects(readMesh([file("many.obj", [...corners, ...faces].join("\n"))]), /up to 65536 vertices/);
});
