// The decoder against the golden vectors that every implementation is held to, and against bytes that are no payload.
import assert from "node:assert/strict";
import { test } from "node:test";
import { FrameReader } from "../../src/codec/frame_reader.js";
import { makeMeshOrder } from "../../src/codec/mesh_order.js";
import { checkMechanics, SimulatedMotion } from "../../src/codec/simulated_motion.js";
import { PneumaError } from "../../src/errors.js";
import { type GoldenStream, goldenStreams } from "../golden.js";
import { type Codec, firstWrong, pointsOf, readerOf as readerWith } from "../golden_runs.js";

const codec: Codec = { FrameReader, makeMeshOrder, SimulatedMotion, checkMechanics };
const streams = goldenStreams();

function readerOf(stream: GoldenStream): FrameReader {
  return readerWith(codec, stream);
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

test("golden vectors are there, good and bad, each good frame with its check", () => {
  const frames = streams.flatMap((stream) => stream.frames);
  assert.ok(frames.filter(({ points }) => points).length > 10);
  assert.ok(frames.filter(({ isGood }) => !isGood).length > 10);
  assert.ok(frames.every(({ isGood, check }) => isGood === (check !== undefined)));
});

test("golden vectors are read to their points, or refused", () => {
  assert.equal(firstWrong(codec), undefined);
});

test("after a frame that fails its check only a key frame is read", () => {
  let tried = 0;
  for (const stream of streams) {
    const [key, delta, next] = stream.frames.filter(({ isGood }) => isGood);
    if (delta!.isKey || !next || next.isKey) continue;
    ++tried;
    const reader = readerOf(stream);
    reader.read(key!.payload, undefined, 0, key!.check);
    const before = pointsOf(reader, stream);
    for (const { payload, check } of [{ ...delta!, check: delta!.check! ^ 1 }, delta!, next]) {
      assert.throws(() => reader.read(payload, 0, 0, check), { code: "WRONG_STATE" });
      assert.deepEqual(pointsOf(reader, stream), before);
    }
    reader.read(key!.payload, undefined, 0, key!.check);
    reader.read(delta!.payload, 0, 0, delta!.check);
    assert.throws(() => reader.read(key!.payload, undefined, 0, key!.check! ^ 1), { code: "MALFORMED" });
  }
  assert.ok(tried > 5);
});

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
    const rounds = stream.meshes.some(({ vertexCount }) => vertexCount > 200) ? 20 : 200;
    for (const { payload, isKey } of stream.frames) {
      for (let round = 0; round < rounds; ++round) {
        const bytes = Buffer.concat([payload, Buffer.alloc(random() % 4)]).subarray(0, payload.length + (random() % 4));
        const changed = round % 4 === 0 ? bytes.subarray(0, random() % (bytes.length + 1)) : bytes;
        for (let i = random() % 4; i > 0 && changed.length > 0; --i) changed[random() % changed.length] = random();
        const before = pointsOf(reader, stream);
        if (!isRead(reader, changed, isKey)) assert.deepEqual(pointsOf(reader, stream), before);
      }
    }
  }
});
