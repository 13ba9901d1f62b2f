// What is marked on the line of time, by a document that holds nothing but that line.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Marks } from "../../viewer/marks.js";

let drawn: readonly { className: string }[] = [];
const place = { replaceChildren: (...marks: { className: string }[]) => (drawn = marks) };
Object.assign(globalThis, {
  document: { getElementById: () => place, createElement: () => ({ className: "", style: {} }) },
});

function deed(atS: number) {
  return { atS, kind: "deed", text: `at ${atS}` } as const;
}

function marksOf(isLive: boolean, count: number): Marks {
  const marks = new Marks();
  marks.begin(isLive);
  for (let i = 0; i < count; ++i) marks.add(deed(i));
  return marks;
}

test("a recording keeps all that happened, however many key frames it has", () => {
  const marks = marksOf(false, 3000);
  marks.setKeys(Array.from({ length: 5000 }, (_, i) => i));
  assert.equal(marks.latest(1, 10_000)[0]!.atS, 2999);
  assert.equal(marks.textAt(0), "at 0");
});

test("of a world that runs the oldest go", () => {
  const marks = marksOf(true, 3000);
  assert.equal(marks.textAt(0), "");
  assert.equal(marks.latest(5000, Infinity).length, 1000);
});

test("the latest are those that happened before the place shown, the newest first", () => {
  const marks = marksOf(false, 10);
  marks.add(deed(2.5)); // which a recording came to last
  assert.deepEqual(
    marks.latest(3, 3).map(({ atS }) => atS),
    [3, 2.5, 2],
  );
  assert.deepEqual(marks.latest(3, -1), []);
});

test("what a recording comes to again is not marked twice", () => {
  const marks = marksOf(false, 5);
  marks.add(deed(2));
  assert.equal(marks.latest(10, 10).length, 5);
});

test("of many marks in one place one is drawn", () => {
  const marks = marksOf(false, 3000);
  marks.setKeys(Array.from({ length: 100_000 }, (_, i) => 0.03 * i));
  marks.draw(0, 3000);
  assert.ok(drawn.length > 1000 && drawn.length <= 2 * 1001, `${drawn.length} marks`);
});
