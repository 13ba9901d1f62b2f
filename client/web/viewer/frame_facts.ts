// What frames alone tell of a body: of a recording, or of a world's past. The server measures only what is now.
import type { Frame, Scene, SoftBody } from "../src/index.js";
import { type Fact, factNames, placeText, quantityText, type Vector } from "./body_facts.js";
import type { Moment } from "./playback.js";

export interface Seen {
  readonly moment: Pick<Moment, "from" | "to" | "fraction">;
  readonly scene: Scene;
  /** Stands for what frames do not hold. */
  readonly absent: string;
}

// Further apart, two frames tell where a body was, but not how fast it is.
const speedSpanMaxS = 0.15;
const unknown = "–";

/** The frame that a moment shows. */
export function shownOf({ from, to, fraction }: Pick<Moment, "from" | "to" | "fraction">): Frame {
  return fraction < 1 ? from : to;
}

/** The mean of vectors x y z, each by its vertex's share of the mass; of a coarser mesh, where shares are not known, alike. */
function meanOf(vectors: Float64Array, { vertexMassScale }: Pick<SoftBody, "vertexMassScale">): Vector {
  const scales = 3 * vertexMassScale.length === vectors.length ? vertexMassScale : [];
  const sum = { x: 0, y: 0, z: 0 };
  let weights = 0;
  for (let vertex = 0; 3 * vertex < vectors.length; ++vertex) {
    const weight = scales[vertex] ?? 1;
    weights += weight;
    sum.x += weight * vectors[3 * vertex]!;
    sum.y += weight * vectors[3 * vertex + 1]!;
    sum.z += weight * vectors[3 * vertex + 2]!;
  }
  return { x: sum.x / weights, y: sum.y / weights, z: sum.z / weights };
}

/** Between two frames that follow each other; undefined: there are none, or too far apart. */
function speedBetween({ from, to }: Seen["moment"], placeIn: (frame: Frame) => Vector): number | undefined {
  const spanS = to.timeS - from.timeS;
  if (from.layout !== to.layout || !(spanS > 0 && spanS <= speedSpanMaxS)) return undefined;
  const [before, after] = [placeIn(from), placeIn(to)];
  return Math.hypot(after.x - before.x, after.y - before.y, after.z - before.z) / spanS;
}

function speedText(speed: number | undefined): string {
  return speed === undefined ? unknown : quantityText(speed, "m/s");
}

function softFacts(body: SoftBody, index: number, { moment, absent }: Seen): Fact[] {
  const frame = shownOf(moment);
  const { scalars } = frame;
  const velocities = frame.velocities?.[index];
  const velocity = velocities && meanOf(velocities, body);
  const speed = velocity
    ? Math.hypot(velocity.x, velocity.y, velocity.z)
    : speedBetween(moment, ({ positions }) => meanOf(positions[index]!, body));
  const scalar = (values: readonly number[] | undefined, unit: string) =>
    values?.[index] === undefined ? absent : quantityText(values[index], unit);
  const gas: Fact[] = [
    [factNames.gas, absent],
    [factNames.pressure, scalar(scalars?.pressurePa, "Pa")],
    [factNames.temperature, absent],
  ];
  return [
    [factNames.mass, quantityText(body.massKg || 1, "kg")],
    [factNames.volume, scalar(scalars?.volumeM3, "m³")],
    ...(body.gas ? gas : []),
    [factNames.place, placeText(meanOf(frame.positions[index]!, body))],
    [factNames.speed, speedText(speed)],
    [factNames.kinetic, scalar(scalars?.kineticJ, "J")],
    [factNames.elastic, scalar(scalars?.elasticJ, "J")],
    ...(body.gas ? ([[factNames.gasEnergy, absent]] as const) : []),
    [factNames.gravityEnergy, absent],
    [factNames.state, scalars ? (scalars.asleep[index] ? "asleep" : "awake") : absent],
  ];
}

/** What is known of a soft or rigid body at a moment, by the names that `factsOf` has; nothing of an obstacle. */
export function factsOfFrame(name: string, seen: Seen): readonly Fact[] {
  const { moment, scene, absent } = seen;
  const { layout, poses } = shownOf(moment);
  const soft = layout.softBodies.findIndex((body) => body.name === name);
  const softBody = scene.softBodies.find((body) => body.name === name);
  if (soft >= 0 && softBody) return softFacts(softBody, soft, seen);
  const solid = layout.solids.findIndex((body) => body.isDynamic && body.name === name);
  const rigidBody = scene.rigidBodies.find((body) => body.name === name);
  if (solid < 0 || !rigidBody) return [];
  return [
    [factNames.mass, quantityText(rigidBody.massKg || 1, "kg")],
    [factNames.place, placeText(poses[solid]!.position)],
    [factNames.speed, speedText(speedBetween(moment, (frame) => frame.poses[solid]!.position))],
    [factNames.state, absent],
  ];
}
