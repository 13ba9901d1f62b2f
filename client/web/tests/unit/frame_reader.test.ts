// The decoder against the golden vectors that every implementation is held to, and against bytes that are no payload.
import assert from "node:assert/strict";
import { test } from "node:test";
import { FrameReader } from "../../src/codec/frame_reader.js";
import { makeMeshOrder } from "../../src/codec/mesh_order.js";
import { SimulatedMotion } from "../../src/codec/simulated_motion.js";
import { PneumaError } from "../../src/errors.js";
import { type GoldenStream, goldenStreams } from "../golden.js";

const streams = goldenStreams();

function readerOf(stream: GoldenStream): FrameReader {
  const orders = stream.meshes.map(makeMeshOrder);
  const simulations = stream.mechanics.map((own, body) => {
    return own && new SimulatedMotion(orders[body]!, stream.meshes[body]!, own, stream.gridStepM);
  });
  return new FrameReader(orders, simulations);
}

function pointsOf(reader: FrameReader, stream: GoldenStream): number[][] {
  return stream.meshes.map(({ vertexCount }, body) => {
    const points = new Float64Array(3 * vertexCount);
    reader.positions(body, 1, points);
    return [...points];
  });
}

/** Whether the payload was read; an error of any other kind than a refusal goes on up. */
function isRead(reader: FrameReader, payload: Uint8Array, isKey: boolean): boolean {
  try {
    reader.read(payload, isKey ? undefined : 0);
    return true;
  } catch (error) {
    if (error instanceof PneumaError && ["MALFORMED", "UNSUPPORTED"].includes(error.code)) return false;
    throw error;
  }
}

/** Numbers below 2^32 that look random and are the same in every run (Marsaglia's xorshift). */
function randomNumbers(seed: number): () => number {
  let state = seed;
  return () => {
    state ^= state << 13;
    state ^= state >>> 17;
    state ^= state << 5;
    return state >>> 0;
  };
}

test("golden vectors are there, good and bad", () => {
  const frames = streams.flatMap((stream) => stream.frames);
  assert.ok(frames.filter((frame) => frame.points).length > 10);
  assert.ok(frames.filter((frame) => !frame.points).length > 10);
});

for (const stream of streams) {
  test(`golden vectors: ${stream.name}`, () => {
    const reader = readerOf(stream);
    let fresh = readerOf(stream); // at each key frame, which stands alone
    for (const { payload, isKey, points } of stream.frames) {
      if (isKey && points) fresh = readerOf(stream);
      for (const each of [reader, fresh]) {
        const before = pointsOf(each, stream);
        assert.equal(isRead(each, payload, isKey), points !== undefined);
        assert.deepEqual(pointsOf(each, stream), points ?? before);
      }
    }
  });
}

test("a frame of a higher time layer leaves alone what lower ones build on", () => {
  const stream = streams.find(({ name }) => name === "every way to predict")!;
  const [key, first, second] = stream.frames;
  const reader = readerOf(stream);
  reader.read(key!.payload, undefined);
  reader.read(first!.payload, 0, 1);
  reader.read(second!.payload, 1, 2);
  assert.deepEqual(pointsOf(reader, stream), second!.points);
  reader.read(first!.payload, 0, 0);
  assert.deepEqual(pointsOf(reader, stream), first!.points);
  reader.read(second!.payload, 0, 0);
  assert.deepEqual(pointsOf(reader, stream), second!.points);
});

test("bytes changed, cut and added are read or refused; what is refused changes nothing", () => {
  const random = randomNumbers(20261122);
  for (const stream of streams) {
    const reader = readerOf(stream);
    for (const { payload, isKey } of stream.frames) {
      for (let round = 0; round < 200; ++round) {
        const bytes = Buffer.concat([payload, Buffer.alloc(random() % 4)]).subarray(0, payload.length + (random() % 4));
        const changed = round % 4 === 0 ? bytes.subarray(0, random() % (bytes.length + 1)) : bytes;
        for (let i = random() % 4; i > 0 && changed.length > 0; --i) changed[random() % changed.length] = random();
        const before = pointsOf(reader, stream);
        if (!isRead(reader, changed, isKey)) assert.deepEqual(pointsOf(reader, stream), before);
      }
    }
  }
});
