// The picture's time against frames that come late, in bunches, or from a world that is slow: simulated arrivals, and a
// display that asks 60 times a second.
import assert from "node:assert/strict";
import { test } from "node:test";
import type { Frame } from "../../src/index.js";
import { Playback } from "../../viewer/playback.js";

const layout = { softBodies: [], solids: [], joints: [] };

function frameAt(timeS: number, of = layout): Frame {
  const none = { isKey: false, bytes: 0, positions: [], velocities: undefined, poses: [], scalars: undefined };
  return { ...none, layout: of, tick: Math.round(60 * timeS), timeS, contacts: [] };
}

/** The same numbers in every run, 0 to 1. */
function makeRandom(): () => number {
  let state = 1;
  return () => (state = (state * 48271) % 2147483647) / 2147483647;
}

interface Drawn {
  readonly atMs: number;
  readonly timeS: number;
}

/** What is shown over 10 s of frames that arrive at these times, from the third second on. */
function play(arrivals: readonly { atMs: number; timeS: number }[]): Drawn[] {
  const playback = new Playback();
  const drawn: Drawn[] = [];
  let next = 0;
  for (let atMs = 5; atMs < 10_000; atMs += 1000 / 60) {
    for (; next < arrivals.length && arrivals[next]!.atMs <= atMs; ++next) {
      playback.push(frameAt(arrivals[next]!.timeS), arrivals[next]!.atMs);
    }
    const moment = playback.at(atMs);
    if (!moment) continue;
    const { from, to, fraction } = moment;
    if (atMs > 3000) drawn.push({ atMs, timeS: from.timeS + fraction * (to.timeS - from.timeS) });
  }
  return drawn;
}

/** Asserts that each picture goes on by `stepMs` of the world's time, but for a part. */
function assertEven(drawn: readonly Drawn[], stepMs: number, part: number): void {
  for (let i = 1; i < drawn.length; ++i) {
    const step = 1000 * (drawn[i]!.timeS - drawn[i - 1]!.timeS);
    assert.ok(Math.abs(step / stepMs - 1) < part, `${step} ms at ${drawn[i]!.atMs} ms`);
  }
}

test("frames that come on time are shown within two intervals, evenly", () => {
  const arrivals = Array.from({ length: 600 }, (_, i) => ({ atMs: (1000 * i) / 60, timeS: i / 60 }));
  const drawn = play(arrivals);
  assertEven(drawn, 1000 / 60, 0.02);
  for (const { atMs, timeS } of drawn) assert.ok(atMs / 1000 - timeS < 2 / 60);
});

test("frames that come up to 30 ms late are shown evenly, and no later than that needs", () => {
  const random = makeRandom();
  let lastMs = 0;
  const arrivals = Array.from({ length: 600 }, (_, i) => {
    lastMs = Math.max(lastMs, (1000 * i) / 60 + 30 * random()); // in order
    return { atMs: lastMs, timeS: i / 60 };
  });
  const drawn = play(arrivals);
  assertEven(drawn, 1000 / 60, 0.1);
  for (const { atMs, timeS } of drawn) assert.ok(atMs / 1000 - timeS < 0.03 + 2 / 60 + 0.01);
});

test("frames that come four at a time are shown one after the other", () => {
  const arrivals = Array.from({ length: 600 }, (_, i) => ({ atMs: (1000 * 4 * Math.ceil(i / 4)) / 60, timeS: i / 60 }));
  assertEven(play(arrivals), 1000 / 60, 0.1);
});

test("a world at half its pace is shown at half its pace, evenly", () => {
  const arrivals = Array.from({ length: 300 }, (_, i) => ({ atMs: (2000 * i) / 60, timeS: i / 60 }));
  assertEven(play(arrivals), 1000 / 120, 0.1);
});

test("after a pause it goes on at once", () => {
  const playback = new Playback();
  for (let i = 0; i < 120; ++i) playback.push(frameAt(i / 60), (1000 * i) / 60);
  playback.at(2000);
  const resumedMs = 60_000;
  for (let i = 120; i < 150; ++i) {
    const atMs = resumedMs + (1000 * (i - 120)) / 60;
    playback.push(frameAt(i / 60), atMs);
    playback.at(atMs);
  }
  const { from } = playback.at(resumedMs + 500)!;
  assert.ok(from.timeS > 2.3, `${from.timeS} s`);
});

test("a reset shows the beginning again", () => {
  const playback = new Playback();
  for (let i = 0; i < 60; ++i) playback.push(frameAt(i / 60), (1000 * i) / 60);
  playback.at(1000);
  playback.push(frameAt(0), 1010);
  assert.equal(playback.at(1020)!.to.timeS, 0);
});

test("where bodies come or go the picture goes on as evenly, and shows nothing between the two", () => {
  const playback = new Playback();
  const drawn: Drawn[] = [];
  const layouts = [layout, { ...layout }];
  for (let i = 0; i < 600; ++i) {
    const atMs = (1000 * i) / 60;
    playback.push(frameAt(i / 60, layouts[Math.floor(i / 100) % 2]), atMs);
    const { from, to, fraction } = playback.at(atMs + 5)!;
    assert.equal(from.layout, to.layout);
    drawn.push({ atMs, timeS: from.timeS + fraction * (to.timeS - from.timeS) });
  }
  // Nothing is between the layouts: there a picture may be an interval late, and the next makes it good.
  for (let i = 200; i < drawn.length; ++i) {
    const step = drawn[i]!.timeS - drawn[i - 1]!.timeS;
    assert.ok(step >= 0 && step < 2.1 / 60, `${step} s`);
  }
});

test("a paused world's last frame is shown, also where it is the first of its layout", () => {
  const playback = new Playback();
  for (let i = 0; i < 60; ++i) playback.push(frameAt(i / 60), (1000 * i) / 60);
  const last = frameAt(1, { ...layout });
  playback.push(last, 1000);
  let moment = playback.at(1000)!;
  for (let atMs = 1000; atMs < 3000; atMs += 1000 / 60) moment = playback.at(atMs)!;
  assert.equal(moment.to, last);
  assert.equal(moment.fraction, 1);
});

test("a reset is counted, also where the world has come further again before a picture is drawn", () => {
  const playback = new Playback();
  playback.push(frameAt(2), 0);
  assert.equal(playback.at(1)!.resets, 0);
  for (const [timeS, atMs] of [
    [0, 20],
    [1, 1020],
    [3, 3020],
  ] as const) {
    playback.push(frameAt(timeS), atMs);
  }
  assert.equal(playback.at(3030)!.resets, 1);
});
