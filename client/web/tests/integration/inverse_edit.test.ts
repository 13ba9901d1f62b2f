// An edit and then its inverse leave a scene as it was: for each kind of change, on a real server, in a world that rests.
import { create } from "@bufbuild/protobuf";
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { Client, type Scene, SceneChangeSchema, Stepping_OnUnstable } from "../../src/index.js";
import { type Change, holds, inverseOf } from "../../viewer/inverse_edit.js";
import { Server } from "../server.js";

const world = "w";

let server: Server;
let client: Client;

before(async () => {
  server = await Server.start([]);
  client = await Client.connect(server.url);
  const scene = {
    name: "all-kinds",
    gravity: { y: -9.81 },
    stepping: { substeps: 32, onUnstable: "REFUSE" },
    meshes: [
      { name: "ball", icosphere: { subdivisions: 1, radiusM: 0.5 } },
      { name: "unused", box: { halfExtents: { x: 1, y: 1, z: 1 } } },
    ],
    softBodies: [
      {
        name: "full",
        mesh: "ball",
        position: { x: 1 },
        springs: { stiffnessNM: 50, dampingNSM: 0.01 },
        gas: { moles: 0.01 },
      },
      { name: "empty", mesh: "ball", position: { x: -1 }, springs: { stiffnessNM: 50 }, massKg: 2 },
    ],
    rigidBodies: [
      { name: "stone", massKg: 1, shape: { sphere: { radiusM: 0.1 } }, position: { y: 2 }, velocity: { x: 1 } },
    ],
    colliders: [{ name: "floor", shape: { plane: {} }, position: { y: -2 }, surface: { friction: 0.5 } }],
  };
  const value = JSON.stringify(scene);
  await client.createWorld({ name: world, source: { case: "sceneJson", value }, paused: true });
});
after(async () => {
  client.close();
  await server.kill();
});

const changes: Record<string, NonNullable<Change["change"]>> = {
  "a mesh more": { case: "addMesh", value: { name: "new", shape: { case: "icosphere", value: { subdivisions: 1 } } } },
  "a soft body more": { case: "addSoftBody", value: { name: "new", mesh: "ball", springs: { stiffnessNM: 10 } } },
  "a rigid body more": {
    case: "addRigidBody",
    value: { name: "new", shape: { shape: { case: "sphere", value: { radiusM: 1 } } } },
  },
  "a collider more": { case: "addCollider", value: { name: "new", shape: { shape: { case: "plane", value: {} } } } },
  "a mesh less": { case: "removeMesh", value: "unused" },
  "a soft body less": { case: "removeSoftBody", value: "full" },
  "a rigid body less": { case: "removeRigidBody", value: "stone" },
  "a collider less": { case: "removeCollider", value: "floor" },
  "other springs": { case: "changeSoftBody", value: { name: "full", springs: { stiffnessNM: 60, dampingNSM: 0.02 } } },
  "more gas": { case: "changeSoftBody", value: { name: "full", gas: { moles: 0.02 } } },
  "gas where there was none": { case: "changeSoftBody", value: { name: "empty", gas: { moles: 0.02 } } },
  "no gas where there was some": { case: "changeSoftBody", value: { name: "full", removeGas: true } },
  "another mass": { case: "changeSoftBody", value: { name: "empty", massKg: 3 } },
  "a heavier stone elsewhere": {
    case: "changeRigidBody",
    value: { name: "stone", massKg: 2, position: { y: 5 }, velocity: { z: 1 } },
  },
  "another floor": {
    case: "changeCollider",
    value: { name: "floor", position: { y: -3 }, surface: { friction: 0.1 } },
  },
  "another gravity": { case: "setGravity", value: { x: 1 } },
  wind: { case: "setWind", value: { x: 3 } },
  air: { case: "setAtmosphere", value: { densityKgM3: 1.2, wind: { y: 1 } } },
  "more substeps": { case: "setStepping", value: { substeps: 40 } },
  "as many substeps as it takes": { case: "setStepping", value: { onUnstable: Stepping_OnUnstable.SUBSTEP } },
};

/** By name: what is put back is at the end of its list. */
function inOrder({ atmosphere, meshes, softBodies, rigidBodies, colliders, ...rest }: Scene): unknown {
  const byName = <Item extends { name: string }>(items: readonly Item[]) =>
    [...items].sort((a, b) => a.name.localeCompare(b.name));
  // No air and air of no density, or at rest, are the same.
  const { pressurePa = 0, densityKgM3 = 0, wind } = atmosphere ?? {};
  return {
    ...rest,
    air: [pressurePa, densityKgM3, wind?.x ?? 0, wind?.y ?? 0, wind?.z ?? 0],
    lists: [byName(meshes), byName(softBodies), byName(rigidBodies), byName(colliders)],
  };
}

for (const [what, change] of Object.entries(changes)) {
  test(`back from ${what}`, async () => {
    const before = await client.scene(world);
    const there: Change[] = [{ change }];
    const step = create(SceneChangeSchema, { change });
    assert.ok(!holds(before, step));
    await client.edit(world, { changes: there });
    const after = await client.scene(world);
    assert.notDeepEqual(inOrder(after), inOrder(before));
    assert.ok(holds(after, step));
    await client.edit(world, { changes: inverseOf(before, there) });
    assert.deepEqual(inOrder(await client.scene(world)), inOrder(before));
  });
}

test("several changes are taken back from the last to the first", async () => {
  const before = await client.scene(world);
  const there: Change[] = [
    { change: { case: "addMesh", value: { name: "own", shape: { case: "icosphere", value: { subdivisions: 1 } } } } },
    { change: { case: "addSoftBody", value: { name: "body", mesh: "own", springs: { stiffnessNM: 10 } } } },
  ];
  await client.edit(world, { changes: there });
  await client.edit(world, { changes: inverseOf(before, there) });
  assert.deepEqual(inOrder(await client.scene(world)), inOrder(before));
});

test("a burst pressure is taken back by one that no gas comes to", async () => {
  const before = await client.scene(world);
  const there: Change[] = [
    {
      change: {
        case: "changeSoftBody",
        value: { name: "full", gas: { burstPressurePa: 5000 } },
      },
    },
  ];
  const burstPressurePa = async () => {
    const { softBodies } = await client.scene(world);
    return softBodies.find(({ name }) => name === "full")?.gas?.burstPressurePa;
  };
  await client.edit(world, { changes: there });
  assert.equal(await burstPressurePa(), 5000);
  await client.edit(world, { changes: inverseOf(before, there) });
  assert.equal(await burstPressurePa(), 1e12);
});
