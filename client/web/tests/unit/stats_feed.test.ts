// How often the server is asked what it measures, by those who look: against a client that notes what it is asked, with the
// feed's timer and clock the test's own.
import assert from "node:assert/strict";
import { test } from "node:test";
import type { Client } from "../../src/index.js";
import { often, StatsFeed } from "../../viewer/stats_feed.js";

const world = "w";
const page = { hidden: false };
Object.assign(globalThis, { document: page });

test("it is asked as often as those need who look, pinged for those who want that, and not at all where nobody looks", async (t) => {
  let nowMs = 1000;
  let tick = () => {};
  t.mock.method(performance, "now", () => nowMs);
  t.mock.method(globalThis, "setInterval", (action: () => void) => (tick = action) && undefined);
  let asked: string[] = [];
  const client = {
    call: async () => asked.push("ping"),
    stats: async () => (asked.push("stats"), { world }),
  } as unknown as Client;
  const feed = new StatsFeed(() => ({ client, world }));
  /** What is asked within two seconds. */
  const askedNow = async () => {
    asked = [];
    for (let i = 0; i < 8; ++i) {
      tick();
      await new Promise(setImmediate);
      nowMs += 250;
    }
    return asked;
  };
  const told = { rarely: 0, often: 0 };
  const rarely = () => ++told.rarely;
  const closely = () => ++told.often;
  assert.deepEqual(await askedNow(), []);
  feed.watch(rarely, true, { intervalMs: 1000, hasRoundTrip: false });
  assert.deepEqual(await askedNow(), ["stats", "stats"]);
  feed.watch(rarely, true, { intervalMs: 1000, hasRoundTrip: false }); // once more is no other
  feed.watch(closely, true, { ...often, hasRoundTrip: true });
  assert.equal((await askedNow()).filter((kind) => kind === "ping").length, 8);
  assert.deepEqual(told, { rarely: 4, often: 8 });
  page.hidden = true;
  assert.deepEqual(await askedNow(), []);
  page.hidden = false;
  feed.watch(rarely, false, often);
  feed.watch(closely, false, often);
  assert.deepEqual(await askedNow(), []);
});
