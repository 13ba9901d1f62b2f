// What the page's tests share: Debian's Chromium, drawing in software, with the page on a real server, and another client.
import { after, afterEach, before, beforeEach, test as unlimited } from "node:test";
import { type Browser, chromium, type Page } from "playwright-core";
import { fromBinary } from "@bufbuild/protobuf";
import { type ClientMessage, ClientMessageSchema } from "../../proto/pneuma/v1/session_pb.js";
import { Client } from "../../src/index.js";
import { Server } from "../server.js";

export const world = "bouncing-ball";
const patienceMs = 60_000;
const testLimitMs = 90_000;

// At half a pixel a unit of its size: four times as many pictures are drawn in software, and clicks wait for pictures.
const window = { viewport: { width: 800, height: 600 }, deviceScaleFactor: 0.5 };

export let browser: Browser;
export let server: Server;
export let client: Client;
export let page: Page;
/** Errors that the page threw or wrote to its console. */
export let complaints: string[];
/** What the page asked of the server. */
export let asked: ClientMessage["request"][];

/** A test as node has them, that fails where it takes too long. */
export function test(name: string, run: () => Promise<void>): void {
  unlimited(name, { timeout: testLimitMs }, run);
}

/** Before each of a file's tests: a server with `world` and five-balls, a client of it, and the page, which shows `world`. */
export function usePage(): void {
  const hookLimit = { timeout: testLimitMs };
  before(async () => {
    browser = await chromium.launch({
      executablePath: "/usr/bin/chromium",
      args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
    });
  }, hookLimit);
  after(() => browser.close(), hookLimit);
  beforeEach(async () => {
    server = await Server.start(["--scene", world, "--scene", "five-balls"]);
    client = await Client.connect(server.url);
    page = await browser.newPage(window);
    page.setDefaultTimeout(patienceMs);
    complaints = [];
    page.on("pageerror", (error) => complaints.push(error.message));
    page.on("console", (message) => message.type() === "error" && complaints.push(message.text()));
    await page.addInitScript(noteWhatIsSaid);
    await page.addInitScript(beSlow);
    await page.addInitScript(drawSeldom);
    asked = [];
    page.on("websocket", (socket) => {
      socket.on("framesent", ({ payload }) => asked.push(fromBinary(ClientMessageSchema, payload as Buffer).request));
    });
    await open(page);
  }, hookLimit);
  afterEach(async () => {
    await page.close();
    client.close();
    await server.kill();
  }, hookLimit);
}

/** Ends the server, as a crash would; another begins at its address, when `meanwhile` is done. */
export async function restartServer(
  meanwhile: () => Promise<unknown>,
  token?: string,
  flags: readonly string[] = [],
): Promise<void> {
  const { http } = server;
  await server.kill();
  await meanwhile();
  server = await Server.start(["--scene", world, "--http", http, ...flags], token);
}

/** In the page: has it know that shadows are slow here. Else each test waits for the shaders of all their qualities. */
function beSlow(): void {
  try {
    sessionStorage.setItem("pneuma-shadows", "none");
  } catch {
    // A page that may keep nothing begins with the best.
  }
}

/** In the page: leaves time between two pictures. Drawn in software, they would take every core from the test itself. */
function drawSeldom(): void {
  const restMs = 60;
  const draw = requestAnimationFrame;
  globalThis.requestAnimationFrame = (callback) => Number(setTimeout(() => draw(callback), restMs));
}

/** In the page: notes each message, however soon another takes its place. */
function noteWhatIsSaid(): void {
  const messages: string[] = [];
  Object.assign(globalThis, { messages });
  const line = "#effect";
  new MutationObserver((records) => {
    for (const { target, addedNodes } of records) {
      const element = target instanceof Element ? target : target.parentElement;
      if (!element?.closest(line)) continue;
      messages.push(...[...addedNodes].map(({ textContent }) => textContent ?? ""));
    }
  }).observe(document, { subtree: true, childList: true });
}

/** Waits until the page has said so since it was loaded; what it says may be gone by then. */
export async function said(pattern: RegExp): Promise<void> {
  await page.waitForFunction((source) => {
    const { messages } = globalThis as unknown as { messages: string[] };
    return messages.some((text) => new RegExp(source).test(text));
  }, pattern.source);
}

/** What the address says behind its #, as the page has it: playwright's own is told of it later. */
export function hash(of: Page = page): Promise<string> {
  return of.evaluate(() => location.hash);
}

/** Shows the world, and waits until a frame of it has come. */
export async function open(on: Page): Promise<void> {
  await on.goto(`http://${server.http}/#world=${world}`);
  await on.waitForSelector("#status[data-tick]");
}

/** Opens a group of the panel, where its controls are. */
export async function unfold(summary: string, on: Page = page): Promise<void> {
  await on.$$eval(
    "#panel details",
    (groups, text) => {
      for (const group of groups) {
        if (group.querySelector("summary")!.textContent === text) (group as HTMLDetailsElement).open = true;
      }
    },
    summary,
  );
}

/** Waits until what is asked for again and again is so. */
export async function until(isSo: () => Promise<boolean>): Promise<void> {
  const limitMs = performance.now() + patienceMs;
  while (!(await isSo())) {
    if (performance.now() > limitMs) throw new Error(`not so in ${patienceMs / 1000} s: ${isSo}`);
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
}

/** Pauses the world, and waits until the picture has come to its last tick: what is framed then stays where it is. */
export async function standStill(): Promise<void> {
  await client.pause(world);
  const { tick } = await client.stats(world);
  await page.waitForFunction(
    (last) => Number(document.getElementById("status")!.dataset["shown"]) >= last,
    Number(tick),
  );
}

/** Waits until the page has a frame past this tick. */
export async function pastTick(tick: number): Promise<void> {
  await page.waitForFunction((least) => Number(document.getElementById("status")!.dataset["tick"]) > least, tick);
}

export function shownTick(): Promise<number> {
  return page.$eval("#status", (status) => Number(status.dataset["tick"]));
}

/** How many colours are in a picture, as the browser reads it. */
export function colours(png: Buffer): Promise<number> {
  return page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const picture = await createImageBitmap(new Blob([bytes]));
    const context = new OffscreenCanvas(picture.width, picture.height).getContext("2d")!;
    context.drawImage(picture, 0, 0);
    return new Set(new Uint32Array(context.getImageData(0, 0, picture.width, picture.height).data.buffer)).size;
  }, png.toString("base64"));
}
