// Rigid bodies and colliders in the picture.
import {
  BackSide,
  BoxGeometry,
  BufferAttribute,
  Box3,
  BufferGeometry,
  CapsuleGeometry,
  DoubleSide,
  EdgesGeometry,
  FrontSide,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  Mesh,
  MeshPhongMaterial,
  PlaneGeometry,
  Quaternion,
  SphereGeometry,
  Vector3,
} from "three";
import type { Layout, SolidPose, SolidSurface } from "../src/index.js";

type Solid = Layout["solids"][number];

// A plane has no end; the picture fades out before this one has.
export const planeM = 2000;

// A room that turns is measured in so many of its positions.
const turnsSeen = 16;
// The margin that all else leaves is for its corners.
const sweptPart = 0.9;

function geometryOf({ shape, surface }: Solid): BufferGeometry | undefined {
  const form = shape?.shape;
  if (!form || form.case === undefined) return undefined;
  if (form.case === "sphere") return new SphereGeometry(form.value.radiusM, 48, 32);
  if (form.case === "capsule") return new CapsuleGeometry(form.value.radiusM, 2 * form.value.halfHeightM, 16, 32);
  if (form.case === "plane") {
    const { x = 0, y = 0, z = 0 } = form.value.normal ?? {};
    const normal = x === 0 && y === 0 && z === 0 ? new Vector3(0, 1, 0) : new Vector3(x, y, z).normalize();
    const turn = new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), normal);
    return new PlaneGeometry(planeM, planeM).applyQuaternion(turn);
  }
  if (form.case === "ellipsoid") {
    const { x = 0, y = 0, z = 0 } = form.value.radii ?? {};
    return new SphereGeometry(1, 48, 32).scale(x, y, z);
  }
  if (form.case === "mesh") return surface && meshGeometry(surface);
  const { x = 0, y = 0, z = 0 } = form.value.halfExtents ?? {};
  return new BoxGeometry(2 * x, 2 * y, 2 * z);
}

/** Each face flat, as it is met. */
function meshGeometry({ positions, indices }: SolidSurface): BufferGeometry {
  const shared = new BufferGeometry();
  shared.setAttribute("position", new BufferAttribute(positions, 3));
  shared.setIndex(new BufferAttribute(indices, 1));
  const geometry = shared.toNonIndexed();
  geometry.computeVertexNormals();
  shared.dispose();
  return geometry;
}

export class SolidView {
  private readonly turns: [Quaternion, Quaternion] = [new Quaternion(), new Quaternion()];

  private constructor(
    readonly name: string,
    readonly mesh: Mesh<BufferGeometry, MeshPhongMaterial>,
    readonly isBounded: boolean,
    /** A body that bulges everywhere: no room, plane or mesh of faces. */
    readonly isConvex: boolean,
    /** Of a room: its edges, for those of the walls that are seen through. */
    readonly outline: LineSegments<EdgesGeometry, LineBasicMaterial> | undefined,
  ) {
    if (outline) mesh.add(outline);
  }

  get isRoom(): boolean {
    return this.outline !== undefined;
  }

  /** Undefined for a shape that this page does not know. */
  static of(solid: Solid): SolidView | undefined {
    const geometry = geometryOf(solid);
    if (!geometry) return undefined;
    const form = solid.shape?.shape.case;
    // A room is seen from outside through its nearer walls; a mesh may be open.
    const side = form === "room" ? BackSide : form === "mesh" ? DoubleSide : FrontSide;
    const isGround = form === "plane"; // on which the sun's gleam would go with the eye
    const material = new MeshPhongMaterial({ side, shininess: 10, ...(isGround ? { specular: 0 } : {}) });
    const mesh = new Mesh(geometry, material);
    mesh.castShadow = form !== "room" && form !== "plane";
    mesh.receiveShadow = true;
    const outline =
      form === "room" ? new LineSegments(new EdgesGeometry(geometry), new LineBasicMaterial()) : undefined;
    const isConvex = form !== "room" && form !== "plane" && form !== "mesh";
    return new SolidView(solid.name, mesh, form !== "plane", isConvex, outline);
  }

  /** What a room takes up; one that turns, in all of its positions. */
  sweptBox(): Box3 {
    const { geometry, position, quaternion } = this.mesh;
    geometry.computeBoundingBox();
    const still = geometry.boundingBox!;
    const axis = new Vector3(quaternion.x, quaternion.y, quaternion.z);
    if (axis.length() === 0) return still.clone().translate(position);
    axis.normalize();
    const swept = new Box3();
    for (let i = 0; i < turnsSeen; ++i) {
      const turn = new Matrix4().makeRotationAxis(axis, (2 * Math.PI * i) / turnsSeen);
      swept.union(still.clone().applyMatrix4(turn));
    }
    swept.min.multiplyScalar(sweptPart);
    swept.max.multiplyScalar(sweptPart);
    return swept.union(still).translate(position);
  }

  update(from: SolidPose, to: SolidPose, fraction: number): void {
    const { position: p } = from;
    const { position: q } = to;
    this.mesh.position.set(p.x + fraction * (q.x - p.x), p.y + fraction * (q.y - p.y), p.z + fraction * (q.z - p.z));
    const [turn, next] = this.turns;
    setTurn(turn, from.orientation);
    setTurn(next, to.orientation);
    this.mesh.quaternion.copy(turn.slerp(next, fraction));
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
    this.outline?.geometry.dispose();
    this.outline?.material.dispose();
  }
}

function setTurn(turn: Quaternion, { x, y, z, w }: SolidPose["orientation"]): void {
  if (x === 0 && y === 0 && z === 0 && w === 0) turn.identity();
  else turn.set(x, y, z, w).normalize();
}
