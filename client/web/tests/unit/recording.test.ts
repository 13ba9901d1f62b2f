// How the page finds out that a world is a recording, against a server that is played by this test: what it answers is as
// `pneuma play` and `pneuma-server` do.
import assert from "node:assert/strict";
import { test } from "node:test";
import { type Client, PneumaError } from "../../src/index.js";
import { findRecording } from "../../viewer/recording.js";

const [firstTick, lastTick, rateHz] = [600, 900, 60];

/** A recording of five seconds, at `tick`. */
function player(tick: number) {
  const asked: number[] = [];
  const seek = (_: string, timeS: number) => {
    asked.push(timeS);
    if (timeS > 5) throw new PneumaError("INVALID_ARGUMENT", "the recording ends at 5 s", "seek.time_s");
    return Promise.resolve({ tick: BigInt(Math.floor(firstTick + timeS * rateHz)) });
  };
  const stats = () => Promise.resolve({ tick: BigInt(tick), rateHz });
  const subscribe = () => Promise.reject(new PneumaError("FAILED_PRECONDITION", "", "subscribe.velocities"));
  return { asked, client: { seek: async (w: string, t: number) => seek(w, t), stats, subscribe } as unknown as Client };
}

test("a recording tells its length and its first tick, and is left where it was", async () => {
  const { asked, client } = player(690);
  const recording = await findRecording(client, "w");
  assert.ok(recording);
  assert.equal(recording.durationS, 5);
  assert.equal(recording.atS(690), 1.5);
  assert.ok(!recording.isEnd(lastTick - 1) && recording.isEnd(lastTick));
  assert.ok(!recording.hasVelocities);
  assert.equal(Math.floor(firstTick + asked.at(-1)! * rateHz), 690);
});

test("a recording that is at its end begins again", async () => {
  const { asked, client } = player(lastTick);
  await findRecording(client, "w");
  assert.equal(asked.at(-1), 0);
});

test("a world that runs is none, nor is one that may not be asked", async () => {
  for (const code of ["FAILED_PRECONDITION", "PERMISSION_DENIED", "NOT_FOUND"] as const) {
    const client = { seek: () => Promise.reject(new PneumaError(code, "no")) } as unknown as Client;
    assert.equal(await findRecording(client, "w"), undefined);
  }
});
