// The order in which a mesh's vertices are coded, and which of those coded before each is predicted from:
// proto/WIRE.md, "Order of the vertices".

/** The triangles of a mesh: three indices a face, each below `vertexCount`. */
export interface Triangles {
  readonly vertexCount: number;
  readonly indices: ArrayLike<number>;
}

/** By slot, the place of a vertex in the order. An earlier slot is named by its number plus 1, so that 0 is none. */
export interface MeshOrder {
  readonly size: number;
  /** The vertex of each slot. */
  readonly vertices: Int32Array;
  /** The slots of a slot's neighbours: rings[ringBegins[slot]] up to rings[ringBegins[slot + 1]]. */
  readonly ringBegins: Int32Array;
  readonly rings: Int32Array;
  /** Four a slot: the latest neighbours before it. */
  readonly parents: Int32Array;
  /** Six a slot, a b a b c c: two parallelograms a + b - c; without one, the first two parents and 0. */
  readonly parallelograms: Int32Array;
}

// Around an edge's end: a mesh made to have more costs no more.
const facesLookedAtMax = 32;

/** Lists of numbers, one a key, in one array. */
interface Lists {
  readonly begins: Int32Array;
  readonly entries: Int32Array;
}

function facesAtVertices({ vertexCount, indices }: Triangles): Lists {
  const begins = new Int32Array(vertexCount + 1);
  for (let corner = 0; corner < indices.length; ++corner) ++begins[indices[corner]! + 1]!;
  for (let vertex = 0; vertex < vertexCount; ++vertex) begins[vertex + 1]! += begins[vertex]!;
  const entries = new Int32Array(indices.length);
  const next = begins.slice();
  for (let corner = 0; corner < indices.length; ++corner) {
    entries[next[indices[corner]!]!++] = Math.floor(corner / 3);
  }
  return { begins, entries };
}

/** The vertices that share a face with each vertex, lowest first. */
function neighboursOf({ vertexCount, indices }: Triangles, faces: Lists): Lists {
  const begins = new Int32Array(vertexCount + 1);
  const entries = new Int32Array(2 * indices.length);
  let end = 0;
  for (let vertex = 0; vertex < vertexCount; ++vertex) {
    const begin = end;
    for (let at = faces.begins[vertex]!; at < faces.begins[vertex + 1]!; ++at) {
      for (let corner = 0; corner < 3; ++corner) {
        const other = indices[3 * faces.entries[at]! + corner]!;
        if (other !== vertex) entries[end++] = other;
      }
    }
    const sorted = entries.subarray(begin, end).sort();
    end = begin;
    for (const other of sorted) {
      if (end === begin || entries[end - 1] !== other) entries[end++] = other;
    }
    begins[vertex + 1] = end;
  }
  return { begins, entries: entries.slice(0, end) };
}

/** Breadth first, from the lowest vertex of each part. */
function breadthFirst(vertexCount: number, neighbours: Lists): Int32Array {
  const order = new Int32Array(vertexCount);
  const seen = new Uint8Array(vertexCount);
  let end = 0;
  for (let start = 0; start < vertexCount; ++start) {
    if (seen[start]) continue;
    seen[start] = 1;
    let next = end;
    order[end++] = start;
    for (; next < end; ++next) {
      const vertex = order[next]!;
      for (let at = neighbours.begins[vertex]!; at < neighbours.begins[vertex + 1]!; ++at) {
        const neighbour = neighbours.entries[at]!;
        if (seen[neighbour]) continue;
        seen[neighbour] = 1;
        order[end++] = neighbour;
      }
    }
  }
  return order;
}

/** The third vertex of the first face with the edge a b whose third vertex comes before `slot`; -1: none. */
function across({ indices }: Triangles, faces: Lists, slots: Int32Array, a: number, b: number, slot: number): number {
  const countAt = (vertex: number) => faces.begins[vertex + 1]! - faces.begins[vertex]!;
  const around = countAt(b) < countAt(a) ? b : a;
  const begin = faces.begins[around]!;
  const end = begin + Math.min(countAt(around), facesLookedAtMax);
  for (let at = begin; at < end; ++at) {
    const first = 3 * faces.entries[at]!;
    const corners = [indices[first]!, indices[first + 1]!, indices[first + 2]!];
    if (!corners.includes(a) || !corners.includes(b)) continue;
    const third = corners.find((corner) => corner !== a && corner !== b && slots[corner]! < slot);
    if (third !== undefined) return third;
  }
  return -1;
}

/** The order of a mesh whose indices are all below its vertex count; takes time and memory in proportion to it. */
export function makeMeshOrder(mesh: Triangles): MeshOrder {
  const { vertexCount, indices } = mesh;
  const faces = facesAtVertices(mesh);
  const neighbours = neighboursOf(mesh, faces);
  const vertices = breadthFirst(vertexCount, neighbours);
  const slots = new Int32Array(vertexCount);
  for (let slot = 0; slot < vertexCount; ++slot) slots[vertices[slot]!] = slot;

  const ringBegins = new Int32Array(vertexCount + 1);
  const rings = new Int32Array(neighbours.entries.length);
  const parents = new Int32Array(4 * vertexCount);
  const parallelograms = new Int32Array(6 * vertexCount);
  let ringEnd = 0;
  for (let slot = 0; slot < vertexCount; ++slot) {
    const vertex = vertices[slot]!;
    const before: number[] = [];
    for (let at = neighbours.begins[vertex]!; at < neighbours.begins[vertex + 1]!; ++at) {
      const neighbour = slots[neighbours.entries[at]!]!;
      rings[ringEnd++] = neighbour;
      if (neighbour < slot) before.push(neighbour + 1);
    }
    ringBegins[slot + 1] = ringEnd;
    before.sort((x, y) => y - x);
    const parentCount = Math.min(before.length, 4);
    for (let i = 0; i < 4 && parentCount > 0; ++i) parents[4 * slot + i] = before[i % parentCount]!;

    const own = parallelograms.subarray(6 * slot, 6 * slot + 6);
    own.set([parents[4 * slot]!, 0, parents[4 * slot + 1]!, 0, 0, 0]);
    let count = 0;
    for (let at = faces.begins[vertex]!; at < faces.begins[vertex + 1]! && count < 2; ++at) {
      const first = 3 * faces.entries[at]!;
      const corner = indices[first] === vertex ? 0 : indices[first + 1] === vertex ? 1 : 2;
      const a = indices[first + ((corner + 1) % 3)]!;
      const b = indices[first + ((corner + 2) % 3)]!;
      if (slots[a]! >= slot || slots[b]! >= slot) continue;
      const c = across(mesh, faces, slots, a, b, slot);
      if (c < 0) continue;
      for (let place = count; place < 2; ++place) {
        own[2 * place] = slots[a]! + 1;
        own[2 * place + 1] = slots[b]! + 1;
        own[4 + place] = slots[c]! + 1;
      }
      ++count;
    }
  }
  return { size: vertexCount, vertices, ringBegins, rings, parents, parallelograms };
}
