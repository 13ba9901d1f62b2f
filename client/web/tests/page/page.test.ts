// The real page in a real browser (Debian's Chromium, drawing in software) on a real server; what it does to the world is
// asked of the server by another client.
import assert from "node:assert/strict";
import { after, afterEach, before, beforeEach, test } from "node:test";
import { type Browser, chromium, type Page } from "playwright-core";
import { type Applied, Client, type Frame } from "../../src/index.js";
import { Frames } from "../frames.js";
import { Server } from "../server.js";

const world = "bouncing-ball";
const patienceMs = 60_000;

let browser: Browser;
let server: Server;
let client: Client;
let page: Page;
let complaints: string[];

before(async () => {
  browser = await chromium.launch({
    executablePath: "/usr/bin/chromium",
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
  });
});
after(() => browser.close());

beforeEach(async () => {
  server = await Server.start(["--scene", world, "--scene", "five-balls"]);
  client = await Client.connect(server.url);
  page = await browser.newPage({ viewport: { width: 800, height: 600 } });
  page.setDefaultTimeout(patienceMs);
  complaints = [];
  page.on("pageerror", (error) => complaints.push(error.message));
  page.on("console", (message) => message.type() === "error" && complaints.push(message.text()));
  await open(page);
});
afterEach(async () => {
  await page.close();
  client.close();
  await server.kill();
});

/** Shows the world, and waits until a frame of it has come. */
async function open(on: Page): Promise<void> {
  await on.goto(`http://${server.http}/#world=${world}`);
  await on.waitForSelector("#status[data-tick]");
}

/** Waits until the page has a frame past this tick. */
async function pastTick(tick: number): Promise<void> {
  await page.waitForFunction((least) => Number(document.getElementById("status")!.dataset["tick"]) > least, tick);
}

function shownTick(): Promise<number> {
  return page.$eval("#status", (status) => Number(status.dataset["tick"]));
}

function centreX({ positions }: Frame): number {
  const points = positions[0]!;
  let sum = 0;
  for (let i = 0; i < points.length; i += 3) sum += points[i]!;
  return (3 * sum) / points.length;
}

/** Where the picture shows the ball: in the middle of what the panel leaves free, once it is framed. */
async function ballPlace(): Promise<{ x: number; y: number }> {
  await page.click("#frame-all");
  const panel = (await (await page.$("#panel"))!.boundingBox())!;
  return { x: panel.x / 2, y: 300 };
}

/** How many colours are in a picture, as the browser reads it. */
function colours(png: Buffer): Promise<number> {
  return page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const picture = await createImageBitmap(new Blob([bytes]));
    const context = new OffscreenCanvas(picture.width, picture.height).getContext("2d")!;
    context.drawImage(picture, 0, 0);
    return new Set(new Uint32Array(context.getImageData(0, 0, picture.width, picture.height).data.buffer)).size;
  }, png.toString("base64"));
}

test("frames arrive, the picture changes, and nothing is complained about", async () => {
  await page.evaluate(() => {
    for (const each of document.querySelectorAll<HTMLElement>("header, #panel")) each.style.visibility = "hidden";
  });
  const first = await page.screenshot();
  assert.ok((await colours(first)) > 10, "the canvas is blank");
  await pastTick((await shownTick()) + 30);
  assert.ok(!first.equals(await page.screenshot()));
  assert.deepEqual(complaints, []);
  assert.equal(await page.$eval("#world", (select) => (select as HTMLSelectElement).value), world);
});

test("a ball that is dragged moves on the server", async () => {
  const frames = new Frames();
  await client.subscribe(world, {}, frames);
  await client.pause(world);
  const { x, y } = await ballPlace();
  await page.waitForFunction(() => document.getElementById("pause")!.textContent === "Resume");
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
  for (let way = 0; way < 150; way += 10) await page.mouse.move(x + way, y - 50);
  await frames.next((frame) => centreX(frame) > start + 0.2);
  await page.mouse.up();
});

test("a slider changes the gas, and the page says from which tick on", async () => {
  const before = (await client.stats(world)).softBodies[0]!.moles;
  await page.waitForSelector("#gas:enabled");
  await page.fill("#gas", "1");
  await page.waitForFunction(() => /tick \d+/.test(document.getElementById("effect")!.textContent!));
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
    location.hash = "#world=five-balls";
    setTimeout(() => (location.hash = "#world=last"), 20); // while the page asks for the first
  });
  await page.waitForFunction(() => document.title.startsWith("last"));
  assert.equal(await page.$eval("#world", (select) => (select as HTMLSelectElement).value), "last");
  const subscribers = (await client.worlds()).map(({ name, subscribers }) => `${name} ${subscribers}`);
  assert.deepEqual(subscribers.sort(), [`${world} 0`, "five-balls 0", "last 1"]);
});

test("keys work after a control was clicked", async () => {
  await page.click("#wireframe");
  await page.keyboard.press("r");
  await page.waitForFunction(() => Number(document.getElementById("status")!.dataset["time"]) < 1);
  await page.focus("#pause");
  await page.keyboard.press("Space"); // once: by the button alone
  await page.waitForSelector("#step:enabled");
});

test("a lost connection is told of, and comes back", async () => {
  const { http } = server;
  await server.kill();
  await page.waitForSelector("body.lost");
  assert.match((await page.textContent("#notice"))!, /Reconnecting/);
  server = await Server.start(["--scene", world, "--http", http]);
  await page.waitForSelector("body:not(.lost)");
  await page.waitForSelector("#notice", { state: "hidden" });
});

test("a server that asks for a token after it was restarted is given one", async () => {
  const { http } = server;
  await server.kill();
  server = await Server.start(["--scene", world, "--http", http], "secret-of-this-test");
  await page.waitForSelector("#sign-in:not([hidden])");
  const tick = await shownTick();
  await page.fill("#token", "secret-of-this-test");
  await page.click("#sign-in button");
  await page.waitForSelector("body:not(.lost)");
  await page.waitForFunction((last) => Number(document.getElementById("status")!.dataset["tick"]) !== last, tick);
  assert.ok(!(await page.isVisible("#sign-in")));
});

test("on a phone the world comes first, its controls at a touch", async () => {
  await page.setViewportSize({ width: 390, height: 780 });
  await page.reload();
  await page.waitForSelector("#status[data-tick]");
  assert.ok(!(await page.isVisible("#pause")));
  await page.click("#panel summary");
  assert.ok(await page.isVisible("#pause"));
});
