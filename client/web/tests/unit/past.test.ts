// The page's memory of a world: synthetic frames, whose places tell their time, are packed and asked for again.
import assert from "node:assert/strict";
import { test } from "node:test";
import type { Frame, Layout } from "../../src/index.js";
import { PackedFrame } from "../../viewer/packed_frame.js";
import { Past, pastS } from "../../viewer/past.js";

function layoutOf(vertexCount: number): Layout {
  const mesh = { hash: "", vertexCount, indices: new Uint32Array() };
  return { softBodies: [{ name: "ball", mesh, keptVertices: [] }], solids: [], joints: [] };
}

const small = layoutOf(2);

/** Its first vertex is at `timeS` along x, its second one 2 m above the origin. */
function frameAt(timeS: number, layout = small): Frame {
  const points = new Float64Array(3 * layout.softBodies[0]!.mesh.vertexCount);
  [points[0], points[4]] = [timeS, 2];
  const none = { isKey: false, bytes: 0, velocities: undefined, poses: [], scalars: undefined, contacts: [] };
  return { ...none, layout, tick: Math.round(60 * timeS), timeS, positions: [points] };
}

function watched(seconds: number, layout = small): Past {
  const past = new Past();
  for (let tick = 0; tick <= 60 * seconds; ++tick) past.take(frameAt(tick / 60, layout), true);
  return past;
}

function xAt(past: Past, atS: number): number {
  const { from, to, fraction } = past.at(atS)!;
  const [x, next] = [from, to].map(({ positions }) => positions[0]![0]!) as [number, number];
  return x + fraction * (next - x);
}

test("a packed frame's places are within a 131,000th of the body's size, its poses as 32 bits have them", () => {
  const frame = frameAt(1.2345);
  const pose = { position: { x: 1, y: 2.5, z: -3 }, orientation: { x: 0, y: 0.6, z: 0, w: 0.8 } };
  const unpacked = new PackedFrame({ ...frame, poses: [pose as Frame["poses"][number]] }).unpack();
  unpacked.positions[0]!.forEach((place, i) => assert.ok(Math.abs(place - frame.positions[0]![i]!) <= 2 / 131_000));
  assert.equal(unpacked.poses[0]!.position.y, 2.5);
  assert.ok(Math.abs(unpacked.poses[0]!.orientation.w - 0.8) < 1e-7);
});

test("any moment of the last half minute is shown as it was, and nothing before", () => {
  const past = watched(40);
  assert.equal(past.nowS.toFixed(3), "40.000");
  assert.ok(past.beginS >= 10 && past.beginS < 10.1);
  for (const atS of [10.5, 22.22, 39.9]) assert.ok(Math.abs(xAt(past, atS) - atS) < 1e-3, `${atS}`);
  assert.ok(Math.abs(xAt(past, 5) - past.beginS) < 1e-3);
});

test("of a large world there are fewer frames, over as long, in no more memory", () => {
  const past = watched(35, layoutOf(100_000));
  assert.ok(past.bytes <= 64 * 1024 * 1024, `${past.bytes}`);
  assert.ok(past.nowS - past.beginS > 0.95 * pastS, `${past.nowS - past.beginS} s`);
  assert.ok(Math.abs(xAt(past, 20) - 20) < 1e-2);
});

test("what is looked at stays, while time goes on", () => {
  const past = watched(30);
  for (let timeS = 30; timeS < 80; timeS += 1 / 60) past.take(frameAt(timeS), false);
  assert.ok(past.beginS < 0.1);
  assert.ok(past.nowS > 79);
});

test("nothing is shown between the last frame before a reset, or before a gap, and the first after", () => {
  const past = watched(10);
  for (const timeS of [0, 0.05, 0.1, 20, 20.05]) past.take(frameAt(timeS), true);
  for (let atS = 9.5; atS < past.nowS; atS += 0.001) {
    const x = xAt(past, atS);
    assert.ok(x < 0.11 || (x > 9.4 && x < 10.01) || x >= 20, `${x} m at ${atS} s`);
  }
});
