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
  Points,
  PointsMaterial,
} from "three";
import type { Mesh as BodyMesh } from "../src/index.js";
import { type Bounds, BoundsView } from "./bounds_view.js";
import type { Scale } from "./legend.js";
import { segmentsOf, SmoothSkin } from "./smooth_skin.js";
import { Strain } from "./strain.js";
import { mirrorStudio } from "./studio.js";

// A velocity is drawn as the way that it goes in this time.
const velocityS = 0.1;
// Of what is closed, as rubber is; of a sheet, as cloth is.
const rubber = { specular: 0x4a4a4a, shininess: 70 };
const cloth = { specular: 0x0c0c0c, shininess: 8 };
const rubberMirrors = 0.6;

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

function isClosed(indices: Uint32Array): boolean {
  const open = new Set<string>();
  for (let corner = 0; corner < indices.length; ++corner) {
    const next = corner % 3 === 2 ? corner - 2 : corner + 1;
    if (!open.delete(`${indices[next]} ${indices[corner]}`)) open.add(`${indices[corner]} ${indices[next]}`);
  }
  return open.size === 0;
}

/** Frozen: it ran away and was stopped for good. */
export type Rest = "none" | "asleep" | "frozen";

const paperParts: Record<Rest, number> = { none: 0, asleep: 0.45, frozen: 0.75 };

export interface BodyShown {
  readonly wireframe: boolean;
  readonly points: boolean;
  readonly velocities: boolean;
  readonly bounds: Bounds;
}

export class SoftBodyView {
  readonly group = new Group();
  /** As the world has it. What is drawn is rounder, where there is a cover. */
  readonly skin: Mesh<BufferGeometry, MeshPhongMaterial>;
  /** Whether the skin has an inside. */
  readonly isClosed: boolean;
  private readonly smooth: SmoothSkin | undefined;
  private readonly cover: Mesh<BufferGeometry, MeshPhongMaterial> | undefined;
  private readonly edges: Mesh<BufferGeometry, MeshBasicMaterial>;
  private readonly arrows: LineSegments<BufferGeometry, LineBasicMaterial>;
  private readonly dots: Points<BufferGeometry, PointsMaterial>;
  private readonly bounds = new BoundsView();
  private readonly points: Float32Array;
  private readonly colours: BufferAttribute;
  private readonly strains: Float32Array;
  private strain: Strain | undefined;
  private readonly mirrors: number;
  private readonly normals: Float32Array;

  constructor(
    readonly name: string,
    readonly mesh: BodyMesh,
    private readonly colour: Color,
    isSmooth: boolean,
  ) {
    this.points = new Float32Array(3 * mesh.vertexCount);
    this.normals = new Float32Array(3 * mesh.vertexCount);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(this.points, 3));
    geometry.setAttribute("normal", new BufferAttribute(this.normals, 3));
    this.colours = new BufferAttribute(new Float32Array(3 * mesh.vertexCount), 3);
    this.strains = new Float32Array(mesh.vertexCount);
    geometry.setAttribute("color", this.colours);
    geometry.setIndex(new BufferAttribute(mesh.indices, 1));
    this.isClosed = isClosed(mesh.indices);
    const finish = this.isClosed ? rubber : cloth;
    this.skin = new Mesh(geometry, new MeshPhongMaterial({ color: colour, ...finish, side: DoubleSide }));
    this.mirrors = this.isClosed ? rubberMirrors : 0;
    if (this.isClosed) mirrorStudio(this.skin.material, this.mirrors);
    const segments = isSmooth ? segmentsOf(mesh.indices.length / 3) : 1;
    if (segments > 1) {
      this.smooth = new SmoothSkin(mesh.indices, mesh.vertexCount, segments);
      this.cover = new Mesh(this.smooth.geometry, this.skin.material);
      this.cover.frustumCulled = false;
      this.group.add(this.cover);
    }
    for (const part of [this.skin, this.cover]) if (part) part.castShadow = part.receiveShadow = true;
    this.edges = new Mesh(geometry, new MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.35 }));
    const ends = new BufferGeometry();
    ends.setAttribute("position", new BufferAttribute(new Float32Array(6 * mesh.vertexCount), 3));
    this.arrows = new LineSegments(ends, new LineBasicMaterial());
    this.dots = new Points(geometry, new PointsMaterial({ size: 4, sizeAttenuation: false }));
    for (const part of [this.skin, this.edges, this.arrows, this.dots]) {
      part.frustumCulled = false; // where they are changes with every frame
      this.group.add(part);
    }
    this.group.add(this.bounds.lines);
  }

  get vertexCount(): number {
    return this.mesh.vertexCount;
  }

  show({ wireframe, points, velocities, bounds }: BodyShown, ink: number): void {
    this.edges.visible = wireframe;
    // Marks are on the faces and vertices as they are.
    this.skin.visible = !this.cover || wireframe || points;
    if (this.cover) this.cover.visible = !this.skin.visible;
    this.dots.visible = points;
    this.arrows.visible = velocities;
    this.bounds.show(bounds, ink);
    for (const { material } of [this.edges, this.dots, this.arrows]) material.color.set(ink);
  }

  /** Moves the vertices to `fraction` of the way from one frame to the next. Velocities as they are at that moment, in m/s. */
  update(from: Float64Array, to: Float64Array, fraction: number, velocities: Float64Array | undefined): void {
    const { points } = this;
    for (let i = 0; i < points.length; ++i) points[i] = from[i]! + fraction * (to[i]! - from[i]!);
    computeNormals(this.mesh.indices, points, this.normals);
    this.skin.geometry.attributes["position"]!.needsUpdate = true;
    this.skin.geometry.attributes["normal"]!.needsUpdate = true;
    if (this.cover?.visible) this.smooth!.update(points, this.normals);
    this.bounds.update(points);
    this.strain ??= new Strain(this.mesh.indices, points);
    if (this.arrows.visible) this.updateArrows(velocities);
  }

  /** In its own colour; at rest, in one that is more like the paper. */
  paintPlain(paper: Color, rest: Rest): void {
    this.setVertexColours(false);
    this.skin.material.color.copy(this.colour).lerp(paper, paperParts[rest]);
  }

  /** In one colour for all of it, the one that `scale` has for a value. */
  paint(value: number, scale: Scale): void {
    this.setVertexColours(false);
    this.skin.material.color.setRGB(...scale.map.at((value - scale.low) / (scale.high - scale.low)));
  }

  /** Has strains measured against where the vertices are next. */
  rebase(): void {
    this.strain = undefined;
  }

  /** The largest strain, in size, against where its vertices were first. */
  computeStrain(): number {
    return this.strain?.compute(this.points, this.strains) ?? 0;
  }

  /** Each vertex by the strain that was computed last. */
  paintStrain({ map, low, high }: Scale): void {
    this.setVertexColours(true);
    this.skin.material.color.set(0xffffff);
    const colours = this.colours.array as Float32Array;
    this.strains.forEach((strain, vertex) => map.write((strain - low) / (high - low), colours, 3 * vertex));
    this.colours.needsUpdate = true;
    this.smooth?.paint(colours);
  }

  /** Of a place in the picture's list of vertices, in metres. */
  vertex(index: number): [number, number, number] {
    return [this.points[3 * index]!, this.points[3 * index + 1]!, this.points[3 * index + 2]!];
  }

  dispose(): void {
    for (const part of [this.skin, this.edges, this.arrows, this.dots]) {
      part.geometry.dispose();
      part.material.dispose();
    }
    this.smooth?.geometry.dispose();
    this.bounds.dispose();
  }

  private setVertexColours(isOn: boolean): void {
    const { material } = this.skin;
    if (material.vertexColors === isOn) return;
    material.vertexColors = isOn;
    material.reflectivity = isOn ? 0 : this.mirrors; // colours that say something are not to be mixed with light
    material.needsUpdate = true; // another shader
  }

  private updateArrows(velocities: Float64Array | undefined): void {
    const ends = this.arrows.geometry.attributes["position"] as BufferAttribute;
    for (let i = 0; i < this.points.length; ++i) {
      const at = 6 * Math.floor(i / 3) + (i % 3);
      ends.array[at] = this.points[i]!;
      ends.array[at + 3] = this.points[i]! + velocityS * (velocities?.[i] ?? 0);
    }
    ends.needsUpdate = true;
  }
}
