// The real page in a real browser (Debian's Chromium, drawing in software) on a real server; what it does to the world is
// asked of the server by another client.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { promisify } from "node:util";
import type { Applied, Frame } from "../../src/index.js";
import { Frames } from "../frames.js";
import { clientProgram, serverProgram } from "../server.js";
import {
  asked,
  client,
  colours,
  complaints,
  page,
  pastTick,
  restartServer,
  said,
  server,
  shownTick,
  standStill,
  test,
  unfold,
  until,
  usePage,
  world,
} from "./set_up.js";

usePage();

function centreX({ positions }: Frame): number {
  const points = positions[0]!;
  let sum = 0;
  for (let i = 0; i < points.length; i += 3) sum += points[i]!;
  return (3 * sum) / points.length;
}

/** Where `pneuma`, over TCP, finds the ball. */
async function serverX(): Promise<number> {
  const asked = ["--server", server.tcp, "--json", "watch", world, "--frames", "1"];
  const { stdout } = await promisify(execFile)(clientProgram, asked);
  const frame = stdout.split("\n").find((line) => line.includes('"type":"frame"'));
  return (JSON.parse(frame!) as { bodies: { centre: number[] }[] }).bodies[0]!.centre[0]!;
}

/** Where the picture shows the ball: in the middle of what the panel leaves free, once it is framed. */
async function ballPlace(): Promise<{ x: number; y: number }> {
  await page.click("#frame-all");
  const panel = (await (await page.$("#panel"))!.boundingBox())!;
  return { x: panel.x / 2, y: 300 };
}

test("frames arrive, the picture changes, and nothing is complained about", async () => {
  await page.evaluate(() => {
    for (const each of document.querySelectorAll<HTMLElement>("header, #panel")) each.style.visibility = "hidden";
  });
  await client.reset(world); // a ball that has come to rest is the same picture again
  const first = await page.screenshot();
  assert.ok((await colours(first)) > 10, "the canvas is blank");
  await until(async () => !first.equals(await page.screenshot()));
  assert.deepEqual(complaints, []);
  assert.equal(await page.$eval("#world", (select) => (select as HTMLSelectElement).value), world);
});

test("a ball that is dragged moves on the server", async () => {
  const frames = new Frames();
  await client.subscribe(world, {}, frames);
  await standStill();
  const { x, y } = await ballPlace();
  let isGrabbed: () => void;
  const grabbed = new Promise<void>((resolve) => (isGrabbed = resolve));
  const applied = ({ command }: Applied) => {
    if (command?.request.case === "grab") isGrabbed();
  };
  await client.subscribe(world, { commands: true, maxErrorM: 0.01 }, { frame: () => {}, applied });
  await page.mouse.move(x, y);
  await page.mouse.down();
  await client.resume(world);
  await grabbed;
  const start = centreX(await frames.next());
  const xBefore = await serverX();
  for (let way = 0; way < 150; way += 10) await page.mouse.move(x + way, y - 50);
  await frames.next((frame) => centreX(frame) > start + 0.2);
  assert.ok((await serverX()) > xBefore + 0.1);
  await page.mouse.up();
});

test("a slider changes the gas, and the page says from which tick on", async () => {
  const before = (await client.stats(world)).softBodies[0]!.moles;
  await page.waitForSelector("#gas:enabled");
  await page.fill("#gas", "1");
  await said(/In effect from tick \d+/);
  const { moles } = (await client.stats(world)).softBodies[0]!;
  assert.ok(Math.abs(moles / before - 2) < 0.05, `${before} mol, then ${moles}`);
});

test("a paused world is shown as paused, and steps by the keyboard", async () => {
  await page.keyboard.press("Space");
  await page.waitForSelector("#step:enabled");
  assert.ok((await client.stats(world)).paused);
  const tick = await shownTick();
  await page.keyboard.press(".");
  await pastTick(tick);
});

test("of two quick changes of world the second is shown, and it alone is subscribed to", async () => {
  await client.createWorld({ name: "last", source: { case: "builtin", value: "hanging-ball" } });
  await page.evaluate(() => {
    const { send } = WebSocket.prototype;
    WebSocket.prototype.send = function (data) {
      send.call(this, data);
      if (!new TextDecoder().decode(data as Uint8Array<ArrayBuffer>).includes("five-balls")) return;
      WebSocket.prototype.send = send;
      location.hash = "#world=last"; // while the page waits for the first
    };
    location.hash = "#world=five-balls";
  });
  await page.waitForFunction(() => document.title.startsWith("last"));
  assert.equal(await page.$eval("#world", (select) => (select as HTMLSelectElement).value), "last");
  const subscribers = (await client.worlds()).map(({ name, subscribers }) => `${name} ${subscribers}`);
  assert.deepEqual(subscribers.sort(), [`${world} 0`, "five-balls 0", "last 1"]);
});

test("keys work after a control was clicked", async () => {
  await standStill();
  await page.click("#wireframe");
  await page.keyboard.press("r");
  await page.waitForFunction(() => document.getElementById("status")!.dataset["time"] === "0.0");
  await client.resume(world);
  await page.waitForSelector("#step:disabled");
  await page.focus("#pause");
  await page.keyboard.press("Space"); // once: by the button alone
  await page.waitForSelector("#step:enabled");
});

test("keys do nothing behind a dialog, and a reset that ends what could be undone asks first", async () => {
  await page.waitForSelector("#gravity:enabled");
  await page.fill("#gravity", "3");
  await page.waitForSelector("#undo:enabled");
  await page.keyboard.press("r");
  await page.waitForSelector("#reset-confirm[open]");
  await page.focus("#reset-no");
  await page.keyboard.press("g");
  assert.ok(!(await page.isVisible("#gallery")));
  await page.click("#reset-no");
  assert.equal((await client.scene(world)).gravity?.y, -3);
  await page.keyboard.press("r");
  await page.click("#reset-yes");
  await page.waitForSelector("#undo:disabled");
  await page.waitForFunction(() => (document.getElementById("gravity") as HTMLInputElement).value === "9.8");
});

test("a lost connection is told of, and comes back", async () => {
  await restartServer(async () => {
    await page.waitForSelector("body.lost");
    assert.match((await page.textContent("#notice"))!, /Reconnecting/);
  });
  await page.waitForSelector("body:not(.lost)");
  await page.waitForSelector("#notice", { state: "hidden" });
});

test("a server that asks for a token after it was restarted is given one", async () => {
  await restartServer(async () => {}, "secret-of-this-test");
  await page.waitForSelector("#sign-in:not([hidden])");
  const tick = await shownTick();
  await page.fill("#token", "secret-of-this-test");
  await page.click("#sign-in button");
  await page.waitForSelector("body:not(.lost)");
  await page.waitForFunction((last) => Number(document.getElementById("status")!.dataset["tick"]) !== last, tick);
  assert.ok(!(await page.isVisible("#sign-in")));
});

test("who may only look gets no controls that change anything", async () => {
  const folder = await mkdtemp(join(tmpdir(), "pneuma-page-"));
  const tokens = join(folder, "tokens");
  const made = await promisify(execFile)(serverProgram, ["token", "new", "--tokens", tokens, "--role", "view"]);
  await restartServer(async () => {}, undefined, ["--tokens", tokens]);
  await page.waitForSelector("#sign-in:not([hidden])");
  await page.fill("#token", made.stdout.trim());
  await page.click("#sign-in button");
  await page.waitForSelector("body:not(.lost):not(.may-edit)");
  await page.waitForSelector("#frame-all", { state: "visible" });
  for (const id of ["pause", "reset", "undo", "time-scale", "tool-poke", "throw", "gravity", "add", "upload-open"]) {
    assert.ok(!(await page.isVisible(`#${id}`)), id);
  }
  assert.ok(!(await page.isVisible("#new-world-open")));
  await unfold("Share");
  assert.ok(await page.isVisible("#record"));
  await page.click("#show-scene");
  await page.waitForFunction(() =>
    (document.getElementById("scene-text") as HTMLTextAreaElement).value.includes("ball"),
  );
  assert.ok(await page.$eval("#scene-text", (text) => (text as HTMLTextAreaElement).readOnly));
  assert.match(await page.innerText("#scene-note"), /^Your token may look at this world/);
  assert.ok(!(await page.isVisible("#scene-apply")) && !(await page.isVisible("#scene-new")));
  await page.click("#show-scene");
  asked.length = 0;
  for (const key of ["Space", "r", "t", "a", "n", "Delete"]) await page.keyboard.press(key);
  await page.mouse.click(400, 300);
  await pastTick(await shownTick());
  const harmless = ["listWorlds", "getStats", "getScene", "subscribe", "unsubscribe", "pong"];
  assert.deepEqual(
    asked.map(({ case: kind }) => kind).filter((kind) => !harmless.includes(kind!)),
    [],
  );
  await rm(folder, { recursive: true });
});

test("on a phone the world comes first, its controls at a touch", async () => {
  await page.setViewportSize({ width: 390, height: 780 });
  await page.reload();
  await page.waitForSelector("#status[data-tick]");
  assert.ok(!(await page.isVisible("#pause")));
  await page.click("#show-gallery");
  await page.click("#show-panel"); // in the place of the sheet that was open
  assert.ok(!(await page.isVisible("#gallery")));
  const small = await page.$$eval("button, select, input[type=range]", (controls) =>
    controls
      .filter((control) => control.clientHeight > 0 && control.getBoundingClientRect().height < 44)
      .map(({ id }) => id),
  );
  assert.deepEqual(small, [], "too small for a finger");
  await page.click("#pause");
  await page.waitForSelector("#step:enabled");
});

test("what was said goes, and a world that began again is told of once the connection is back", async () => {
  await page.waitForSelector("#gas:enabled");
  await page.fill("#gas", "1");
  await said(/In effect/);
  await pastTick(60);
  await restartServer(async () => {
    await page.waitForSelector("body.lost");
    assert.equal(await page.locator("#effect p").count(), 0);
    assert.ok(await page.$eval("#pause", (button) => button.closest("[inert]") !== null));
    await page.keyboard.press("r");
  });
  await said(/The world began again/);
  await page.waitForSelector("#effect p", { state: "detached" });
  assert.ok(await page.$eval("#pause", (button) => button.closest("[inert]") === null));
  assert.deepEqual(
    asked.filter(({ case: kind }) => kind === "reset"),
    [],
  );
});

test("a token that is wrong is refused at the form, in the page's words", async () => {
  await restartServer(async () => {}, "right");
  await page.waitForSelector("#sign-in:not([hidden])");
  await page.fill("#token", "wrong");
  await page.click("#sign-in button");
  await page.waitForSelector("#token-refusal:not(:empty)");
  assert.match((await page.textContent("#token-refusal"))!, /^The server does not know this token/);
  assert.ok(!(await page.isVisible("#notice")));
  await page.fill("#token", "right");
  await page.click("#sign-in button");
  await page.waitForSelector("body:not(.lost)");
});
