// The camera by the keyboard: arrows turn it about what it looks at, with Shift they move both; + and - go nearer and away.
import { Spherical, Vector3 } from "three";
import type { View } from "./address.js";

const turnRad = Math.PI / 24;
const movePart = 0.05; // of the distance to what it looks at
const nearerFactor = 0.9;
const up = new Vector3(0, 1, 0);
const arrows: Record<string, readonly [number, number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

/** Where an arrow goes, aside or upwards; undefined: the key is no arrow. */
export function wayOf({ position, target }: View, key: string): Vector3 | undefined {
  const arrow = arrows[key];
  if (!arrow) return undefined;
  const [right, upwards] = arrow;
  const away = position.clone().sub(target);
  const aside = up.clone().cross(away).normalize();
  return aside
    .multiplyScalar(right)
    .addScaledVector(up, upwards)
    .multiplyScalar(movePart * away.length());
}

/** The view after a key; undefined: the key is not about it. */
export function steered({ position, target }: View, key: string, isShift: boolean): View | undefined {
  const away = position.clone().sub(target);
  if (key === "+" || key === "=") return { position: away.multiplyScalar(nearerFactor).add(target), target };
  if (key === "-") return { position: away.divideScalar(nearerFactor).add(target), target };
  if (isShift) {
    const way = wayOf({ position, target }, key);
    return way && { position: position.clone().add(way), target: target.clone().add(way) };
  }
  const arrow = arrows[key];
  if (!arrow) return undefined;
  const [right, upwards] = arrow;
  const place = new Spherical().setFromVector3(away);
  place.theta += right * turnRad;
  place.phi -= upwards * turnRad;
  return { position: new Vector3().setFromSpherical(place.makeSafe()).add(target), target };
}
