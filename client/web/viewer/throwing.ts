// Throws a rigid ball from the eye to where the pointer points.
import { Ray, Vector3 } from "three";
import type { Frame, Scene } from "../src/index.js";
import type { Change } from "./inverse_edit.js";
import { insideFrom, places, radiusOf, roomOf } from "./surroundings.js";
import type { Wish } from "./world_edits.js";

const thrownMax = 12;
// From the eye to what it is thrown at.
const flightS = 0.45;
// Of the soft bodies' means.
const radiusShare = 0.3;
const massShare = 0.5;
const withoutBodies = { radiusM: 0.1, massKg: 1 };

const prefix = "thrown-";

export interface Throw extends Wish {
  readonly name: string;
}

/** A ball that flies from `eye` to `target`, and out of the world with the oldest where there are too many. */
export function throwAt(scene: Scene, frame: Frame, eye: Vector3, target: Vector3): Throw {
  const { radiusM, massKg } = sizeFor(scene, frame);
  const towards = target.clone().sub(eye).normalize();
  const room = roomOf(frame);
  const from = room
    ? insideFrom(new Ray(eye, towards), room, radiusM)
    : eye.clone().addScaledVector(towards, 2 * radiusM);
  const { x = 0, y = 0, z = 0 } = scene.gravity ?? {};
  // So that gravity takes it to the target, not below it.
  const velocity = target
    .clone()
    .sub(from)
    .divideScalar(flightS)
    .addScaledVector(new Vector3(x, y, z), -flightS / 2);
  const thrown = scene.rigidBodies.filter(({ name }) => name.startsWith(prefix));
  const last = Math.max(0, ...thrown.map(({ name }) => Number(name.slice(prefix.length)) || 0));
  const name = `${prefix}${last + 1}`;
  const gone = thrown.slice(0, Math.max(0, thrown.length + 1 - thrownMax));
  return {
    name,
    says: `Throw ${name}`,
    changes: [
      ...gone.map(({ name }): Change => ({ change: { case: "removeRigidBody", value: name } })),
      {
        change: {
          case: "addRigidBody",
          value: {
            name,
            shape: { shape: { case: "sphere", value: { radiusM } } },
            massKg,
            position: { x: from.x, y: from.y, z: from.z },
            velocity: { x: velocity.x, y: velocity.y, z: velocity.z },
            surface: { restitution: 0.4, friction: 0.5 },
          },
        },
      },
    ],
  };
}

function sizeFor({ softBodies }: Scene, frame: Frame): typeof withoutBodies {
  const radii = places(frame).map(radiusOf);
  if (radii.length === 0 || softBodies.length === 0) return withoutBodies;
  const radiusM = (radiusShare * radii.reduce((sum, radius) => sum + radius, 0)) / radii.length;
  const massKg = (massShare * softBodies.reduce((sum, body) => sum + (body.massKg ?? 1), 0)) / softBodies.length;
  return { radiusM, massKg };
}
