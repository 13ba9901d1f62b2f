// What the page keeps of what it measures: rows over time, and the cost of a stage from two answers of the server.
import { create } from "@bufbuild/protobuf";
import assert from "node:assert/strict";
import { test } from "node:test";
import { StatsSchema } from "../../proto/pneuma/v1/session_pb.js";
import { History } from "../../viewer/history.js";
import { costsBetween } from "../../viewer/plan.js";

test("a history holds the newest of its span, however many rows come", () => {
  const history = new History(1, 10, 0.5);
  for (let i = 0; i < 100_000; ++i) history.push(i / 60, [i]);
  const [times, values] = history.rows();
  assert.ok(times!.length <= 21);
  const last = times!.at(-1)!;
  assert.ok(last > 99_999 / 60 - 0.5 && times![0]! >= last - 10 && times![0]! < last - 9);
  times!.forEach((time, i) => assert.equal(values![i], Math.round(time * 60)));
});

test("a history begins anew where time goes back", () => {
  const history = new History(2, 10, 0.1);
  history.push(5, [1, 2]);
  history.push(6, [3, 4]);
  history.push(0.2, [5, 6]);
  assert.deepEqual(
    history.rows().map((column) => [...column]),
    [[0.2], [5], [6]],
  );
});

test("a stage costs what was added to it, a tick", () => {
  const at = (tick: bigint, timeS: number, calls: bigint) =>
    create(StatsSchema, { tick, stages: [{ name: "springs", timeS, calls, bytes: 400n }] });
  const [springs] = costsBetween(at(100n, 1, 800n), at(110n, 1.02, 880n))!;
  assert.ok(Math.abs(springs!.msATick - 2) < 1e-9);
  assert.deepEqual([springs!.callsATick, springs!.bytes], [8, 400]);
  assert.equal(costsBetween(at(100n, 1, 800n), at(100n, 1, 800n)), undefined); // a paused world
});
