// The client against a real server: frames, changes of the world, refusals, and a connection that is lost and restored.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { after, before, test } from "node:test";
import { promisify } from "node:util";
import { Client, type ClientState, type Frame, InlineDecoder, PneumaError } from "../../src/index.js";
import { Frames } from "../frames.js";
import { Server } from "../server.js";

function refusal(code: string, where: string) {
  return (error: unknown) => error instanceof PneumaError && error.code === code && error.where === where;
}

let server: Server;
let client: Client;

before(async () => {
  server = await Server.start(["--scene", "five-balls", "--scene", "hanging-ball"]);
  client = await Client.connect(server.url);
});
after(async () => {
  client.close();
  await server.kill();
});

test("worlds are listed", async () => {
  const worlds = await client.worlds();
  assert.deepEqual(worlds.map(({ name }) => name).sort(), ["five-balls", "hanging-ball"]);
  assert.equal(worlds.find(({ name }) => name === "five-balls")?.vertices, 810);
});

test("a stream begins with a key frame and goes on tick by tick", async () => {
  const frames = new Frames();
  const stream = await client.subscribe("five-balls", { maxErrorM: 0.002 }, frames);
  assert.equal(stream.subscribed.maxErrorM, 0.002);
  const first = await frames.next();
  assert.ok(first.isKey);
  assert.equal(first.layout.softBodies.length, 5);
  assert.ok(first.positions.every((points) => points.length === 3 * 162 && points.every(Number.isFinite)));
  const later = await frames.next(({ tick }) => tick >= first.tick + 3);
  assert.ok(!later.isKey);
  assert.notDeepEqual(later.positions, first.positions);
  await client.unsubscribe(stream);
});

test("a stream whose bodies are simulated here shows the same world", async () => {
  await client.createWorld({ name: "bounces", source: { case: "builtin", value: "bouncing-ball" }, paused: true });
  await client.editJson("bounces", '{"changes": [{"set_stepping": {"integrator": "MIDPOINT", "substeps": 16}}]}');
  const plain = new Frames();
  const simulated = new Frames();
  const maxErrorM = 1e-5;
  let bytes = 0;
  let simulatedBytes = 0;
  const streams = await Promise.all([
    client.subscribe("bounces", { maxErrorM }, plain),
    client.subscribe("bounces", { maxErrorM, simulated: true }, simulated),
  ]);
  for (let tick = 2; tick <= 60; tick += 2) {
    const isThere = (frame: Frame) => frame.tick === tick;
    const both = Promise.all([plain.next(isThere), simulated.next(isThere)]);
    await client.step("bounces", 2);
    const [one, other] = await both;
    bytes += one.bytes;
    simulatedBytes += other.bytes;
    const furthest = one.positions[0]!.reduce((most, x, i) => Math.max(most, Math.abs(x - other.positions[0]![i]!)), 0);
    assert.ok(furthest <= 2 * maxErrorM, `tick ${tick}: ${furthest} m apart`);
  }
  assert.ok(simulatedBytes < 0.7 * bytes, `${simulatedBytes} of ${bytes} bytes`);
  await Promise.all(streams.map((stream) => client.unsubscribe(stream)));
  await client.destroyWorld("bounces");
});

test("a second stream of the same kind is refused, and the first goes on", async () => {
  const frames = new Frames();
  const stream = await client.subscribe("five-balls", { maxErrorM: 0.003 }, frames);
  const again = client.subscribe("five-balls", { maxErrorM: 0.003 }, new Frames());
  await assert.rejects(again, refusal("FAILED_PRECONDITION", ""));
  await frames.next(({ isKey }) => !isKey);
  await client.unsubscribe(stream);
});

test("a second stream that only the server knows to be the same leaves the first its wishes", async () => {
  let heard: () => void;
  const applied = new Promise<void>((resolve) => (heard = resolve));
  const stream = await client.subscribe("five-balls", { commands: true }, { frame: () => {}, applied: () => heard() });
  const again = client.subscribe("five-balls", { rateHz: stream.subscribed.rateHz }, new Frames());
  await assert.rejects(again, refusal("FAILED_PRECONDITION", ""));
  await client.impulse("five-balls", { body: "ball-1", impulse: { x: 0, y: 1, z: 0 } });
  await applied;
  await client.unsubscribe(stream);
});

test("a paused world steps as asked, and an edit shows in its scene", async () => {
  await client.createWorld({ name: "paused", source: { case: "builtin", value: "bouncing-ball" }, paused: true });
  const { tick } = await client.step("paused", 5);
  assert.equal(tick, 5n);
  await client.edit("paused", { changes: [{ change: { case: "setGravity", value: { y: -1.5 } } }] });
  assert.equal((await client.scene("paused")).gravity?.y, -1.5);
  await client.reset("paused");
  assert.equal((await client.stats("paused")).timeS, 0);
  await client.destroyWorld("paused");
});

test("a grabbed vertex follows its point, and a released one is free", async () => {
  const frames = new Frames();
  const stream = await client.subscribe("hanging-ball", {}, frames);
  const { layout, positions } = await frames.next();
  const body = layout.softBodies[0]!.name;
  const [x, y, z] = [positions[0]![300]!, positions[0]![301]!, positions[0]![302]!];
  const grab = await client.grab("hanging-ball", {
    body,
    at: { case: "vertex", value: 100 },
    target: { x, y, z },
    stiffnessNM: 1000,
  });
  assert.equal(grab.grabbed.vertex, 100);
  const target = { x: x + 0.5, y, z };
  await Promise.all(
    [0.1, 0.2, 0.3, 0.4, 0.5].map((far) => new Promise((resolve) => resolve(grab.moveTo({ ...target, x: x + far })))),
  );
  await frames.next((frame) => Math.hypot(frame.positions[0]![300]! - target.x, frame.positions[0]![301]! - y) < 0.4);
  await grab.release();
  await assert.rejects(grab.release(), refusal("NOT_FOUND", "release_grab.grab_id"));
  await client.unsubscribe(stream);
});

test("an impulse answers with what was hit, a refusal with what and where", async () => {
  const impulse = { x: 0, y: 1, z: 0 };
  const { detail } = await client.impulse("five-balls", { body: "ball-1", impulse });
  assert.match(detail, /ball-1/);
  await assert.rejects(client.impulse("five-balls", { body: "ball-9", impulse }), refusal("NOT_FOUND", "impulse.body"));
  await assert.rejects(client.editJson("five-balls", "{"), (error: PneumaError) => error.code === "INVALID_ARGUMENT");
  const listener = new Frames();
  await assert.rejects(client.subscribe("no-world", {}, listener), refusal("NOT_FOUND", "subscribe.world"));
});

test("the end of a world ends its streams", async () => {
  await client.createWorld({ name: "short", source: { case: "builtin", value: "bouncing-ball" } });
  const ended = new Promise<PneumaError>((resolve, reject) => {
    client.subscribe("short", {}, { frame: () => {}, ended: resolve }).catch(reject);
  });
  await client.destroyWorld("short");
  assert.equal((await ended).code, "NOT_FOUND");
});

test("a wrong token is refused for good", async () => {
  const guarded = await Server.start(["--scene", "bouncing-ball"], "secret-of-this-test");
  await assert.rejects(Client.connect(guarded.url), (error: PneumaError) => error.code === "UNAUTHENTICATED");
  const welcome = await Client.connect(guarded.url, { token: "secret-of-this-test" });
  assert.equal((await welcome.worlds()).length, 1);
  welcome.close();
  await guarded.kill();
});

test("a lost connection comes back with its streams", async () => {
  const flags = ["--scene", "bouncing-ball"];
  const first = await Server.start(flags);
  const states: ClientState[] = [];
  const frames = new Frames();
  const lasting = await Client.connect(first.url, { stateChanged: (state) => states.push(state) });
  await lasting.subscribe("bouncing-ball", {}, frames);
  await frames.next(({ isKey }) => !isKey);
  await first.kill();
  const again = frames.next(({ isKey }) => isKey);
  const second = await Server.start([...flags, "--http", first.http]);
  await again;
  assert.deepEqual(states, ["open", "lost", "open"]);
  assert.equal((await lasting.worlds()).length, 1);
  lasting.close();
  await second.kill();
});

/** Is behind once, when it is told to be. */
class BusyDecoder extends InlineDecoder {
  isBusy = false;

  override isBehind(): boolean {
    const { isBusy } = this;
    this.isBusy = false;
    return isBusy;
  }
}

test("a stream that was decoded too slowly goes on with a key frame", async () => {
  const decoder = new BusyDecoder();
  const own = await Client.connect(server.url, { decoder });
  const frames = new Frames();
  let gap: readonly number[] = [];
  const listener = { frame: (frame: Frame) => frames.frame(frame), gap: (...ticks: number[]) => (gap = ticks) };
  await own.subscribe("five-balls", { commands: true }, listener);
  const last = await frames.next(({ isKey }) => !isKey);
  const key = frames.next(({ isKey }) => isKey);
  decoder.isBusy = true;
  const { tick } = await key;
  assert.ok(last.tick < gap[0]! && gap[0]! <= gap[1]! && gap[1]! <= tick, `${last.tick} ${gap} ${tick}`);
  await frames.next(({ isKey }) => !isKey);
  own.close();
});

/** Goes wrong once, when it is told to. */
class WrongDecoder extends InlineDecoder {
  isWrong = false;

  override decode(...[stream, payload, base, layer, check]: Parameters<InlineDecoder["decode"]>) {
    const flip = this.isWrong && base !== undefined ? 1 : 0;
    if (flip) this.isWrong = false;
    return super.decode(stream, payload, base, layer, check! ^ flip);
  }
}

test("every frame's vertices are those that its check tells; a stream that went wrong goes on with a key frame", async () => {
  const decoder = new WrongDecoder();
  const own = await Client.connect(server.url, { decoder });
  const frames = new Frames();
  let tell!: (error: PneumaError) => void;
  const fault = new Promise<PneumaError>((resolve) => (tell = resolve));
  const options = { velocities: true, simulated: true, timeLayers: false };
  await own.subscribe("five-balls", options, { frame: (frame) => frames.frame(frame), fault: (error) => tell(error) });
  await frames.next(({ isKey }) => isKey);
  const last = await frames.next(({ isKey }) => !isKey);
  const key = frames.next(({ isKey }) => isKey);
  decoder.isWrong = true;
  assert.equal((await fault).code, "WRONG_STATE");
  assert.ok((await key).tick > last.tick);
  await frames.next(({ isKey }) => !isKey);
  assert.equal(own.state, "open");
  own.close();
});

test("where nothing listens, connecting says so", async () => {
  const gone = await Server.start([]);
  await gone.kill();
  await assert.rejects(Client.connect(gone.url), (error: PneumaError) => error.code === "UNAVAILABLE");
});

test("the example prints frames and ends", async () => {
  const { stdout } = await promisify(execFile)(process.execPath, [
    "dist/examples/watch.js",
    server.url,
    "five-balls",
    "3",
  ]);
  const lines = stdout.trimEnd().split("\n");
  assert.equal(lines.length, 3);
  for (const line of lines) assert.match(line, /^tick \d+  \d+\.\d{3} s  (key|delta)  \d+ B  ball-1 \(/);
});
