// How far the edges of a skin are stretched, as a number for each vertex.

/** Of a mesh: its edges against the lengths that they had in the first places given. */
export class Strain {
  /** Two vertices an edge. */
  private readonly ends: Uint32Array;
  private readonly firstM: Float64Array;
  private readonly edgesAt: Uint32Array;

  /** @param points x y z of each vertex, in m */
  constructor(indices: Uint32Array, points: ArrayLike<number>) {
    const ends: number[] = [];
    const seen = new Set<number>();
    const count = points.length / 3;
    for (let corner = 0; corner < indices.length; ++corner) {
      const from = indices[corner]!;
      const to = indices[corner % 3 === 2 ? corner - 2 : corner + 1]!;
      const name = Math.min(from, to) * count + Math.max(from, to);
      if (!seen.has(name)) ends.push(from, to);
      seen.add(name);
    }
    this.ends = Uint32Array.from(ends);
    this.firstM = Float64Array.from({ length: ends.length / 2 }, (_, edge) => this.lengthM(edge, points));
    this.edgesAt = new Uint32Array(count);
    for (const vertex of ends) ++this.edgesAt[vertex]!;
  }

  /** Writes the mean of (length - first length) / first length over each vertex's edges; the largest in size is returned. */
  compute(points: ArrayLike<number>, strains: Float32Array): number {
    strains.fill(0);
    for (let edge = 0; edge < this.firstM.length; ++edge) {
      const first = this.firstM[edge]!;
      const strain = first > 0 ? this.lengthM(edge, points) / first - 1 : 0;
      strains[this.ends[2 * edge]!]! += strain;
      strains[this.ends[2 * edge + 1]!]! += strain;
    }
    let largest = 0;
    for (let vertex = 0; vertex < strains.length; ++vertex) {
      strains[vertex]! /= this.edgesAt[vertex]! || 1;
      largest = Math.max(largest, Math.abs(strains[vertex]!));
    }
    return largest;
  }

  private lengthM(edge: number, points: ArrayLike<number>): number {
    const a = 3 * this.ends[2 * edge]!;
    const b = 3 * this.ends[2 * edge + 1]!;
    return Math.hypot(points[b]! - points[a]!, points[b + 1]! - points[a + 1]!, points[b + 2]! - points[a + 2]!);
  }
}
