// The order in which a mesh's vertices are coded, from coarse to fine, and which of those coded before each is predicted
// from: proto/WIRE.md, "Order of the vertices".

/** The triangles of a mesh: three indices a face, each below `vertexCount`. */
export interface Triangles {
  readonly vertexCount: number;
  readonly indices: ArrayLike<number>;
}

/** Lists of numbers, one a key, in one array: entries[begins[key]] up to entries[begins[key + 1]]. */
export interface Lists {
  readonly begins: Int32Array;
  readonly entries: Int32Array;
}

/** By slot, the place of a vertex in the order. */
export interface MeshOrder {
  readonly size: number;
  /** The vertex of each slot. */
  readonly vertices: Int32Array;
  /** The slots of a slot's neighbours. */
  readonly rings: Lists;
  /**
   * The same as places in a field of x y z a slot: of the first six neighbours, or fewer and the slot itself repeated,
   * as a loop over their number takes longer.
   */
  readonly ringPlaces: Int32Array;
  /** And of a slot and each neighbour past its sixth, pair by pair; most slots have none. */
  readonly ringRests: Int32Array;
  /** The earlier slots that a slot is predicted from, one more of each: six a slot, of which the rest are 0. */
  readonly parents: Int32Array;
  /** 1 over how many there are. */
  readonly parentShares: Float64Array;
  /** Where runs of slots end of which none has a parent in its own run. */
  readonly runEnds: readonly number[];
}

const levelsMax = 12;
const coloursMax = 8;
const listMax = 16;
export const parentsMax = 6;
const ringPlacesASlot = 6;

/** A mesh's vertices, or some of them, and what is near each: by rank. */
interface Level {
  readonly vertices: Int32Array;
  readonly lists: Lists;
  readonly colours: Uint8Array;
}

/** The vertices that share a face with each vertex, lowest first. */
function neighboursOf({ vertexCount, indices }: Triangles): Lists {
  const ends = new Int32Array(vertexCount + 1);
  for (let corner = 0; corner < indices.length; ++corner) ends[indices[corner]! + 1]! += 2;
  for (let vertex = 0; vertex < vertexCount; ++vertex) ends[vertex + 1]! += ends[vertex]!;
  const all = new Int32Array(2 * indices.length);
  const next = ends.slice();
  for (let corner = 0; corner < indices.length; ++corner) {
    const first = corner - (corner % 3);
    const vertex = indices[corner]!;
    all[next[vertex]!++] = indices[first + ((corner + 1) % 3)]!;
    all[next[vertex]!++] = indices[first + ((corner + 2) % 3)]!;
  }
  const begins = new Int32Array(vertexCount + 1);
  let end = 0;
  for (let vertex = 0; vertex < vertexCount; ++vertex) {
    const begin = end;
    const sorted = all.subarray(ends[vertex], ends[vertex + 1]).sort();
    for (const other of sorted) {
      if (other !== vertex && (end === begin || all[end - 1] !== other)) all[end++] = other;
    }
    begins[vertex + 1] = end;
  }
  return { begins, entries: all.slice(0, end) };
}

/** The vertices in the order of their ranks: breadth first, from the lowest vertex of each part. */
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

/** The places of `order`, by what stands there. */
function inverse(order: Int32Array): Int32Array {
  const places = new Int32Array(order.length);
  for (let place = 0; place < order.length; ++place) places[order[place]!] = place;
  return places;
}

/** The lists with keys and entries renamed; those of `order[0]` come first. Entries ascend where `isSorted`. */
function renamed(lists: Lists, order: Int32Array, names: Int32Array, isSorted: boolean): Lists {
  const begins = new Int32Array(order.length + 1);
  const entries = new Int32Array(lists.entries.length);
  let end = 0;
  for (let place = 0; place < order.length; ++place) {
    const key = order[place]!;
    const begin = end;
    for (let at = lists.begins[key]!; at < lists.begins[key + 1]!; ++at) entries[end++] = names[lists.entries[at]!]!;
    if (isSorted) entries.subarray(begin, end).sort();
    begins[place + 1] = end;
  }
  return { begins, entries };
}

/** The least colour of each vertex that none of its list has, vertex by vertex. */
function coloursOf(vertices: Int32Array, { begins, entries }: Lists, rankCount: number): Uint8Array {
  const none = coloursMax;
  const colours = new Uint8Array(rankCount).fill(none);
  for (const vertex of vertices) {
    let taken = 0;
    for (let at = begins[vertex]!; at < begins[vertex + 1]!; ++at) taken |= 1 << colours[entries[at]!]!;
    let colour = 0;
    while (colour < coloursMax - 1 && (taken >> colour) & 1) ++colour;
    colours[vertex] = colour;
  }
  return colours;
}

/** The next coarser level: of the vertices of colour 0, those that are two steps apart are near each other. */
function coarser({ vertices, lists, colours }: Level): Level {
  const kept = vertices.filter((vertex) => colours[vertex] === 0);
  const { begins, entries } = lists;
  const nextBegins = new Int32Array(begins.length);
  const nextEntries = new Int32Array(listMax * kept.length);
  let end = 0;
  let keptSoFar = 0;
  for (let vertex = 0; vertex + 1 < begins.length; ++vertex) {
    const begin = end;
    if (kept[keptSoFar] === vertex) {
      ++keptSoFar;
      const lastNear = Math.min(begins[vertex + 1]!, begins[vertex]! + listMax);
      for (let at = begins[vertex]!; at < lastNear; ++at) {
        const near = entries[at]!;
        const last = Math.min(begins[near + 1]!, begins[near]! + listMax);
        for (let further = begins[near]!; further < last && end - begin < listMax; ++further) {
          const other = entries[further]!;
          if (colours[other] !== 0 || other === vertex) continue;
          if (!nextEntries.subarray(begin, end).includes(other)) nextEntries[end++] = other;
        }
      }
    }
    nextBegins[vertex + 1] = end;
  }
  const nextLists = { begins: nextBegins, entries: nextEntries.slice(0, end) };
  return { vertices: kept, lists: nextLists, colours: coloursOf(kept, nextLists, begins.length - 1) };
}

/** The rings as places in fields. */
function placesOf({ begins, entries }: Lists): Pick<MeshOrder, "ringPlaces" | "ringRests"> {
  const size = begins.length - 1;
  const ringPlaces = new Int32Array(ringPlacesASlot * size);
  const rests: number[] = [];
  for (let slot = 0; slot < size; ++slot) {
    const first = begins[slot]!;
    const end = begins[slot + 1]!;
    const rest = first + ringPlacesASlot;
    for (let i = 0; i < ringPlacesASlot; ++i) {
      ringPlaces[ringPlacesASlot * slot + i] = 3 * (first + i < end ? entries[first + i]! : slot);
    }
    for (let at = rest; at < end; ++at) rests.push(3 * slot, 3 * entries[at]!);
  }
  return { ringPlaces, ringRests: Int32Array.from(rests) };
}

/** The order of a mesh whose indices are all below its vertex count; takes time and memory in proportion to it. */
export function makeMeshOrder(mesh: Triangles): MeshOrder {
  const size = mesh.vertexCount;
  const neighbours = neighboursOf(mesh);
  const byRank = breadthFirst(size, neighbours);
  const lists = renamed(neighbours, byRank, inverse(byRank), true);
  const all = Int32Array.from({ length: size }, (_, rank) => rank);
  const levels: Level[] = [{ vertices: all, lists, colours: coloursOf(all, lists, size) }];
  while (levels.length < levelsMax && levels.at(-1)!.lists.entries.length > 0) levels.push(coarser(levels.at(-1)!));

  const ranks = new Int32Array(size); // of each slot
  const slots = new Int32Array(size).fill(size); // of each rank; not placed yet: past all
  const parents = new Int32Array(parentsMax * size);
  const parentCounts = new Uint8Array(size);
  const runEnds: number[] = [];
  let runBegin = 0;
  let slot = 0;
  for (let i = levels.length - 1; i >= 0; --i) {
    const { vertices, lists: near, colours } = levels[i]!;
    for (let colour = i === levels.length - 1 ? 0 : 1; colour < coloursMax; ++colour) {
      for (const rank of vertices) {
        if (colours[rank] !== colour) continue;
        let count = 0;
        let latest = -1;
        for (let at = near.begins[rank]!; at < near.begins[rank + 1]! && count < parentsMax; ++at) {
          const parent = slots[near.entries[at]!]!;
          if (parent >= slot) continue;
          parents[parentsMax * slot + count++] = parent + 1;
          latest = Math.max(latest, parent);
        }
        if (latest >= runBegin) {
          runEnds.push(slot);
          runBegin = slot;
        }
        parentCounts[slot] = count;
        ranks[slot] = rank;
        slots[rank] = slot++;
      }
    }
  }
  const rings = renamed(lists, ranks, slots, false);
  return {
    size,
    vertices: ranks.map((rank) => byRank[rank]!),
    rings,
    ...placesOf(rings),
    parents,
    parentShares: Float64Array.from(parentCounts, (count) => 1 / Math.max(count, 1)),
    runEnds: [...runEnds, size],
  };
}
