// Makes hand.obj, the mesh behind the scene asset "hand", and copies its licence to hand.LICENSE, both beside this script.
//
//   mkdir /tmp/hand && cd /tmp/hand
//   npm pack @webxr-input-profiles/assets@1.0.20 && tar xzf webxr-input-profiles-assets-*.tgz
//   node <this folder>/make_hand.mjs package/dist/profiles/generic-hand/left.glb
//
// Node 18 or later; nothing to install. The licence and the version are read from the unpacked package around left.glb.
// A report goes to stdout. Nothing is written unless every check holds; then the exit status is 0.
//
// The source is a left hand in metres, as a skinned mesh; its rest pose is its bind pose (they differ by 1.3e-8 m at most), so
// the stored positions are used and the skin is dropped. Vertices are split along texture seams and are welded where their
// positions are equal to the bit: the closest two distinct vertices are 1.08 mm apart, so no tolerance is called for.
//
// Axes of hand.obj: right-handed, fingers +y, wrist -y, palm +z, thumb -x; the origin is the centroid of the enclosed volume.

import { createHash } from 'node:crypto';
import { readFileSync, writeFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

// left.glb of version 1.0.20: right.glb has the same counts, and only the digest tells them apart.
const SOURCE_SHA256 = 'bc67783144944ea1cda54d9247885825ea5fb9d4651469fe7d00be517a5c2b87';
const EXPECTED_VERTICES = 1159;
const EXPECTED_FACES = 2314;
const POSITION_DECIMALS = 7; // 0.1 um: six significant digits at the hand's reach of 0.1 m
const MIN_FACE_AREA_M2 = 1e-6; // the smallest has 2.1e-6; rounding moves an area by about 4e-9 (1e-7 m along a 4 cm edge)
const MAX_CENTROID_M = 1e-7; // the rounding of positions

const GLB_MAGIC = 0x46546c67; // glTF 2.0 section 4.4: "glTF", then chunks of type JSON and BIN
const CHUNK_JSON = 0x4e4f534a;
const CHUNK_BIN = 0x004e4942;
const FLOAT = 5126;
const UNSIGNED_SHORT = 5123;

const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

function require_that(holds, what) {
  if (!holds) throw new Error(what);
}

/** Splits a binary glTF into its JSON document and its binary chunk. */
function parse_glb(bytes) {
  require_that(bytes.length >= 28 && bytes.readUInt32LE(0) === GLB_MAGIC, 'not a binary glTF file');
  const json_length = bytes.readUInt32LE(12);
  require_that(bytes.readUInt32LE(16) === CHUNK_JSON && 28 + json_length <= bytes.length, 'the JSON chunk is missing or cut');
  const bin_at = 20 + json_length;
  require_that(bytes.readUInt32LE(bin_at + 4) === CHUNK_BIN, 'the binary chunk is missing');
  return { gltf: JSON.parse(bytes.subarray(20, bin_at).toString('utf8')), bin: bytes.subarray(bin_at + 8) };
}

/** The only primitive's positions ([x, y, z] each) and triangles (three vertex numbers each), as stored. */
function read_mesh({ gltf, bin }) {
  const primitive = gltf.meshes[0].primitives[0];
  require_that(gltf.meshes.length === 1 && gltf.meshes[0].primitives.length === 1, 'expected one mesh of one primitive');
  require_that((primitive.mode ?? 4) === 4, 'expected triangles');
  const open = (index, component_type) => {
    const accessor = gltf.accessors[index];
    const view = gltf.bufferViews[accessor.bufferView];
    require_that(accessor.componentType === component_type && !accessor.sparse && !view.byteStride, 'unexpected accessor layout');
    return { count: accessor.count, at: (view.byteOffset ?? 0) + (accessor.byteOffset ?? 0) };
  };
  const position = open(primitive.attributes.POSITION, FLOAT);
  const index = open(primitive.indices, UNSIGNED_SHORT);
  const positions = Array.from({ length: position.count }, (_, v) =>
    [0, 4, 8].map((byte) => bin.readFloatLE(position.at + 12 * v + byte)));
  const triangles = Array.from({ length: index.count / 3 }, (_, f) =>
    [0, 2, 4].map((byte) => bin.readUInt16LE(index.at + 6 * f + byte)));
  return { positions, triangles };
}

/** One vertex for each distinct position, in order of first use by the file; triangles that lose a corner are dropped. */
function weld({ positions, triangles }) {
  const vertex_of_position = new Map();
  const welded = [];
  const vertex_of = positions.map((position) => {
    const key = position.join(' ');
    if (!vertex_of_position.has(key)) {
      vertex_of_position.set(key, welded.length);
      welded.push(position);
    }
    return vertex_of_position.get(key);
  });
  const faces = triangles
    .map((triangle) => triangle.map((v) => vertex_of[v]))
    .filter(([a, b, c]) => a !== b && b !== c && c !== a);
  return { vertices: welded, faces, dropped: triangles.length - faces.length };
}

/** Enclosed volume and its centroid, by signed tetrahedra from the origin (divergence theorem). */
function volume_and_centroid({ vertices, faces }) {
  let volume_m3 = 0;
  const moment = [0, 0, 0];
  for (const [a, b, c] of faces.map((face) => face.map((v) => vertices[v]))) {
    const tetrahedron_m3 = dot(a, cross(b, c)) / 6;
    volume_m3 += tetrahedron_m3;
    for (let k = 0; k < 3; ++k) moment[k] += (tetrahedron_m3 * (a[k] + b[k] + c[k])) / 4;
  }
  return { volume_m3, centroid_m: moment.map((m) => m / volume_m3) };
}

/** Turns the hand upright: the source has fingers -y, palm +x, thumb -z. A proper rotation, so the winding is kept. */
const stand_up = ([x, y, z]) => [z, -y, x];

function centre_and_round(mesh) {
  const { centroid_m } = volume_and_centroid(mesh);
  const round = (c) => Number(c.toFixed(POSITION_DECIMALS)) + 0; // adding 0 turns -0 into 0
  const vertices = mesh.vertices.map((v) => sub(v, centroid_m).map(round));
  return { ...mesh, vertices };
}

/** Undirected edges as [a, b] with a < b; throws unless each is used once in each direction. */
function closed_edges(faces) {
  const directed = new Set();
  for (const face of faces) {
    for (let k = 0; k < 3; ++k) {
      const edge = `${face[k]} ${face[(k + 1) % 3]}`;
      require_that(!directed.has(edge), `directed edge ${edge} appears twice`);
      directed.add(edge);
    }
  }
  const pairs = [...directed].map((edge) => edge.split(' ').map(Number));
  for (const [a, b] of pairs) require_that(directed.has(`${b} ${a}`), `edge ${a} ${b} has no opposite`);
  return pairs.filter(([a, b]) => a < b);
}

/** How many pieces the vertices fall into; a vertex that no edge reaches is a piece of its own. */
function count_components(vertex_count, edges) {
  const parent = Array.from({ length: vertex_count }, (_, v) => v);
  const root = (v) => {
    while (parent[v] !== v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const [a, b] of edges) parent[root(a)] = root(b);
  return parent.filter((p, v) => p === v).length;
}

/** Measures the mesh as it will be written. */
function measure({ vertices, faces, dropped }) {
  const edges = closed_edges(faces);
  const edge_lengths_m = edges.map(([a, b]) => Math.hypot(...sub(vertices[a], vertices[b])));
  const face_areas_m2 = faces.map(([a, b, c]) =>
    Math.hypot(...cross(sub(vertices[b], vertices[a]), sub(vertices[c], vertices[a]))) / 2);
  const sum = (numbers) => numbers.reduce((total, n) => total + n, 0);
  return {
    vertices: vertices.length,
    faces: faces.length,
    edges: edges.length,
    dropped_faces: dropped,
    euler_characteristic: vertices.length - edges.length + faces.length,
    components: count_components(vertices.length, edges),
    ...volume_and_centroid({ vertices, faces }),
    area_m2: sum(face_areas_m2),
    min_face_area_m2: Math.min(...face_areas_m2),
    min_edge_m: Math.min(...edge_lengths_m),
    mean_edge_m: sum(edge_lengths_m) / edges.length,
    max_edge_m: Math.max(...edge_lengths_m),
    lower_corner_m: [0, 1, 2].map((k) => Math.min(...vertices.map((v) => v[k]))),
    upper_corner_m: [0, 1, 2].map((k) => Math.max(...vertices.map((v) => v[k]))),
  };
}

function check(report) {
  require_that(report.vertices === EXPECTED_VERTICES, `${report.vertices} vertices, expected ${EXPECTED_VERTICES}`);
  require_that(report.faces === EXPECTED_FACES, `${report.faces} faces, expected ${EXPECTED_FACES}`);
  require_that(report.components === 1, `${report.components} components, expected 1`);
  require_that(report.euler_characteristic === 2, `Euler characteristic ${report.euler_characteristic}, expected 2`);
  require_that(report.volume_m3 > 0, `volume ${report.volume_m3} m^3: the faces point inwards`);
  require_that(report.min_face_area_m2 >= MIN_FACE_AREA_M2, `smallest face ${report.min_face_area_m2} m^2`);
  require_that(Math.hypot(...report.centroid_m) <= MAX_CENTROID_M, `centroid ${report.centroid_m} m, expected the origin`);
}

function to_obj({ vertices, faces }, provenance) {
  return [
    ...provenance.map((line) => `# ${line}`),
    ...vertices.map((v) => `v ${v.map((c) => c.toFixed(POSITION_DECIMALS)).join(' ')}`),
    ...faces.map((face) => `f ${face.map((v) => v + 1).join(' ')}`),
    '',
  ].join('\n');
}

function main(glb_path) {
  require_that(glb_path, 'usage: node make_hand.mjs <unpacked package>/dist/profiles/generic-hand/left.glb');
  const glb = readFileSync(glb_path);
  const digest = createHash('sha256').update(glb).digest('hex');
  require_that(digest === SOURCE_SHA256, `${glb_path} has SHA-256 ${digest}, expected ${SOURCE_SHA256}`);
  const package_root = resolve(dirname(glb_path), '../../..');
  const licence = readFileSync(join(package_root, 'LICENSE.md'), 'utf8');
  const { name, version } = JSON.parse(readFileSync(join(package_root, 'package.json'), 'utf8'));

  const welded = weld(read_mesh(parse_glb(glb)));
  const mesh = centre_and_round({ ...welded, vertices: welded.vertices.map(stand_up) });
  const report = measure(mesh);
  for (const [what, value] of Object.entries(report)) console.log(`${what}: ${[value].flat().join(' ')}`);
  check(report);

  const here = dirname(fileURLToPath(import.meta.url));
  writeFileSync(join(here, 'hand.obj'), to_obj(mesh, [
    'A left hand: closed, faces wound counter-clockwise seen from outside. Made by make_hand.mjs; do not edit.',
    `Source: npm package ${name} ${version}, dist/profiles/generic-hand/left.glb`,
    `Source SHA-256: ${digest}`,
    'Licence: MIT, see hand.LICENSE.',
    'Metres; fingers +y, palm +z, thumb -x; origin at the volume centroid.',
  ]));
  writeFileSync(join(here, 'hand.LICENSE'), licence);
}

try {
  main(process.argv[2]);
} catch (error) {
  console.error(`make_hand: ${error.message}`);
  process.exitCode = 1;
}
