// What the TypeScript client records is a recording to the C++ programs: `pneuma play` shows the frames that were received,
// `pneuma export` writes them.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { mkdtemp, readdir, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { promisify } from "node:util";
import { type Applied, Client, type Frame, PneumaError, Recorder } from "../../src/index.js";
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
