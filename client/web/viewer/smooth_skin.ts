// A skin that is round between its vertices: curved PN triangles (A. Vlachos et al., "Curved PN triangles", 2001). It goes
// through the vertices, so that what touches there is seen to touch, and has no gaps: an edge's curve is of its two ends.
import { BufferAttribute, BufferGeometry } from "three";

// Segments an edge is cut into, by how many faces there are to draw.
const segmentsFor = [
  { facesMax: 700, segments: 4 },
  { facesMax: 2000, segments: 3 },
  { facesMax: 8000, segments: 2 },
];

/** 1: it is drawn as it is. */
export function segmentsOf(faces: number): number {
  return segmentsFor.find(({ facesMax }) => faces <= facesMax)?.segments ?? 1;
}

/** A point of a face: its weights there, and those of the ten control points. */
interface Pattern {
  readonly corners: readonly [number, number, number];
  readonly bernstein: Float64Array;
}

function patternsOf(segments: number): Pattern[] {
  const patterns: Pattern[] = [];
  for (let i = 0; i <= segments; ++i) {
    for (let j = 0; i + j <= segments; ++j) {
      const [u, v] = [i / segments, j / segments];
      const w = 1 - u - v;
      const edges = [w * w * u, w * u * u, u * u * v, u * v * v, v * v * w, v * w * w].map((weight) => 3 * weight);
      const bernstein = Float64Array.from([w ** 3, u ** 3, v ** 3, ...edges, 6 * u * v * w]);
      patterns.push({ corners: [w, u, v], bernstein });
    }
  }
  return patterns;
}

export class SmoothSkin {
  readonly geometry = new BufferGeometry();
  private readonly patterns: readonly Pattern[];
  /** Of each face in turn: how many points are computed with it; of each of those, which one and by which pattern. */
  private readonly counts: Uint8Array;
  private readonly owned: Uint32Array;
  private readonly points: BufferAttribute;
  private readonly normals: BufferAttribute;
  private readonly colours: BufferAttribute;
  private readonly control = new Float64Array(30);

  /** @param segments 2 or more */
  constructor(
    private readonly indices: Uint32Array,
    vertexCount: number,
    segments: number,
  ) {
    this.patterns = patternsOf(segments);
    const places = this.patterns.map(({ corners }) => corners.map((weight) => Math.round(weight * segments)));
    const at = new Map(places.map(([, u, v], pattern) => [`${u} ${v}`, pattern]));
    const known = new Map<string, number>();
    const owned: number[] = [];
    const fine: number[] = [];
    let next = vertexCount;
    this.counts = new Uint8Array(indices.length / 3);
    for (let face = 0; face < this.counts.length; ++face) {
      const corners = [...indices.subarray(3 * face, 3 * face + 3)];
      const points = places.map((place, pattern) => {
        // What lies on an edge is shared: it is named by the edge's ends and how far it is from the first.
        const parts = corners.flatMap((corner, i) => (place[i]! > 0 ? [`${corner}:${place[i]}`] : [])).sort();
        if (parts.length === 1) return corners[place.findIndex((weight) => weight > 0)]!;
        const name = parts.length === 2 ? parts.join() : `${face}.${pattern}`;
        let point = known.get(name);
        if (point === undefined) {
          point = next++;
          known.set(name, point);
          owned.push(point, pattern);
          this.counts[face]!++;
        }
        return point;
      });
      const pointAt = (u: number, v: number) => points[at.get(`${u} ${v}`)!]!;
      for (let u = 0; u < segments; ++u) {
        for (let v = 0; u + v < segments; ++v) {
          fine.push(pointAt(u, v), pointAt(u + 1, v), pointAt(u, v + 1));
          if (u + v + 2 <= segments) fine.push(pointAt(u + 1, v), pointAt(u + 1, v + 1), pointAt(u, v + 1));
        }
      }
    }
    this.owned = Uint32Array.from(owned);
    const attribute = () => new BufferAttribute(new Float32Array(3 * next), 3);
    [this.points, this.normals, this.colours] = [attribute(), attribute(), attribute()];
    this.geometry.setAttribute("position", this.points);
    this.geometry.setAttribute("normal", this.normals);
    this.geometry.setAttribute("color", this.colours);
    this.geometry.setIndex(new BufferAttribute(Uint32Array.from(fine), 1));
  }

  /** Brings it to the vertices' places and unit normals. */
  update(points: Float32Array, normals: Float32Array): void {
    const out = this.points.array as Float32Array;
    out.set(points);
    this.forEachFace((face, begin, end) => {
      this.computeControl(face, points, normals);
      for (let own = begin; own < end; own += 2) {
        const { bernstein } = this.patterns[this.owned[own + 1]!]!;
        const target = 3 * this.owned[own]!;
        for (let axis = 0; axis < 3; ++axis) {
          let sum = 0;
          for (let i = 0; i < 10; ++i) sum += bernstein[i]! * this.control[3 * i + axis]!;
          out[target + axis] = sum;
        }
      }
    });
    this.points.needsUpdate = true;
    this.interpolate(normals, this.normals);
  }

  /** Colours of the vertices, and between them what lies between. */
  paint(colours: Float32Array): void {
    this.interpolate(colours, this.colours);
  }

  private interpolate(values: Float32Array, attribute: BufferAttribute): void {
    const out = attribute.array as Float32Array;
    out.set(values);
    this.forEachFace((face, begin, end) => {
      const [a, b, c] = [3 * this.indices[face]!, 3 * this.indices[face + 1]!, 3 * this.indices[face + 2]!];
      for (let own = begin; own < end; own += 2) {
        const [w, u, v] = this.patterns[this.owned[own + 1]!]!.corners;
        const target = 3 * this.owned[own]!;
        for (let axis = 0; axis < 3; ++axis) {
          out[target + axis] = w * values[a + axis]! + u * values[b + axis]! + v * values[c + axis]!;
        }
      }
    });
    attribute.needsUpdate = true;
  }

  private forEachFace(visit: (corner: number, begin: number, end: number) => void): void {
    let begin = 0;
    for (let face = 0; face < this.counts.length; ++face) {
      const end = begin + 2 * this.counts[face]!;
      if (end > begin) visit(3 * face, begin, end);
      begin = end;
    }
  }

  /** The corners, two points on each edge near the plane of its nearer end, and the middle: the paper's section 3.1. */
  private computeControl(face: number, points: Float32Array, normals: Float32Array): void {
    const { control } = this;
    const corners = [3 * this.indices[face]!, 3 * this.indices[face + 1]!, 3 * this.indices[face + 2]!];
    for (let i = 0; i < 3; ++i)
      for (let axis = 0; axis < 3; ++axis) control[3 * i + axis] = points[corners[i]! + axis]!;
    for (let edge = 0; edge < 6; ++edge) {
      const first = edge >> 1;
      const second = (first + 1) % 3;
      const [near, far] = edge & 1 ? [corners[second]!, corners[first]!] : [corners[first]!, corners[second]!];
      let above = 0;
      for (let axis = 0; axis < 3; ++axis)
        above += (points[far + axis]! - points[near + axis]!) * normals[near + axis]!;
      for (let axis = 0; axis < 3; ++axis) {
        const along = 2 * points[near + axis]! + points[far + axis]!;
        control[9 + 3 * edge + axis] = (along - above * normals[near + axis]!) / 3;
      }
    }
    for (let axis = 0; axis < 3; ++axis) {
      let edges = 0;
      for (let edge = 0; edge < 6; ++edge) edges += control[9 + 3 * edge + axis]!;
      const middle = (control[axis]! + control[3 + axis]! + control[6 + axis]!) / 3;
      control[27 + axis] = edges / 4 - middle / 2;
    }
  }
}
