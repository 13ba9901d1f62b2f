// Where a camera sees all of a box, from a little above and aside.
import { type Box3, type PerspectiveCamera, Vector3 } from "three";

export interface Framed {
  readonly centre: Vector3;
  readonly radiusM: number;
}

/**
 * Moves the camera there; it has to be turned to the centre yet.
 * @param part of the picture's height that is free for the box
 */
export function frame(camera: PerspectiveCamera, box: Box3, part: number): Framed {
  const centre = box.getCenter(new Vector3());
  const radiusM = Math.max(box.getSize(new Vector3()).length() / 2, 0.1);
  const farM = radiusM / Math.sin((camera.fov * Math.PI) / 360) / part;
  camera.position.copy(new Vector3(0.45, 0.35, 1).setLength(farM).add(centre));
  camera.near = farM / 200;
  camera.far = 20 * farM;
  camera.updateProjectionMatrix();
  return { centre, radiusM };
}
