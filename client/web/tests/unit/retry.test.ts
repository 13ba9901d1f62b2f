import assert from "node:assert/strict";
import { test } from "node:test";
import { retryDelayMs } from "../../src/retry.js";

test("waits double up to a limit, spread, and are never shorter than the server asks for", () => {
  assert.deepEqual(
    [0, 1, 2, 3].map((failures) => retryDelayMs(failures, 0, 0)),
    [250, 500, 1000, 2000],
  );
  assert.equal(retryDelayMs(3, 0, 1), 1000);
  assert.equal(retryDelayMs(1000, 0, 0), 10_000);
  assert.equal(retryDelayMs(0, 30, 1), 30_000);
});
