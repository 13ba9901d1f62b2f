// When the page says that a server cannot keep up: by the last ten seconds, one ratio each.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Pace } from "../../viewer/pace_window.js";

function paceOf(ratios: readonly number[]): Pace {
  const pace = new Pace();
  for (const ratio of ratios) pace.add(ratio);
  return pace;
}

test("one late tick in ten seconds is not told of", () => {
  assert.ok(!paceOf([0.9, 1, 1]).isSlow);
  assert.ok(!paceOf([0.55]).isSlow);
});

test("ten seconds at less than 0.95 are, and no longer than that", () => {
  const pace = paceOf(Array<number>(10).fill(0.94));
  assert.ok(pace.isSlow);
  pace.add(1);
  pace.add(1);
  assert.ok(!pace.isSlow);
});

test("it is over when ten seconds in a row were as fast as the world", () => {
  const pace = paceOf([0.5, ...Array<number>(9).fill(1)]);
  assert.ok(!pace.isOver);
  pace.add(1);
  assert.ok(pace.isOver);
});
