import assert from "node:assert/strict";
import { test } from "node:test";
import { PneumaError, type Stream, type SubscribeOptions } from "../../src/index.js";
import { subscribeAsFarAsCanBe } from "../../viewer/subscribing.js";

const listener = { frame: () => {} };

/** Of a world that refuses these fields where they are asked for. */
function refusing(fields: Readonly<Record<string, keyof SubscribeOptions>>) {
  const asked: SubscribeOptions[] = [];
  const subscribe = (_world: string, options: SubscribeOptions): Promise<Stream> => {
    asked.push(options);
    for (const [where, field] of Object.entries(fields)) {
      if (options[field]) return Promise.reject(new PneumaError("FAILED_PRECONDITION", "cannot be had", where));
    }
    return Promise.resolve({ options } as Stream);
  };
  return { subscribe, asked };
}

test("what a recording does not hold is not asked for again, and all else is", async () => {
  const world = refusing({ "subscribe.max_error_m": "maxErrorM", "subscribe.scalars": "scalars" });
  const wanted = { maxErrorM: 0.0005, scalars: true, velocities: true, commands: true };
  const stream = await subscribeAsFarAsCanBe(world, "played", wanted, listener);
  assert.deepEqual(stream.options, { ...wanted, maxErrorM: 0, scalars: false });
  assert.equal(world.asked.length, 3);
});

test("a refusal of anything else is handed on at once", async () => {
  const world = refusing({ "subscribe.world": "commands" });
  await assert.rejects(subscribeAsFarAsCanBe(world, "gone", { commands: true }, listener), {
    where: "subscribe.world",
  });
  assert.equal(world.asked.length, 1);
});

test("a refusal of what was not asked for ends it", async () => {
  const subscribe = () => Promise.reject(new PneumaError("FAILED_PRECONDITION", "no", "subscribe.velocities"));
  await assert.rejects(subscribeAsFarAsCanBe({ subscribe }, "world", {}, listener), { where: "subscribe.velocities" });
});
