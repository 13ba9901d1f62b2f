// The timeline in a real browser: the past of a world that runs, and a recording that `pneuma play` serves.
import assert from "node:assert/strict";
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { Client, Recorder } from "../../src/index.js";
import { Frames } from "../frames.js";
import { Server } from "../server.js";
import {
  asked,
  client,
  complaints,
  page,
  pastTick,
  server,
  shownTick,
  test,
  unfold,
  until,
  usePage,
  world,
} from "./set_up.js";

usePage();

/** The tick of the frame that is drawn. */
function drawnTick(): Promise<number> {
  return page.$eval("#status", (status) => Number(status.dataset["shown"]));
}

/** Waits until the timeline says so. */
async function told(pattern: RegExp): Promise<void> {
  await page.waitForFunction(
    (source) => new RegExp(source).test((document.getElementById("moment-told") as HTMLOutputElement).value),
    pattern.source,
  );
}

/** Of the first second of `world`, and what was done to it. */
async function record(): Promise<Buffer> {
  await client.reset(world);
  const recorder = await Recorder.start(server.url, world, { scalars: true, keyIntervalS: 0.25 });
  const frames = new Frames();
  await client.subscribe(world, { maxErrorM: 0.01 }, frames);
  await client.impulse(world, { body: "ball", impulse: { y: 1 } });
  while (recorder.progress.durationS < 1) await frames.next();
  return Buffer.concat(recorder.stop());
}

test("the last seconds of a world are looked at, untouched, and left for now", async () => {
  await client.impulse(world, { body: "ball", impulse: { y: 1 } });
  await page.waitForSelector("#marks .deed", { state: "attached" });
  await pastTick((await shownTick()) + 90);
  const before = await shownTick();
  await page.keyboard.press("[");
  await told(/^1\.0 s ago$/);
  await until(async () => (await drawnTick()) < before - 30);
  const drawn = await drawnTick();
  await pastTick((await shownTick()) + 30);
  assert.equal(await drawnTick(), drawn, "it stands still while the world goes on");
  await page.mouse.move(260, 300);
  await page.mouse.down();
  await page.mouse.move(300, 260);
  await page.mouse.up();
  assert.ok(!asked.some(({ case: kind }) => kind === "grab"), "the past was pulled at");
  await page.focus("#moment");
  await page.keyboard.press("Home"); // as far back as there is something
  await until(async () => (await drawnTick()) < drawn);
  await page.keyboard.press("b");
  await told(/^now$/);
  await until(async () => (await drawnTick()) > before);
  assert.deepEqual(complaints, []);
});

test("a recording is gone through by its timeline, and has no control that it refuses", async () => {
  const folder = await mkdtemp(join(tmpdir(), "pneuma-page-"));
  const file = join(folder, "w.pneuma");
  await writeFile(file, await record());
  const player = await Server.play(file, ["--speed", "2", "--paused"]);
  const viewer = await Client.connect(player.url);
  try {
    await page.goto("about:blank");
    await page.goto(`http://${player.http}/`);
    await page.waitForSelector('#play[aria-label="Play"]');
    await page.fill("#moment", "0.5");
    await told(/^0\.5 \/ 1\.0 s$/);
    await page.fill("#moment", "0");
    await told(/^0\.0 \//);
    await page.click("#play"); // at twice its speed, which cannot be asked for
    await page.waitForSelector("#marks .deed", { state: "attached" });
    await told(/^1\.0 \//);
    await page.waitForSelector('#play[aria-label="Play"]');
    assert.ok(await page.isDisabled("#step"), "there is nothing behind the end");
    await page.selectOption("#time-scale", "0.125");
    await page.click("#play");
    await page.waitForSelector('#play[aria-label="Pause"]');
    await page.waitForFunction(() => !document.querySelector('#time-scale option[value="2"]'));
    await page.keyboard.press("Space");
    await page.waitForSelector("#step:enabled");
    assert.ok((await viewer.worlds())[0]!.paused);
    await page.click("#ahead");
    await told(/^1\.0 \//);
    await page.click("#back");
    await told(/^0\.0 \//);
    await unfold("Share");
    const ids = await page
      .locator("#panel button:visible, #timeline button:visible")
      .evaluateAll((all) => all.map(({ id }) => id));
    for (const id of ids) await page.$eval(`#${id}`, (button) => (button as HTMLElement).click());
    for (const key of ["t", "a", "n", "u", "c", "p", "s", "Delete", "v"]) await page.keyboard.press(key);
    await told(/ \/ 1\.0 s$/);
    assert.ok(ids.includes("step") && ids.includes("save-scene"), ids.join());
    assert.equal(await page.locator("#effect .refused").count(), 0, await page.innerText("#effect"));
    assert.deepEqual(complaints, []);
  } finally {
    viewer.close();
    await player.kill();
    await rm(folder, { recursive: true });
  }
});
