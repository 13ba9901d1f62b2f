// Reads the triangles of a mesh file: OBJ, STL, PLY, glTF, GLB. A part of the page that is loaded when it is first needed.
import { Box3, type BufferGeometry, Mesh, MeshBasicMaterial, type Object3D, Vector3 } from "three";
import { type GLTF, GLTFLoader, type GLTFParser } from "three/examples/jsm/loaders/GLTFLoader.js";
import { OBJLoader } from "three/examples/jsm/loaders/OBJLoader.js";
import { PLYLoader } from "three/examples/jsm/loaders/PLYLoader.js";
import { STLLoader } from "three/examples/jsm/loaders/STLLoader.js";
import { checkSize } from "./files.js";

export interface Triangles {
  /** x y z of each vertex, in the file's unit. */
  readonly positions: Float64Array;
  /** Three a face. */
  readonly indices: Uint32Array;
}

// As the server's: proto/WIRE.md, "Limits".
const verticesMax = 65_536;
const facesMax = 262_144;
// In the file's unit: more is no number that a program wrote.
const lengthMax = 1e9;

/** What is wrong with a file, in words for whoever chose it. */
class MeshError extends Error {}

function tooLarge(): MeshError {
  return new MeshError(`a mesh has up to ${verticesMax} vertices and ${facesMax} faces`);
}

/** Throws Error with what is wrong with the first of `files`; the others are what a .gltf may refer to. */
export async function readMesh(files: readonly File[]): Promise<Triangles> {
  for (const each of files) checkSize(each);
  const file = files[0]!;
  const kind = file.name.split(".").at(-1)!.toLowerCase();
  try {
    return join(await objectOf(kind, await file.arrayBuffer(), files.slice(1)));
  } catch (error) {
    if (error instanceof MeshError) throw error;
    throw new MeshError(`it cannot be read as ${kind.toUpperCase()}`); // in a loader's words it says nothing
  }
}

async function objectOf(kind: string, bytes: ArrayBuffer, others: readonly File[]): Promise<Object3D> {
  const text = () => new TextDecoder().decode(bytes);
  if (kind === "obj") return new OBJLoader().parse(text());
  if (kind === "stl") {
    checkStl(bytes);
    return new Mesh(new STLLoader().parse(bytes));
  }
  if (kind === "ply") {
    const geometry = new PLYLoader().parse(bytes);
    if (!geometry.index) throw new MeshError("there are points in it, but no faces");
    return new Mesh(geometry);
  }
  if (kind === "glb" || kind === "gltf") return readGltf(kind === "glb" ? bytes : text(), others);
  throw new MeshError("the page reads OBJ, STL, PLY, glTF and GLB files");
}

/** The loader makes triangles of any bytes. */
function checkStl(bytes: ArrayBuffer): void {
  const [headBytes, faceBytes] = [84, 50];
  const faces = bytes.byteLength >= headBytes ? new DataView(bytes).getUint32(headBytes - 4, true) : NaN;
  if (bytes.byteLength === headBytes + faceBytes * faces) return;
  const begin = new TextDecoder().decode(bytes.slice(0, 1024));
  if (!/^\s*solid\b[^]*\bfacet\b/.test(begin)) throw new MeshError("it cannot be read as STL");
}

/** What of a glTF file is no shape is left out, and so are addresses: nothing is fetched. */
async function readGltf(content: ArrayBuffer | string, others: readonly File[]): Promise<Object3D> {
  const loader = new GLTFLoader();
  const buffers = new Map<number, Promise<ArrayBuffer>>();
  loader.register((parser: GLTFParser) => {
    // One that refers to no bytes is made of zeros, as many as it says.
    const accessors: { count: number }[] = parser.json.accessors ?? [];
    if (accessors.some(({ count }) => !(count <= 3 * facesMax))) throw tooLarge();
    return {
      name: "PNEUMA_shape_alone",
      loadMaterial: () => Promise.resolve(new MeshBasicMaterial()),
      loadBufferView: (index: number) => {
        const { buffer, byteOffset = 0, byteLength } = parser.json.bufferViews[index];
        const { uri } = parser.json.buffers[buffer];
        if (uri === undefined) return null; // within the file, as the loader knows it
        if (!buffers.has(buffer)) buffers.set(buffer, bytesOf(uri, others));
        return buffers.get(buffer)!.then((bytes) => bytes.slice(byteOffset, byteOffset + byteLength));
      },
    };
  });
  const gltf = await new Promise<GLTF>((resolve, reject) => loader.parse(content, "", resolve, reject as () => void));
  gltf.scene.updateMatrixWorld(true);
  return gltf.scene;
}

async function bytesOf(uri: string, others: readonly File[]): Promise<ArrayBuffer> {
  const inline = /^data:[^,]*;base64,(.*)$/s.exec(uri)?.[1];
  if (inline !== undefined) return Uint8Array.from(atob(inline), (letter) => letter.charCodeAt(0)).buffer;
  const name = decodeURIComponent(uri).split("/").at(-1);
  const file = others.find((other) => other.name === name);
  if (!file) throw new MeshError(`it refers to ${name}: choose both files together`);
  return file.arrayBuffer();
}

/**
 * All meshes as one. Vertices at the very same place are one vertex: most of these formats write a vertex anew for each
 * face or each normal that it has.
 */
function join(object: Object3D): Triangles {
  const positions: number[] = [];
  const indices: number[] = [];
  const known = new Map<string, number>();
  const point = new Vector3();
  object.updateMatrixWorld(true);
  object.traverse((part) => {
    if (!(part instanceof Mesh)) return;
    const geometry = part.geometry as BufferGeometry;
    const places = geometry.getAttribute("position");
    if (!places) return;
    const corners = geometry.index?.count ?? places.count;
    if (indices.length + corners > 3 * facesMax + 2) throw tooLarge();
    for (let corner = 0; corner < corners - (corners % 3); ++corner) {
      point.fromBufferAttribute(places, geometry.index?.getX(corner) ?? corner).applyMatrix4(part.matrixWorld);
      const key = `${point.x} ${point.y} ${point.z}`;
      let vertex = known.get(key);
      if (vertex === undefined) {
        vertex = known.size;
        if (vertex === verticesMax) throw tooLarge();
        known.set(key, vertex);
        positions.push(point.x, point.y, point.z);
      }
      indices.push(vertex);
    }
  });
  if (indices.length === 0) throw new MeshError("there are no triangles in it");
  checkPlaces(positions);
  return { positions: Float64Array.from(positions), indices: Uint32Array.from(indices) };
}

/** A file of another kind may be read as one of these all the same: its points are then nowhere, or in one place. */
function checkPlaces(positions: readonly number[]): void {
  if (!positions.every((number) => Math.abs(number) < lengthMax)) throw new MeshError("its points are nowhere");
  const lengths = new Box3()
    .setFromArray(positions as number[])
    .getSize(new Vector3())
    .toArray();
  if (lengths.filter((length) => length > 0).length < 2) throw new MeshError("it has no surface");
}

/** Enclosed by the faces; of an open or flipped mesh this is no more than a guess, and may be negative. */
export function volumeOf({ positions, indices }: Triangles): number {
  let six = 0;
  for (let i = 0; i < indices.length; i += 3) {
    const [a, b, c] = [3 * indices[i]!, 3 * indices[i + 1]!, 3 * indices[i + 2]!];
    const cross = (j: number, k: number) =>
      positions[b + j]! * positions[c + k]! - positions[b + k]! * positions[c + j]!;
    six += positions[a]! * cross(1, 2) + positions[a + 1]! * cross(2, 0) + positions[a + 2]! * cross(0, 1);
  }
  return six / 6;
}
