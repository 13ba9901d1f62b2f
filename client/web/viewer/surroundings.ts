// Where things are in the picture, as far as what is put among them needs to know.
import { Box3, Matrix4, Quaternion, type Ray, Vector3 } from "three";
import type { Frame, Scene } from "../src/index.js";

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
    const { position: p, orientation: q } = poses[i]!;
    const turn = new Quaternion(q.x, q.y, q.z, q.w);
    if (turn.lengthSq() === 0) turn.identity();
    const pose = new Matrix4().compose(new Vector3(p.x, p.y, p.z), turn.normalize(), new Vector3(1, 1, 1));
    return { pose, halfExtents: new Vector3(x, y, z) };
  }
  return undefined;
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

/** A place for something of that radius near `wish` where no soft body is; in the room, where there is one. */
export function freePlace(frame: Frame, wish: Vector3, radiusM: number): Vector3 {
  const taken = places(frame).map((place) => ({ centre: place.box.getCenter(new Vector3()), radius: radiusOf(place) }));
  const room = roomOf(frame);
  const limit = room?.halfExtents.clone().subScalar(radiusM).clampScalar(0, Infinity);
  let place = wish.clone();
  for (let trial = 0; trial < 60; ++trial) {
    // Up a spiral; within a room, which has a ceiling, through all of it.
    const turn = 2.4 * trial; // the golden angle
    const away = trial === 0 ? 0 : radiusM * (1 + 0.1 * trial);
    place = new Vector3(Math.cos(turn) * away, room ? 0 : 0.25 * radiusM * trial, Math.sin(turn) * away).add(wish);
    if (room && limit) {
      const height = trial % 3 === 0 ? 0 : (trial % 3 === 1 ? 0.5 : -0.5) * limit.y;
      const inside = new Vector3(Math.cos(turn) * limit.x, height, Math.sin(turn) * limit.z);
      place = inside.multiplyScalar(Math.min(1, trial / 20)).applyMatrix4(room.pose);
    }
    if (taken.every(({ centre, radius }) => centre.distanceTo(place) > radius + radiusM)) break;
  }
  return place;
}

/** `base`, with the first number behind it that makes it a name of nothing in the scene. */
export function newName({ softBodies, rigidBodies, colliders, meshes }: Scene, base: string): string {
  const taken = new Set([...softBodies, ...rigidBodies, ...colliders, ...meshes].map(({ name }) => name));
  let number = 1;
  while (taken.has(`${base}-${number}`)) ++number;
  return `${base}-${number}`;
}
