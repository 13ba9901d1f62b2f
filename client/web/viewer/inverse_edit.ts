// What takes an edit back: the changes that make a scene again what it was.
import { create, type MessageInitShape } from "@bufbuild/protobuf";
import {
  type Gas,
  Gas_Law,
  type Scene,
  type SceneChange,
  SceneChangeSchema,
  type SoftBody,
  type SoftBodyChange,
} from "../src/index.js";
import { meaningOfUnset } from "./unset.js";

/** A change as it is written down, fields left out at their default. */
export type Change = MessageInitShape<typeof SceneChangeSchema>;

interface Named {
  readonly name: string;
}
type Fields = Record<string, unknown>;

// Fields where 0 is no value to set.
const zero: Fields = { onUnstable: meaningOfUnset["onUnstable"], integrator: meaningOfUnset["integrator"] };

// What never bursts is told by no value: the largest number that a scene may have.
const neverBurstsPa = 1e12;
const unset: Fields = { ...meaningOfUnset, burstPressurePa: neverBurstsPa };

function find<Item extends Named>(items: readonly Item[], name: string): Item | undefined {
  return items.find((item) => item.name === name);
}

/** Of `now`, the fields that `change` sets; parts of parts alike. */
function previous(now: object | undefined, change: object): Fields {
  const fields: Fields = {};
  for (const [key, value] of Object.entries(change) as [string, unknown][]) {
    if (key.startsWith("$") || value === undefined || (Array.isArray(value) && value.length === 0)) continue;
    if (value === 0 && key in zero) continue;
    const held = (now as Fields | undefined)?.[key];
    if (key === "name") fields[key] = value;
    else if (key === "locked")
      fields[key] = held ?? {}; // is replaced as a whole
    else if (Array.isArray(value))
      fields[key] = (held as unknown[] | undefined)?.length ? held : value.map(() => 1); // of an empty one nothing is changed
    else if (typeof value === "object" && value !== null && "case" in value) fields[key] = held;
    else if (typeof value === "object") fields[key] = previous(held as object | undefined, value as object);
    else if (key in zero) fields[key] = held || zero[key];
    else fields[key] = held ?? unset[key] ?? (typeof value === "boolean" ? false : 0);
  }
  return fields;
}

/** Lists of a soft body that a change has as messages. */
function previousLists(body: SoftBody | undefined, change: Pick<SoftBodyChange, "pins" | "vertexMassScale">): Fields {
  const { pins: vertices = [], pinBoundary: boundary = false, vertexMassScale: scale = [] } = body ?? {};
  return {
    ...(change.pins ? { pins: { vertices, boundary } } : {}),
    ...(change.vertexMassScale ? { vertexMassScale: { scale } } : {}),
  };
}

function inverseOfOne(scene: Scene, { change }: SceneChange): Change[] {
  const one = (kind: string, value: unknown) => [{ change: { case: kind, value } } as Change];
  const restored = (kind: string, item: unknown) => (item === undefined ? [] : one(kind, item));
  switch (change.case) {
    case "addMesh":
      return one("removeMesh", change.value.name);
    case "addSoftBody":
      return one("removeSoftBody", change.value.name);
    case "addRigidBody":
      return one("removeRigidBody", change.value.name);
    case "addCollider":
      return one("removeCollider", change.value.name);
    case "addJoint":
      return one("removeJoint", change.value.name);
    case "removeJoint":
      return restored("addJoint", find(scene.joints, change.value));
    case "removeMesh":
      return restored("addMesh", find(scene.meshes, change.value));
    case "removeSoftBody":
      return restored("addSoftBody", find(scene.softBodies, change.value));
    case "removeRigidBody":
      return restored("addRigidBody", find(scene.rigidBodies, change.value));
    case "removeCollider":
      return restored("addCollider", find(scene.colliders, change.value));
    case "changeSoftBody": {
      const body = find(scene.softBodies, change.value.name);
      const { removeGas, pins: _, vertexMassScale: __, ...rest } = change.value;
      const back = { ...previous(body, rest), ...previousLists(body, change.value) };
      if (removeGas) return one(change.case, { ...back, gas: body?.gas });
      if (!rest.gas || body?.gas) return one(change.case, back);
      delete back["gas"];
      return one(change.case, { ...back, removeGas: true });
    }
    case "changeRigidBody":
      return one(change.case, previous(find(scene.rigidBodies, change.value.name), change.value));
    case "changeCollider":
      return one(change.case, previous(find(scene.colliders, change.value.name), change.value));
    case "setGravity":
      return one(change.case, scene.gravity ?? {});
    case "setAtmosphere":
      return one(change.case, scene.atmosphere ?? {});
    case "setWind":
      return one(change.case, scene.atmosphere?.wind ?? {});
    case "setStepping":
      return one(change.case, previous(scene.stepping, change.value));
    case undefined:
      return [];
  }
}

/** What makes of the scene that `changes` leave the one they found, up to fields that were unset and stay at their default. */
export function inverseOf(scene: Scene, changes: readonly Change[]): Change[] {
  return inverseOfSteps(joined([], scene, changes));
}

/** A change and what takes it back. */
export interface Step {
  readonly change: SceneChange;
  readonly inverse: readonly Change[];
}

/** Takes the steps back, the last first. */
export function inverseOfSteps(steps: readonly Step[]): Change[] {
  return [...steps].reverse().flatMap(({ inverse }) => inverse);
}

/**
 * `steps`, and `changes` that go on with them, as if they were made at once: what is changed again is changed to the last,
 * and goes back to where it was before the first.
 * @param scene what `changes` find
 */
export function joined(steps: readonly Step[], scene: Scene, changes: readonly Change[]): Step[] {
  const out = [...steps];
  for (const each of changes) {
    const change = create(SceneChangeSchema, each);
    const i = steps.findIndex((step) => isAgain(step.change, change));
    if (i >= 0) out[i] = { change: over(out[i]!.change, change), inverse: out[i]!.inverse };
    else out.push({ change, inverse: inverseOfOne(scene, change) });
  }
  return out;
}

/** Whether a hand that goes on does the same to the same thing: wind is a part of the air. */
function isAgain({ change: earlier }: SceneChange, { change: later }: SceneChange): boolean {
  if (earlier.case === "setAtmosphere" && later.case === "setWind") return true;
  const nameOf = ({ value }: SceneChange["change"]) =>
    typeof value === "object" && "name" in value ? value.name : value;
  if (earlier.case !== later.case) return false;
  return typeof nameOf(later) === "object" || nameOf(earlier) === nameOf(later);
}

function over({ change: earlier }: SceneChange, later: SceneChange): SceneChange {
  const { change } = later;
  if (earlier.case !== "setAtmosphere" || change.case !== "setWind") return later;
  const value = { ...earlier.value, wind: change.value };
  return create(SceneChangeSchema, { change: { case: "setAtmosphere", value } });
}

/** Whether the fields that `set` names are at their value in `now`. */
function has(now: object | undefined, set: object): boolean {
  return (
    now !== undefined && Object.entries(previous(now, set)).every(([key, held]) => same(held, (set as Fields)[key]))
  );
}

function hasLists(
  body: SoftBody,
  { pins, vertexMassScale }: Pick<SoftBodyChange, "pins" | "vertexMassScale">,
): boolean {
  const isList = (held: readonly number[], set: readonly number[]) => held.length === set.length && same(held, set);
  const hasPins = !pins || (isList(body.pins, pins.vertices) && body.pinBoundary === pins.boundary);
  return hasPins && (!vertexMassScale || isList(body.vertexMassScale, vertexMassScale.scale));
}

function same(held: unknown, set: unknown): boolean {
  if (set === undefined || (Array.isArray(set) && set.length === 0)) return true;
  if (typeof set !== "object" || set === null) return held === set;
  if (typeof held !== "object" || held === null) return false;
  if (Array.isArray(set) && (held as unknown[]).length !== set.length) return false;
  return Object.entries(set).every(([key, value]) => key.startsWith("$") || same((held as Fields)[key], value));
}

/** Gas that changes by itself. */
export function isLive(gas: Gas | undefined): boolean {
  return gas !== undefined && (!!gas.flowMolS || !!gas.leakMolSPa || gas.law === Gas_Law.ADIABATIC);
}

/** The soft bodies whose pump a change sets. */
export function pumpedBy(changes: readonly SceneChange[]): string[] {
  return changes.flatMap(({ change }) =>
    change.case === "changeSoftBody" && change.value.gas?.flowMolS !== undefined ? [change.value.name] : [],
  );
}

const nobody: ReadonlySet<string> = new Set();

/**
 * Whether the scene is still as `change` left it: of what is added whether it is the same thing; where things have moved to
 * does not count.
 * @param pumped the soft bodies whose gas a pump has changed since
 */
export function holds(scene: Scene, { change }: SceneChange, pumped = nobody): boolean {
  switch (change.case) {
    case "addMesh":
      return find(scene.meshes, change.value.name)?.shape.case === change.value.shape.case;
    case "addSoftBody": {
      const { name, mesh, position } = change.value;
      return has(find(scene.softBodies, name), { mesh, position });
    }
    case "addRigidBody": {
      const { name, shape, massKg } = change.value;
      return has(find(scene.rigidBodies, name), { shape, massKg });
    }
    case "addCollider":
      return has(find(scene.colliders, change.value.name), { shape: change.value.shape });
    case "addJoint":
      return find(scene.joints, change.value.name) !== undefined;
    case "removeJoint":
      return !find(scene.joints, change.value);
    case "removeMesh":
      return !find(scene.meshes, change.value);
    case "removeSoftBody":
      return !find(scene.softBodies, change.value);
    case "removeRigidBody":
      return !find(scene.rigidBodies, change.value);
    case "removeCollider":
      return !find(scene.colliders, change.value);
    case "changeSoftBody": {
      const body = find(scene.softBodies, change.value.name);
      const { removeGas, gas, pins: _, vertexMassScale: __, ...rest } = change.value;
      if (!has(body, rest) || !hasLists(body!, change.value)) return false;
      if (removeGas || !gas) return !removeGas || !body?.gas;
      const { moles, temperatureK, ...steady } = gas;
      const hasMoved = isLive(body?.gas) || pumped.has(change.value.name);
      return has(body?.gas, hasMoved ? steady : { moles, temperatureK, ...steady });
    }
    case "changeRigidBody": {
      const { name, massKg, surface, locked } = change.value;
      return has(find(scene.rigidBodies, name), { massKg, surface, locked });
    }
    case "changeCollider": {
      const { name, shape, surface } = change.value;
      return has(find(scene.colliders, name), { shape, surface });
    }
    case "setGravity":
      return has(scene.gravity ?? {}, change.value);
    case "setAtmosphere":
      return has(scene.atmosphere ?? {}, change.value);
    case "setWind":
      return has(scene.atmosphere?.wind ?? {}, change.value);
    case "setStepping":
      return has(scene.stepping ?? {}, change.value);
    case undefined:
      return false;
  }
}

/**
 * The steps that the scene is still as they left it. What was removed to begin anew is there again: what was added in its
 * place tells.
 */
export function heldOf(scene: Scene, steps: readonly Step[], pumped = nobody): Step[] {
  return steps.filter((step, i) => {
    const { change } = step.change;
    const addition = change.case?.replace("remove", "add");
    const again = steps.slice(i + 1).find(({ change: { change: later } }) => {
      const name = typeof later.value === "object" && "name" in later.value ? later.value.name : undefined;
      return later.case === addition && addition !== change.case && name === change.value;
    });
    return holds(scene, (again ?? step).change, pumped);
  });
}
