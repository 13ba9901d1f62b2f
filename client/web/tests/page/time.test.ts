// The timeline in a real browser: the past of a world that runs, and a recording that `pneuma play` serves.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { mkdtemp, readdir, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { promisify } from "node:util";
import { Client, readRecording, Recorder } from "../../src/index.js";
import { Frames } from "../frames.js";
import { clientProgram, Server } from "../server.js";
import {
  asked,
  client,
  complaints,
  page,
  pastTick,
  said,
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
  try {
    await page.waitForFunction(
      (source) => new RegExp(source).test((document.getElementById("moment-told") as HTMLOutputElement).value),
      pattern.source,
    );
  } catch (error) {
    const says = await page.$eval("#moment-told", (output) => (output as HTMLOutputElement).value);
    throw new Error(`the timeline says "${says}", not ${pattern}`, { cause: error });
  }
}

/** Waits until the selected body's card says so. */
async function cardTells(pattern: RegExp): Promise<void> {
  await page.waitForFunction(
    (source) => new RegExp(source).test(document.getElementById("card")!.innerText.replaceAll(/\s+/g, " ")),
    pattern.source,
  );
}

/** Waits until so many pictures have begun to be drawn. */
async function pictures(count: number): Promise<void> {
  await page.evaluate(async (wanted) => {
    for (let i = 0; i < wanted; ++i) await new Promise((resolve) => requestAnimationFrame(resolve));
  }, count);
}

/** Of the first second of `world` and a little more, and what was done to it. */
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
  // A page that is too slow for its frames is not told of all that is done.
  await until(async () => {
    await client.impulse(world, { body: "ball", impulse: { y: 0.2 } });
    return (await page.locator("#marks .deed").count()) > 0;
  });
  await page.waitForFunction(() => / s ago\s*ball was hit/.test(document.getElementById("lately")!.textContent!));
  await pastTick((await shownTick()) + 90);
  // Of the moment of the key: a lagging page goes on for a while before it.
  const tickAtKey = await page.evaluateHandle(() => {
    const noted = { tick: NaN };
    const note = () => (noted.tick = Number(document.getElementById("status")!.dataset["tick"]));
    addEventListener("keydown", note, { once: true, capture: true });
    return noted;
  });
  await page.keyboard.press("[");
  const before = await tickAtKey.evaluate(({ tick }) => tick);
  await told(/^\d+\.\d s ago$/);
  await pictures(2);
  await until(async () => (await drawnTick()) < before - 30);
  const drawn = await drawnTick();
  await pastTick((await shownTick()) + 30);
  assert.equal(await drawnTick(), drawn, "it stands still while the world goes on");
  await told(/^([2-9]|\d\d+)\.\d s ago$/); // and is longer ago
  await page.selectOption("#selected", "ball");
  await cardTells(/^When \d+\.\d s ago Mass .* kg Volume .* m³ Gas – .*Place, m .*Speed .* m\/s/);
  await page.mouse.move(260, 300);
  await page.mouse.down();
  await page.mouse.move(300, 260);
  await page.mouse.up();
  assert.ok(!asked.some(({ case: kind }) => kind === "grab"), "the past was pulled at");
  assert.ok(!asked.some(({ case: kind }) => kind === "seek"), "a world that runs was taken for a recording");
  await page.focus("#moment");
  await page.keyboard.press("Home"); // as far back as there is something
  await until(async () => (await drawnTick()) < drawn);
  await page.keyboard.press("b");
  await told(/^now$/);
  await until(async () => (await drawnTick()) > before);
  await cardTells(/^Mass .* Gas .* mol /);
  assert.deepEqual(complaints, []);
});

test("a recording is gone through by its timeline, and has no control that it refuses", async () => {
  const folder = await mkdtemp(join(tmpdir(), "pneuma-page-"));
  const file = join(folder, "w.pneuma");
  await writeFile(file, await record());
  const player = await Server.play(file, ["--speed", "2", "--paused"]);
  const viewer = await Client.connect(player.url);
  try {
    await viewer.seek(world, 0.7);
    await page.goto("about:blank");
    await page.goto(`http://${player.http}/`);
    await page.waitForSelector('#play[aria-label="Play"]');
    await told(/^0\.7 \//); // it is left where it was
    assert.ok(!asked.some(({ case: kind }) => kind === "seek"));
    await page.selectOption("#selected", "ball");
    await cardTells(/Volume .* m³ Gas not recorded Over-pressure .* Pa.* Place, m .*Kinetic energy .* J/);
    await page.fill("#moment", "0.5");
    await told(/^0\.5 \//);
    await page.fill("#moment", "0");
    await told(/^0\.0 \//);
    await page.click("#play"); // at twice its speed, which cannot be asked for
    await told(/^(\d+\.\d) \/ \1 s$/);
    await page.waitForSelector('#play[aria-label="Play"]');
    assert.ok(await page.isDisabled("#step"), "there is nothing behind the end");
    await page.selectOption("#time-scale", "0.125");
    await page.waitForTimeout(2500); // it stays chosen, however often the page asks how fast it goes
    await page.click("#play");
    await page.waitForSelector('#play[aria-label="Pause"]');
    await page.waitForFunction(() => !document.querySelector('#time-scale option[value="2"]'));
    await page.waitForSelector("#marks .deed", { state: "attached" });
    await page.keyboard.press("Space");
    await page.waitForSelector("#step:enabled");
    assert.ok((await viewer.worlds())[0]!.paused);
    await page.click("#ahead");
    await told(/^[1-9]/);
    await page.click("#back");
    await told(/^0/);
    await unfold("Share");
    const ids = await page
      .locator("#panel button:visible, #timeline button:visible")
      .evaluateAll((all) => all.map(({ id }) => id));
    for (const id of ids) await page.$eval(`#${id}`, (button) => (button as HTMLElement).click());
    for (const key of ["t", "a", "n", "u", "c", "p", "s", "Delete", "v"]) await page.keyboard.press(key);
    await told(/ \/ \d+\.\d s$/);
    assert.ok(ids.includes("step") && ids.includes("save-scene"), ids.join());
    assert.equal(await page.locator("#effect .refused").count(), 0, await page.innerText("#effect"));
    assert.deepEqual(complaints, []);
  } finally {
    viewer.close();
    await player.kill();
    await rm(folder, { recursive: true });
  }
});

function lately(): Promise<string> {
  return page.$eval("#lately", ({ textContent }) => textContent ?? "");
}

/** What the browser saves by an action, in `folder`. */
async function saved(folder: string, action: () => Promise<unknown>): Promise<string> {
  const [download] = await Promise.all([page.waitForEvent("download"), action()]);
  const file = join(folder, download.suggestedFilename());
  await download.saveAs(file);
  return file;
}

test("what the page recorded is exported, filmed, and a page of its own that opens without a server", async () => {
  const folder = await mkdtemp(join(tmpdir(), "pneuma-page-"));
  await unfold("Share");
  await page.click("#record");
  await page.waitForSelector("#record.recording");
  await page.keyboard.press("m");
  await page.waitForSelector("#film.recording");
  await client.impulse(world, { body: "ball", impulse: { y: 1 } });
  await pastTick((await shownTick()) + 90);
  const film = await saved(folder, () => page.keyboard.press("m"));
  assert.equal((await readFile(film)).readUInt32BE(0), 0x1a45dfa3, "what every WebM begins with");
  const recording = await saved(folder, () => page.click("#record"));
  await promisify(execFile)(clientProgram, ["export", recording, "--format", "obj", "--out", join(folder, "frames")]);
  await said(/recording is saved: [1-9]\d* frames/);
  const frames = await page.evaluate(() => {
    const { messages } = globalThis as unknown as { messages: string[] };
    return Number(/is saved: (\d+) frames/.exec(messages.join())![1]);
  });
  // A slow page is sent fewer than there were ticks, and each tick is exported.
  assert.ok((await readdir(join(folder, "frames"))).length >= frames);

  const html = await saved(folder, () => page.setInputFiles("#one-file", recording));
  await server.kill();
  const requests: string[] = [];
  page.on("request", (request) => requests.push(request.url()));
  await page.goto(`file://${html}`);
  await page.waitForSelector("#status[data-shown]");
  assert.ok((await page.locator("#marks .key").count()) >= 2);
  assert.equal(await page.locator("#marks .deed").count(), 1);
  const speeds = await page.$$eval("#time-scale option", (options) =>
    options.map((option) => Number((option as HTMLOptionElement).value)),
  );
  assert.deepEqual(speeds, [4, 2, 1, 0.5, 0.25, 0.125]);
  await page.selectOption("#time-scale", "4");
  await page.waitForSelector('#play[aria-label="Play"]'); // it is over
  assert.match(await lately(), /ball was hit/);
  const last = await drawnTick();
  await page.keyboard.press("Space");
  await page.keyboard.press("Space");
  await page.fill("#moment", "0");
  await until(async () => (await drawnTick()) < last - 60);
  await page.waitForFunction(() => document.getElementById("lately")!.textContent === ""); // it is not there yet
  assert.ok(!(await page.isVisible("#gravity")) && !(await page.isVisible("#show-gallery")));
  await page.keyboard.press("e");
  await page.waitForFunction(() =>
    (document.getElementById("scene-text") as HTMLTextAreaElement).value.includes("ball"),
  );
  assert.ok(await page.$eval("#scene-text", (text) => (text as HTMLTextAreaElement).readOnly));
  assert.equal(await page.innerText("#scene-note"), "A recording cannot be changed.");
  assert.ok(!(await page.isVisible("#scene-apply")) && !(await page.isVisible("#scene-new")));
  assert.deepEqual(
    requests.filter((url) => !/^(file|data|blob):/.test(url)),
    [],
  );
  assert.deepEqual(complaints, []);
  await rm(folder, { recursive: true });
});

test("a recording whose page cannot be made, since the server is gone, is saved as it is", async () => {
  const folder = await mkdtemp(join(tmpdir(), "pneuma-page-"));
  await unfold("Share");
  await page.selectOption("#record-as", "html");
  await page.click("#record");
  await page.waitForSelector("#record.recording");
  await pastTick((await shownTick()) + 30);
  const recording = await saved(folder, () => server.kill()); // which has the page's parts
  assert.match(recording, /\.pneuma$/);
  assert.ok(readRecording(await readFile(recording)).frames.length > 0);
  await said(/page cannot be made: .* The recording itself is saved/);
  await rm(folder, { recursive: true });
});
