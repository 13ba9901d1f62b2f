// What takes an edit back: the changes that make a scene again what it was.
import { create, type MessageInitShape } from "@bufbuild/protobuf";
import { type Scene, type SceneChange, SceneChangeSchema } from "../src/index.js";

/** A change as it is written down, fields left out at their default. */
export type Change = MessageInitShape<typeof SceneChangeSchema>;

interface Named {
  readonly name: string;
}
type Fields = Record<string, unknown>;

// What a field that a scene leaves unset means, where it is not 0. A change can set a field but not unset it.
const unset: Fields = { massKg: 1, restScale: 1, temperatureK: 293.15, heatCapacityRatio: 1.4, rateHz: 60 };

// And of those where 0 is no value to set: REFUSE, MIDPOINT.
const zero: Fields = { onUnstable: 1, integrator: 2 };

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
    else if (Array.isArray(value)) fields[key] = held ?? [];
    else if (typeof value === "object" && value !== null && "case" in value) fields[key] = held;
    else if (typeof value === "object") fields[key] = previous(held as object | undefined, value as object);
    else if (key in zero) fields[key] = held || zero[key];
    else fields[key] = held ?? unset[key] ?? (typeof value === "boolean" ? false : 0);
  }
  return fields;
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
      const { removeGas, ...rest } = change.value;
      const back = previous(body, rest);
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
  return changes.flatMap((change) => inverseOfOne(scene, create(SceneChangeSchema, change))).reverse();
}
