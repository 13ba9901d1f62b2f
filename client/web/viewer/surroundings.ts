// Where things are in the picture, as far as what is put among them needs to know.
import { Box3, Matrix4, Plane, Quaternion, type Ray, Vector3 } from "three";
import type { Frame, Scene, Shape, SolidPose, SolidSurface } from "../src/index.js";

export interface Place {
  readonly name: string;
  readonly box: Box3;
  readonly vertices: number;
}

export interface Room {
  /** From the room's frame, whose axes are its edges, to the world's. */
  readonly pose: Matrix4;
  readonly halfExtents: Vector3;
}

const trialsMax = 120;

/** The soft bodies of a frame. */
export function places({ layout, positions }: Frame): Place[] {
  return layout.softBodies.map(({ name, mesh }, i) => {
    const box = new Box3().setFromArray(positions[i]!);
    return { name, box, vertices: mesh.vertexCount };
  });
}

/** Half the longest edge of the box around a body. */
export function radiusOf({ box }: Place): number {
  const size = box.getSize(new Vector3());
  return Math.max(size.x, size.y, size.z) / 2;
}

/** The first room that the world is in. */
export function roomOf({ layout, poses }: Frame): Room | undefined {
  for (const [i, { shape }] of layout.solids.entries()) {
    if (shape?.shape.case !== "room") continue;
    const { x = 0, y = 0, z = 0 } = shape.shape.value.halfExtents ?? {};
    return { pose: matrixOf(poses[i]!), halfExtents: new Vector3(x, y, z) };
  }
  return undefined;
}

function matrixOf({ position: p, orientation: q }: SolidPose): Matrix4 {
  const turn = new Quaternion(q.x, q.y, q.z, q.w);
  if (turn.lengthSq() === 0) turn.identity();
  return new Matrix4().compose(new Vector3(p.x, p.y, p.z), turn.normalize(), new Vector3(1, 1, 1));
}

/** What nothing is below. */
function groundsOf({ layout, poses }: Frame): Plane[] {
  return layout.solids.flatMap(({ shape }, i) => {
    if (shape?.shape.case !== "plane") return [];
    const { x = 0, y = 0, z = 0 } = shape.shape.value.normal ?? {};
    const normal = new Vector3(x, y, z);
    if (normal.lengthSq() === 0) normal.set(0, 1, 0);
    return [new Plane(normal.normalize()).applyMatrix4(matrixOf(poses[i]!))];
  });
}

/** The first point of the ray at which a ball of that radius is inside the room; its origin where it is already. */
export function insideFrom(ray: Ray, room: Room, radiusM: number): Vector3 {
  const local = ray.clone().applyMatrix4(room.pose.clone().invert());
  const half = room.halfExtents.clone().subScalar(1.2 * radiusM);
  const box = new Box3(half.clone().negate(), half);
  if (box.isEmpty()) return room.halfExtents.clone().setScalar(0).applyMatrix4(room.pose);
  const entry = box.containsPoint(local.origin) ? local.origin : local.intersectBox(box, new Vector3());
  return (entry ?? box.clampPoint(local.origin, new Vector3())).clone().applyMatrix4(room.pose);
}

/** Around the solids that have an end: how they are turned does not count. */
function solidBoxes({ layout, poses }: Frame): Box3[] {
  return layout.solids.flatMap(({ shape, surface }, i) => {
    const reach = surface ? reachOfSurface(surface) : shape ? reachOf(shape) : undefined;
    if (reach === undefined) return [];
    const { x, y, z } = poses[i]!.position;
    return [new Box3().setFromCenterAndSize(new Vector3(x, y, z), new Vector3().setScalar(2 * reach))];
  });
}

function reachOfSurface({ positions }: SolidSurface): number {
  let squared = 0;
  for (let i = 0; i < positions.length; i += 3) {
    squared = Math.max(squared, positions[i]! ** 2 + positions[i + 1]! ** 2 + positions[i + 2]! ** 2);
  }
  return Math.sqrt(squared);
}

/** How far a shape goes from its centre; undefined for what things are inside of, or on. */
function reachOf({ shape }: Shape): number | undefined {
  if (shape.case === "sphere") return shape.value.radiusM;
  if (shape.case === "capsule") return shape.value.radiusM + shape.value.halfHeightM;
  const extents =
    shape.case === "box" ? shape.value.halfExtents : shape.case === "ellipsoid" ? shape.value.radii : null;
  return extents ? Math.hypot(extents.x, extents.y, extents.z) : undefined;
}

/**
 * A place for something of that radius where nothing else is: near `wish` or above it, and within the room where there is
 * one. Where all is full, as far from other things as there is room.
 */
export function freePlace(frame: Frame, wish: Vector3, radiusM: number): Vector3 {
  const boxes = [...places(frame).map(({ box }) => box), ...solidBoxes(frame)];
  const grounds = groundsOf(frame);
  const room = roomOf(frame);
  let best = wish.clone();
  let bestM = -Infinity;
  for (let trial = 0; trial < trialsMax; ++trial) {
    const place = room ? withinRoom(room, radiusM, trial) : above(wish, radiusM, trial);
    const away = [
      ...boxes.map((box) => clearance(box, place)),
      ...grounds.map((ground) => ground.distanceToPoint(place)),
    ];
    const awayM = Math.min(radiusM, ...away);
    if (awayM > bestM) [best, bestM] = [place, awayM];
    if (bestM >= radiusM) break;
  }
  return best;
}

/** To the box; within it, less the deeper it is. */
function clearance(box: Box3, place: Vector3): number {
  const distance = box.distanceToPoint(place);
  return distance > 0 ? distance : box.getCenter(new Vector3()).distanceTo(place) - box.getSize(new Vector3()).length();
}

/** Up, and not quite straight: things that lie exactly on each other stay so. */
function above(wish: Vector3, radiusM: number, trial: number): Vector3 {
  const turn = 2.4 * trial; // the golden angle
  const aside = trial === 0 ? 0 : 0.15 * radiusM;
  return new Vector3(Math.cos(turn) * aside, 0.5 * radiusM * trial, Math.sin(turn) * aside).add(wish);
}

/** Evenly over the room: Halton's points of bases 2, 3 and 5, from the middle on. */
function withinRoom({ pose, halfExtents }: Room, radiusM: number, trial: number): Vector3 {
  const half = halfExtents.clone().subScalar(radiusM).clampScalar(0, Infinity);
  const point = new Vector3(halton(trial + 1, 2), halton(trial + 1, 3), halton(trial + 1, 5));
  if (trial === 0) point.setScalar(0.5);
  return point.multiplyScalar(2).subScalar(1).multiply(half).applyMatrix4(pose);
}

function halton(index: number, base: number): number {
  let [value, share] = [0, 1 / base];
  for (let rest = index; rest > 0; rest = Math.floor(rest / base)) {
    value += share * (rest % base);
    share /= base;
  }
  return value;
}

/** `base`, with the first number behind it that makes it a name of nothing in the scene. */
export function newName({ softBodies, rigidBodies, colliders, meshes }: Scene, base: string): string {
  const taken = new Set([...softBodies, ...rigidBodies, ...colliders, ...meshes].map(({ name }) => name));
  let number = 1;
  while (taken.has(`${base}-${number}`)) ++number;
  return `${base}-${number}`;
}
