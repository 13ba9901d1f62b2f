// A soft body's skin in the picture: shaded, with its edges and the velocities of its vertices where wanted.
import {
  BufferAttribute,
  BufferGeometry,
  type Color,
  DoubleSide,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  MeshPhongMaterial,
} from "three";
import type { Mesh as BodyMesh } from "../src/index.js";

// A velocity is drawn as the way that it goes in this time.
const velocityS = 0.1;

/** Writes the unit normal of each vertex, the mean of its faces' by area. */
export function computeNormals(indices: Uint32Array, points: Float32Array, normals: Float32Array): void {
  normals.fill(0);
  for (let corner = 0; corner < indices.length; corner += 3) {
    const a = 3 * indices[corner]!;
    const b = 3 * indices[corner + 1]!;
    const c = 3 * indices[corner + 2]!;
    const abX = points[b]! - points[a]!;
    const abY = points[b + 1]! - points[a + 1]!;
    const abZ = points[b + 2]! - points[a + 2]!;
    const acX = points[c]! - points[a]!;
    const acY = points[c + 1]! - points[a + 1]!;
    const acZ = points[c + 2]! - points[a + 2]!;
    const x = abY * acZ - abZ * acY;
    const y = abZ * acX - abX * acZ;
    const z = abX * acY - abY * acX;
    for (const vertex of [a, b, c]) {
      normals[vertex]! += x;
      normals[vertex + 1]! += y;
      normals[vertex + 2]! += z;
    }
  }
  for (let i = 0; i < normals.length; i += 3) {
    const length = Math.hypot(normals[i]!, normals[i + 1]!, normals[i + 2]!) || 1;
    normals[i]! /= length;
    normals[i + 1]! /= length;
    normals[i + 2]! /= length;
  }
}

export class SoftBodyView {
  readonly group = new Group();
  readonly skin: Mesh<BufferGeometry, MeshPhongMaterial>;
  private readonly edges: Mesh<BufferGeometry, MeshBasicMaterial>;
  private readonly arrows: LineSegments<BufferGeometry, LineBasicMaterial>;
  private readonly points: Float32Array;
  private readonly normals: Float32Array;

  constructor(
    readonly name: string,
    private readonly mesh: BodyMesh,
    colour: Color,
  ) {
    this.points = new Float32Array(3 * mesh.vertexCount);
    this.normals = new Float32Array(3 * mesh.vertexCount);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(this.points, 3));
    geometry.setAttribute("normal", new BufferAttribute(this.normals, 3));
    geometry.setIndex(new BufferAttribute(mesh.indices, 1));
    this.skin = new Mesh(geometry, new MeshPhongMaterial({ color: colour, shininess: 50, side: DoubleSide }));
    this.skin.castShadow = true;
    this.skin.receiveShadow = true;
    this.edges = new Mesh(geometry, new MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.35 }));
    const ends = new BufferGeometry();
    ends.setAttribute("position", new BufferAttribute(new Float32Array(6 * mesh.vertexCount), 3));
    this.arrows = new LineSegments(ends, new LineBasicMaterial());
    for (const part of [this.skin, this.edges, this.arrows]) {
      part.frustumCulled = false; // where they are changes with every frame
      this.group.add(part);
    }
  }

  show(edges: boolean, velocities: boolean, ink: number): void {
    this.edges.visible = edges;
    this.arrows.visible = velocities;
    this.edges.material.color.set(ink);
    this.arrows.material.color.set(ink);
  }

  /** Moves the vertices to `fraction` of the way from one frame to the next, which is `spanS` later. */
  update(from: Float64Array, to: Float64Array, fraction: number, spanS: number): void {
    const { points } = this;
    for (let i = 0; i < points.length; ++i) points[i] = from[i]! + fraction * (to[i]! - from[i]!);
    computeNormals(this.mesh.indices, points, this.normals);
    this.skin.geometry.attributes["position"]!.needsUpdate = true;
    this.skin.geometry.attributes["normal"]!.needsUpdate = true;
    if (this.arrows.visible) this.updateArrows(from, to, spanS);
  }

  /** Of a place in the picture's list of vertices, in metres. */
  vertex(index: number): [number, number, number] {
    return [this.points[3 * index]!, this.points[3 * index + 1]!, this.points[3 * index + 2]!];
  }

  dispose(): void {
    for (const part of [this.skin, this.edges, this.arrows]) {
      part.geometry.dispose();
      part.material.dispose();
    }
  }

  private updateArrows(from: Float64Array, to: Float64Array, spanS: number): void {
    const ends = this.arrows.geometry.attributes["position"] as BufferAttribute;
    const scale = spanS > 0 ? velocityS / spanS : 0;
    for (let i = 0; i < this.points.length; ++i) {
      const at = 6 * Math.floor(i / 3) + (i % 3);
      ends.array[at] = this.points[i]!;
      ends.array[at + 3] = this.points[i]! + scale * (to[i]! - from[i]!);
    }
    ends.needsUpdate = true;
  }
}
