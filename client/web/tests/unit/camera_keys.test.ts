// The camera by the keyboard: how far it is from what it looks at, and where.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Vector3 } from "three";
import { steered } from "../../viewer/camera_keys.js";

const view = { position: new Vector3(1, 2, 5), target: new Vector3(0, 1, 0) };
const distanceM = view.position.distanceTo(view.target);

test("arrows turn the camera about what it looks at, there and back", () => {
  for (const [there, back] of [
    ["ArrowLeft", "ArrowRight"],
    ["ArrowUp", "ArrowDown"],
  ] as const) {
    const turned = steered(view, there, false)!;
    assert.ok(turned.target.equals(view.target));
    assert.ok(Math.abs(turned.position.distanceTo(turned.target) - distanceM) < 1e-9);
    assert.ok(turned.position.distanceTo(view.position) > 0.1 * distanceM);
    assert.ok(steered(turned, back, false)!.position.distanceTo(view.position) < 1e-9);
  }
});

test("the camera stays upright however often it is turned up", () => {
  let turned: typeof view = view;
  for (let press = 0; press < 100; ++press) turned = steered(turned, "ArrowUp", false)!;
  const { x, y, z } = turned.position.clone().sub(turned.target);
  assert.ok(y > 0 && Math.hypot(x, z) > 0);
});

test("with Shift arrows move the camera and what it looks at alike", () => {
  for (const key of ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"]) {
    const moved = steered(view, key, true)!;
    const way = moved.position.clone().sub(view.position);
    assert.ok(way.length() > 0 && moved.target.clone().sub(view.target).distanceTo(way) < 1e-9);
  }
});

test("plus goes nearer, minus away, and other keys are about something else", () => {
  assert.ok(steered(view, "+", false)!.position.distanceTo(view.target) < distanceM);
  assert.ok(steered(view, "-", false)!.position.distanceTo(view.target) > distanceM);
  assert.equal(steered(view, "w", false), undefined);
});
