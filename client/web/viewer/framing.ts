// Where a camera sees all of a box, as large as there is room for it.
import { type Box3, type PerspectiveCamera, Vector3 } from "three";

export interface Framed {
  readonly box: Box3;
  readonly centre: Vector3;
  readonly radiusM: number;
}

/** What a box may take, in heights of the picture. */
export interface Room {
  readonly width: number;
  readonly height: number;
}

/** From a little above and aside. */
export const usualWay: Readonly<Vector3> = new Vector3(0.45, 0.35, 1).normalize();

/** How far from the box's centre, along `way`, all of its corners are seen within `room`. */
export function distanceFor(box: Box3, way: Readonly<Vector3>, fovDegrees: number, room: Room): number {
  const centre = box.getCenter(new Vector3());
  const right = new Vector3(0, 1, 0).cross(way).normalize();
  const up = new Vector3().crossVectors(way, right);
  const slope = 2 * Math.tan((fovDegrees * Math.PI) / 360);
  let farM = 0;
  for (let i = 0; i < 8; ++i) {
    const x = i & 1 ? box.max.x : box.min.x;
    const y = i & 2 ? box.max.y : box.min.y;
    const z = i & 4 ? box.max.z : box.min.z;
    const corner = new Vector3(x, y, z).sub(centre);
    // Its offset from the axis over its depth is at most the half of what is free.
    const across = Math.max(
      (2 * Math.abs(corner.dot(right))) / (room.width * slope),
      (2 * Math.abs(corner.dot(up))) / (room.height * slope),
    );
    farM = Math.max(farM, across + corner.dot(way));
  }
  return farM;
}

/** Moves the camera there, looking along `way`; it has to be turned to the centre yet. */
export function frame(camera: PerspectiveCamera, box: Box3, room: Room, way = usualWay): Framed {
  const centre = box.getCenter(new Vector3());
  const radiusM = Math.max(box.getSize(new Vector3()).length() / 2, 0.1);
  const farM = Math.max(distanceFor(box, way, camera.fov, room), 1.05 * radiusM);
  camera.position.copy(centre).addScaledVector(way, farM);
  camera.near = farM / 200;
  camera.far = 40 * farM;
  camera.updateProjectionMatrix();
  return { box: box.clone(), centre, radiusM };
}
