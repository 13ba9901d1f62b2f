// The deeds of a page: what is asked of which world, what takes it back, and what is left alone. The server is a fake whose
// scene is gravity, wind, rigid bodies and the gas of a ball.
import { clone, create } from "@bufbuild/protobuf";
import assert from "node:assert/strict";
import { test } from "node:test";
import { type Done, PneumaError, type Scene, SceneSchema } from "../../src/index.js";
import { DoneSchema } from "../../proto/pneuma/v1/session_pb.js";
import type { Change } from "../../viewer/inverse_edit.js";
import { type Wish, WorldEdits } from "../../viewer/world_edits.js";

class FakeClient {
  readonly worlds = new Map<string, Scene>();
  /** The kinds of each edit's changes, and the world it was asked of. */
  readonly edits: [string, ...unknown[]][] = [];
  reads = 0;
  /** Thrown by the next edit. */
  refusal: PneumaError | undefined;
  /** The next reply waits for it. */
  pause: Promise<void> | undefined;

  constructor(...names: string[]) {
    for (const name of names) this.worlds.set(name, create(SceneSchema, { gravity: { y: -9.8 } }));
  }

  async scene(world: string): Promise<Scene> {
    ++this.reads;
    await this.paused();
    return clone(SceneSchema, this.worlds.get(world)!);
  }

  async edit(world: string, { changes = [] }: { changes?: readonly Change[] }): Promise<Done> {
    await this.paused();
    const { refusal } = this;
    this.refusal = undefined;
    if (refusal) throw refusal;
    this.edits.push([world, ...changes.map(({ change }) => change?.case)]);
    const scene = this.worlds.get(world)!;
    for (const each of changes) apply(scene, each);
    return create(DoneSchema, { tick: BigInt(this.edits.length) });
  }

  private async paused(): Promise<void> {
    const { pause } = this;
    this.pause = undefined;
    await pause;
  }
}

function apply(scene: Scene, { change }: Change): void {
  if (change?.case === "setGravity") scene.gravity = create(SceneSchema, { gravity: change.value }).gravity!;
  if (change?.case === "setAtmosphere")
    scene.atmosphere = create(SceneSchema, { atmosphere: change.value }).atmosphere!;
  if (change?.case === "setWind") scene.atmosphere!.wind = create(SceneSchema, { gravity: change.value }).gravity!;
  if (change?.case === "addRigidBody")
    scene.rigidBodies.push(create(SceneSchema, { rigidBodies: [change.value] }).rigidBodies[0]!);
  if (change?.case === "changeSoftBody") Object.assign(scene.softBodies[0]!.gas!, change.value.gas);
  if (change?.case === "removeRigidBody")
    scene.rigidBodies = scene.rigidBodies.filter(({ name }) => name !== change.value);
}

async function begin(client: FakeClient, world = "w"): Promise<WorldEdits> {
  const edits = new WorldEdits(
    () => {},
    (error) => assert.fail(error),
    (scene) => scene,
  );
  await edits.begin(client, world);
  return edits;
}

const gravity = (down: number) => (): Wish => ({
  says: "Change gravity",
  changes: [{ change: { case: "setGravity", value: { y: -down } } }],
});
const stone = (radiusM: number, y: number): Wish => {
  const shape = { shape: { case: "sphere", value: { radiusM } } } as const;
  return {
    says: "Add stone",
    changes: [{ change: { case: "addRigidBody", value: { name: "stone", shape, position: { y } } } }],
  };
};
const noStone: Wish = { says: "Remove stone", changes: [{ change: { case: "removeRigidBody", value: "stone" } }] };

test("a deed is taken back and done again", async () => {
  const client = new FakeClient("w");
  const edits = await begin(client);
  assert.equal((await edits.make(gravity(5)))?.reply.tick, 1n);
  assert.equal(edits.toUndo, "Change gravity");
  assert.deepEqual(await edits.undo(), { says: "Change gravity", tick: 2n, isWhole: true });
  assert.equal((await edits.fresh()).gravity?.y, -9.8);
  assert.equal(edits.toUndo, undefined);
  assert.deepEqual(await edits.redo(), { says: "Change gravity", tick: 3n, isWhole: true });
  assert.equal((await edits.fresh()).gravity?.y, -5);
  assert.equal(edits.toRedo, undefined);
});

test("a deed goes to the world that it was meant for, and not into the deeds of the next", async () => {
  const client = new FakeClient("w", "next");
  const edits = await begin(client);
  let goOn = () => {};
  client.pause = new Promise((resolve) => (goOn = resolve));
  const made = edits.make(gravity(5));
  await Promise.resolve(); // the scene is being read
  await edits.begin(client, "next");
  goOn();
  await made;
  assert.deepEqual(client.edits, [["w", "setGravity"]]);
  assert.equal(edits.toUndo, undefined);
  assert.equal((await edits.fresh()).gravity?.y, -9.8);
});

test("where no world is shown nothing can be done", async () => {
  const edits = await begin(new FakeClient("w"));
  edits.end();
  const isRefused = (error: unknown) => error instanceof PneumaError && error.code === "UNAVAILABLE";
  await assert.rejects(edits.make(gravity(5)), isRefused);
  await assert.rejects(edits.fresh(), isRefused);
  assert.equal(edits.scene, undefined);
});

test("a body that is put back is where it was when it was removed", async () => {
  const client = new FakeClient("w");
  const edits = await begin(client);
  await edits.make(() => stone(1, 3));
  await edits.fresh();
  client.worlds.get("w")!.rigidBodies[0]!.position!.y = 0.5; // it fell, without an edit
  await edits.make(() => noStone);
  await edits.undo();
  assert.equal((await edits.fresh()).rigidBodies[0]?.position?.y, 0.5);
});

test("the edits of a gesture are one deed, of which nothing is lost", async () => {
  const client = new FakeClient("w");
  const edits = await begin(client);
  const gesture = {};
  const wind = (x: number) => (scene: Scene) => ({
    says: "Change the wind",
    changes: scene.atmosphere
      ? [{ change: { case: "setWind", value: { x } } } as const]
      : [{ change: { case: "setAtmosphere", value: { densityKgM3: 1.2, wind: { x } } } } as const],
  });
  await edits.make(wind(1), gesture);
  await edits.fresh();
  const { reads } = client;
  await edits.make(wind(2), gesture);
  await edits.make(wind(3), gesture);
  assert.equal(client.reads, reads, "the scene is read at a gesture's beginning alone");
  assert.deepEqual(client.edits.at(-1), ["w", "setWind"]);
  await edits.undo();
  assert.equal((await edits.fresh()).atmosphere?.densityKgM3, 0);
  assert.equal(edits.toUndo, undefined);
  await edits.redo();
  const { atmosphere } = await edits.fresh();
  assert.deepEqual([atmosphere?.densityKgM3, atmosphere?.wind?.x], [1.2, 3]);
});

test("what could not be taken back now stays to be taken back; what never can does not", async () => {
  const client = new FakeClient("w");
  const edits = await begin(client);
  await edits.make(gravity(5));
  client.refusal = new PneumaError("UNAVAILABLE", "the connection is lost");
  await assert.rejects(edits.undo());
  assert.equal(edits.toUndo, "Change gravity");
  await edits.undo();
  client.refusal = new PneumaError("LIMIT_EXCEEDED", "too many requests", "", 1);
  await assert.rejects(edits.redo());
  assert.equal(edits.toRedo, "Change gravity");
  await edits.redo();
  client.refusal = new PneumaError("FAILED_PRECONDITION", "not so");
  await assert.rejects(edits.undo());
  assert.deepEqual([edits.toUndo, edits.toRedo], [undefined, undefined]);
});

test("what others changed since is left as they left it", async () => {
  const client = new FakeClient("w");
  const edits = await begin(client);
  await edits.make(gravity(5));
  await client.edit("w", { changes: gravity(2)().changes });
  assert.deepEqual(await edits.undo(), { says: "Change gravity", tick: undefined, isWhole: false });
  assert.equal((await edits.fresh()).gravity?.y, -2);
  assert.deepEqual([edits.toUndo, edits.toRedo], [undefined, undefined]);

  await edits.make(() => stone(1, 3));
  await client.edit("w", { changes: [...noStone.changes, ...stone(2, 3).changes] }); // another of its name
  assert.equal((await edits.undo())?.tick, undefined);
  assert.equal((await edits.fresh()).rigidBodies.length, 1);
});

test("gas is taken back though a pump of this page has changed it since, and not where others have", async () => {
  const client = new FakeClient("w");
  const scene = client.worlds.get("w")!;
  scene.softBodies = create(SceneSchema, { softBodies: [{ name: "ball", gas: { moles: 1 } }] }).softBodies;
  const { gas } = scene.softBodies[0]!;
  const edits = await begin(client);
  const ofGas = (says: string, gas: object) => (): Wish => ({
    says,
    changes: [{ change: { case: "changeSoftBody", value: { name: "ball", gas } } }],
  });
  await edits.make(ofGas("Change the gas", { moles: 2 }));
  await edits.make(ofGas("Pump", { flowMolS: 0.1 }));
  gas!.moles = 2.5; // by the pump
  await edits.undo();
  assert.equal(gas!.flowMolS, 0);
  await edits.make(gravity(5)); // what was undone is forgotten
  await edits.undo();
  assert.ok((await edits.undo())?.isWhole);
  assert.equal(gas!.moles, 1);

  await edits.make(ofGas("Change the gas", { moles: 2 }));
  gas!.moles = 2.5; // by others
  assert.equal((await edits.undo())?.tick, undefined);
  assert.equal(gas!.moles, 2.5);
});

test("of a deed of which others changed a part the rest is taken back", async () => {
  const client = new FakeClient("w");
  const edits = await begin(client);
  await edits.make(() => ({ says: "Both", changes: [...gravity(5)().changes, ...stone(1, 3).changes] }));
  await client.edit("w", { changes: noStone.changes });
  assert.deepEqual(await edits.undo(), { says: "Both", tick: 3n, isWhole: false });
  assert.equal((await edits.fresh()).gravity?.y, -9.8);
});

test("two deeds asked for at once are taken back from the last to the first", async () => {
  const client = new FakeClient("w");
  const edits = await begin(client);
  await Promise.all([edits.make(gravity(5)), edits.make(gravity(6))]);
  const undone = await Promise.all([edits.undo(), edits.undo(), edits.undo()]);
  assert.deepEqual(
    undone.map((each) => each?.isWhole),
    [true, true, undefined],
  );
  assert.equal((await edits.fresh()).gravity?.y, -9.8);
});

test("a world at its beginning has nothing to take back, nor has another", async () => {
  const client = new FakeClient("w", "next");
  const edits = await begin(client);
  await edits.make(gravity(5));
  edits.forget();
  assert.equal(await edits.undo(), undefined);
  await edits.make(gravity(4));
  await edits.begin(client, "next");
  assert.equal(edits.toUndo, undefined);
});

test("of a row of changes the scene is read once, when they have come to rest", async () => {
  const client = new FakeClient("w");
  const edits = new WorldEdits(
    () => {},
    (error) => assert.fail(error),
    (scene) => scene,
  );
  await edits.begin(client, "w");
  const reads = client.reads;
  const rest = Array.from({ length: 20 }, () => edits.stale());
  apply(client.worlds.get("w")!, gravity(1)().changes[0]!);
  await Promise.all(rest);
  assert.equal(client.reads, reads + 1);
  assert.equal(edits.scene?.gravity?.y, -1);
});

test("no more deeds are kept than memory is meant for them", async () => {
  const client = new FakeClient("w");
  const edits = await begin(client);
  for (let down = 1; down <= 105; ++down) await edits.make(gravity(down));
  let undone = 0;
  while (await edits.undo()) ++undone;
  assert.equal(undone, 100);
  assert.equal((await edits.fresh()).gravity?.y, -5);
});
