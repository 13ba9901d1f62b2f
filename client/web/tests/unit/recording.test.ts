// How the page finds out from the list of worlds that one is a recording, and where in it a tick is.
import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { WorldList_WorldSchema } from "../../proto/pneuma/v1/session_pb.js";
import { Recording } from "../../viewer/recording.js";

const [firstTick, lastTick, rateHz] = [600, 900, 60];
const facts = { durationS: 5, firstTick: BigInt(firstTick), lastTick: BigInt(lastTick), velocities: true };
const list = [
  create(WorldList_WorldSchema, { name: "live", rateHz }),
  create(WorldList_WorldSchema, { name: "played", rateHz, recording: facts }),
];

test("a recording tells its length, its ticks and whether it has velocities", () => {
  const recording = Recording.among(list, "played");
  assert.ok(recording);
  assert.equal(recording.durationS, 5);
  assert.equal(recording.atS(690), 1.5);
  assert.equal(recording.atS(lastTick + 1), 5);
  assert.ok(!recording.isEnd(lastTick - 1) && recording.isEnd(lastTick));
  assert.ok(recording.hasVelocities);
});

test("a world that runs is none, nor is one that is not there", () => {
  assert.equal(Recording.among(list, "live"), undefined);
  assert.equal(Recording.among(list, "gone"), undefined);
});
