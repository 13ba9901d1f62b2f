// How much of a picture a subject takes: the corners of its box, projected as the camera does it.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Box3, PerspectiveCamera, Vector3 } from "three";
import type { Layout, SolidPose } from "../../src/index.js";
import { frame, usualWay } from "../../viewer/framing.js";
import { SolidView } from "../../viewer/solid_view.js";

/** The largest distance of a corner from the middle, in half pictures. */
function reach(box: Box3, camera: PerspectiveCamera): { x: number; y: number } {
  camera.lookAt(box.getCenter(new Vector3()));
  camera.updateMatrixWorld();
  const most = { x: 0, y: 0 };
  for (let i = 0; i < 8; ++i) {
    const corner = new Vector3(
      i & 1 ? box.max.x : box.min.x,
      i & 2 ? box.max.y : box.min.y,
      i & 4 ? box.max.z : box.min.z,
    ).project(camera);
    most.x = Math.max(most.x, Math.abs(corner.x));
    most.y = Math.max(most.y, Math.abs(corner.y));
  }
  return most;
}

test("whatever the world, it takes two thirds of the height, or the width that there is", () => {
  for (const size of [
    new Vector3(1, 1, 1),
    new Vector3(30, 30, 30),
    new Vector3(0.1, 4, 0.1),
    new Vector3(6, 0.5, 1),
  ]) {
    const box = new Box3().setFromCenterAndSize(new Vector3(3, -2, 5), size);
    const camera = new PerspectiveCamera(45, 1.6);
    frame(camera, box, { width: 1.6 * 0.9, height: 2 / 3 });
    const { x, y } = reach(box, camera);
    assert.ok(x < 0.9 + 1e-6 && y < 2 / 3 + 1e-6, `${x} ${y}`);
    assert.ok(Math.abs(x - 0.9) < 1e-6 || Math.abs(y - 2 / 3) < 1e-6, `${x} ${y}`);
  }
});

test("a room that turns takes what its corners come by, less a tenth, and one that stands its own size", () => {
  const shape = { shape: { case: "room", value: { halfExtents: { x: 1, y: 1, z: 3 } } } };
  const room = SolidView.of({ name: "drum", shape, isDynamic: false } as unknown as Layout["solids"][number])!;
  const pose = (orientation: object) => ({ position: { x: 5, y: 0, z: 0 }, orientation }) as unknown as SolidPose;
  const still = pose({ x: 0, y: 0, z: 0, w: 1 });
  room.update(still, still, 1);
  assert.deepEqual(room.sweptBox().max.toArray(), [6, 1, 3]);
  const turned = pose({ x: 0, y: 0, z: 0.1, w: 0.995 });
  room.update(turned, turned, 1);
  const { min, max } = room.sweptBox();
  const reach = 0.9 * Math.SQRT2;
  [5 + reach, reach, 3].forEach((wanted, i) => assert.ok(Math.abs(max.toArray()[i]! - wanted) < 1e-6, `${wanted}`));
  [5 - reach, -reach, -3].forEach((wanted, i) => assert.ok(Math.abs(min.toArray()[i]! - wanted) < 1e-6, `${wanted}`));
});

test("the way from which it is looked at stays", () => {
  const box = new Box3(new Vector3(-1, -1, -1), new Vector3(1, 1, 1));
  const camera = new PerspectiveCamera(45, 1);
  const way = new Vector3(-1, 0.2, 0.3).normalize();
  frame(camera, box, { width: 1, height: 1 }, way);
  assert.ok(camera.position.clone().normalize().distanceTo(way) < 1e-9);
  frame(camera, box, { width: 1, height: 1 });
  assert.ok(camera.position.clone().normalize().distanceTo(usualWay) < 1e-9);
});
