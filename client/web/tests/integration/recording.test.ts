// What the TypeScript client records is a recording to the C++ programs: `pneuma play` shows the frames that were received,
// `pneuma export` writes them.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { mkdtemp, readdir, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { promisify } from "node:util";
import {
  type Applied,
  Client,
  type Frame,
  PneumaError,
  readRecording,
  Recorder,
  RecordingPlayer,
} from "../../src/index.js";
import { Frames } from "../frames.js";
import { clientProgram, Server } from "../server.js";

const world = "five-balls";
const framesWanted = 40;

let server: Server;
let client: Client;
let folder: string;

before(async () => {
  server = await Server.start(["--scene", world]);
  client = await Client.connect(server.url);
  folder = await mkdtemp(join(tmpdir(), "pneuma-"));
});
after(async () => {
  client.close();
  await server.kill();
  await rm(folder, { recursive: true });
});

/** Waits until so much is recorded, frame by frame of another stream. */
async function recorded(recorder: Recorder, frames: number): Promise<void> {
  const seen = new Frames();
  const stream = await client.subscribe(world, { maxErrorM: 0.01 }, seen);
  while (recorder.progress.frames < frames) await seen.next();
  await client.unsubscribe(stream);
}

test("a recording is played frame by frame, with what was done, and exported", async () => {
  const recorder = await Recorder.start(server.url, world, { maxErrorM: 0.001 });
  await recorded(recorder, 5);
  await client.impulse(world, { body: "ball-1", impulse: { y: 2 } });
  await recorded(recorder, framesWanted);
  const { length } = recorder.stop().reduce((sum, part) => ({ length: sum.length + part.length }), { length: 0 });
  const { frames, commands, bytes, durationS } = recorder.progress;
  assert.equal(length, bytes);
  assert.equal(commands, 1);
  assert.ok(Math.abs(durationS - (frames - 1) / 60) < 1e-6, `${frames} frames in ${durationS} s`);
  const file = join(folder, "w.pneuma");
  await writeFile(file, Buffer.concat(recorder.stop()));

  const player = await Server.play(file, ["--paused"]);
  const viewer = await Client.connect(player.url);
  try {
    assert.deepEqual(
      (await viewer.worlds()).map(({ name }) => name),
      [world],
    );
    const shown: Frame[] = [];
    const done: Applied[] = [];
    const last = new Promise<void>((resolve) => {
      const frame = (each: Frame) => {
        shown.push(each);
        if (shown.length === frames) resolve();
      };
      void viewer
        .subscribe(world, { commands: true }, { frame, applied: (each) => done.push(each) })
        .then(() => viewer.resume(world, 1));
    });
    await last;
    assert.equal(shown.at(-1)!.tick - shown[0]!.tick, frames - 1);
    assert.deepEqual(
      done.map(({ command }) => command?.request.case),
      ["impulse"],
    );
  } finally {
    viewer.close();
    await player.kill();
  }

  const out = join(folder, "frames");
  await promisify(execFile)(clientProgram, ["export", file, "--format", "obj", "--out", out]);
  assert.ok((await readdir(out)).length >= frames);
});

test("a recording is played without a server as pneuma play plays it: the same frames after a seek, the same refusals", async () => {
  const recorder = await Recorder.start(server.url, world, { maxErrorM: 0.001, keyIntervalS: 0.25 });
  await recorded(recorder, framesWanted);
  await client.impulse(world, { body: "ball-1", impulse: { y: 2 } });
  await recorded(recorder, framesWanted + 20);
  const bytes = Buffer.concat(recorder.stop());
  const file = join(folder, "own.pneuma");
  await writeFile(file, bytes);
  const player = await Server.play(file, ["--paused"]);
  const own = readRecording(bytes);
  const viewers: Client[] = [];
  const refusal = (asked: Promise<unknown>) =>
    asked.then(
      () => "taken",
      ({ code, what, where }: PneumaError) => [code, where.split(".").at(-1), /ends/.test(what)],
    );
  try {
    viewers.push(await Client.connect(player.url));
    viewers.push(await Client.connect("", { openSocket: new RecordingPlayer(own).open }));
    const shown: Frame[][] = [];
    const refused: unknown[] = [];
    const listed: unknown[] = [];
    for (const viewer of viewers) {
      await viewer.pause(world);
      let last: Frame | undefined;
      let came = () => {};
      const frame = (each: Frame) => {
        last = each;
        came();
      };
      await viewer.subscribe(world, {}, { frame });
      const at = async (tick: bigint) => {
        while (last?.tick !== Number(tick)) await new Promise<void>((resolve) => (came = resolve));
        return last;
      };
      const frames: Frame[] = [];
      for (const timeS of [0.5, 0.1, 0.8, 0]) frames.push(await at((await viewer.seek(world, timeS)).tick));
      frames.push(await at((await viewer.step(world, 3)).tick));
      shown.push(frames);
      const { tick, timeS, softBodies, rigidBodies, recording } = (await viewer.worlds())[0]!;
      listed.push({ tick, timeS, softBodies, rigidBodies, recording });
      refused.push(
        await Promise.all(
          [
            viewer.seek(world, 1e300),
            viewer.seek(world, -1),
            viewer.impulse(world, { body: "ball-1", impulse: { y: 2 } }),
            viewer.step(world, 0),
            viewer.step(world, 36_001),
            viewer.step(world, 1000),
            viewer.subscribe(world, { bodies: ["nobody"] }, { frame: () => {} }),
            viewer.subscribe(world, { contacts: true }, { frame: () => {} }),
            viewer.subscribe(world, { maxErrorM: 1e-5 }, { frame: () => {} }),
            viewer.pause("nowhere"),
            viewer.resume(world, 0.01),
          ].map(refusal),
        ),
      );
    }
    assert.deepEqual(refused[1], refused[0]);
    assert.deepEqual(listed[1], listed[0]);
    const [theirs, ours] = shown as [Frame[], Frame[]];
    theirs.forEach(({ tick, positions }, i) => {
      assert.equal(ours[i]!.tick, tick);
      positions.forEach((points, body) =>
        // Theirs are encoded anew, within a quarter of a millimetre.
        points.forEach((place, j) => assert.ok(Math.abs(ours[i]!.positions[body]![j]! - place) < 0.0003)),
      );
    });
  } finally {
    for (const viewer of viewers) viewer.close();
    await player.kill();
  }
});

test("what is no recording is refused, and one that was cut off is read up to there", async () => {
  const recorder = await Recorder.start(server.url, world, {});
  await recorded(recorder, 10);
  const bytes = Buffer.concat(recorder.stop());
  const whole = readRecording(bytes).frames.length;
  const cut = readRecording(bytes.subarray(0, bytes.length / 2)).frames.length;
  assert.ok(cut > 0 && cut < whole, `${cut} of ${whole} frames`);
  for (const wrong of [Buffer.from("no recording at all"), bytes.subarray(0, 40)]) {
    assert.throws(() => readRecording(wrong), { code: "MALFORMED" });
  }
});

test("a recording that is full ends, and what came is kept", async () => {
  let ended: (why: PneumaError) => void;
  const end = new Promise<PneumaError>((resolve) => (ended = resolve));
  const recorder = await Recorder.start(server.url, world, { bytesMax: 20_000, ended: (why) => ended(why) });
  assert.equal((await end).code, "LIMIT_EXCEEDED");
  const file = join(folder, "full.pneuma");
  await writeFile(file, Buffer.concat(recorder.stop()));
  await promisify(execFile)(clientProgram, ["export", file, "--format", "obj", "--out", join(folder, "full")]);
});

test("a world that is not there is not recorded", async () => {
  const refused = (error: unknown) => error instanceof PneumaError && error.code === "NOT_FOUND";
  await assert.rejects(Recorder.start(server.url, "nowhere"), refused);
});
