// Takes the pictures of the documents from the page itself, in Debian's Chromium: light and dark, and the stills of the
// moving one. The world is stepped between two stills, so that a slow machine takes the same pictures as a fast one.
import { mkdir } from "node:fs/promises";
import { join } from "node:path";
import { type Browser, chromium, type Page } from "playwright-core";
import { Client } from "../src/index.js";
import { Server } from "../tests/server.js";

const world = "hero";
const startTick = 240; // by then its bodies lie in each other's way
const stills = 90;
const ticksAStill = 4; // at 60 Hz, 15 pictures a second
const pull = { from: 30, to: 60 }; // of the stills
const settledMs = 500;

interface Look {
  readonly size: { readonly width: number; readonly height: number };
  readonly colorScheme: "light" | "dark";
}

const [folder] = process.argv.slice(2);
if (folder === undefined) throw new Error("usage: take.js FOLDER");
await mkdir(join(folder, "stills"), { recursive: true });

/** Runs in the page, before its own scripts: by the page's clock a slow machine draws as often as a fast one. */
function drawInTime(): void {
  const pictureMs = 1_000 / 60;
  let nowMs = performance.now();
  performance.now = () => nowMs;
  const request = globalThis.requestAnimationFrame.bind(globalThis);
  globalThis.requestAnimationFrame = (draw) => request(() => draw((nowMs += pictureMs)));
}

async function open(browser: Browser, server: Server, { size, colorScheme }: Look): Promise<Page> {
  const page = await browser.newPage({ viewport: size, colorScheme, deviceScaleFactor: 1 });
  await page.addInitScript(drawInTime);
  await page.goto(`http://${server.http}/#world=${world}`);
  await page.waitForSelector("#status[data-tick]");
  // It tells of the machine that takes the picture.
  await page.$eval("#status", (status) => ((status as HTMLElement).style.display = "none"));
  return page;
}

/** Where a body is drawn, near the middle of the canvas: the first point whose neighbours are of the same body. */
async function bodyPoint(page: Page): Promise<{ x: number; y: number; reach: number }> {
  const picture = (await page.screenshot()).toString("base64");
  return page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes]));
    const context = new OffscreenCanvas(image.width, image.height).getContext("2d")!;
    context.drawImage(image, 0, 0);
    const { left, top, width, height } = document.querySelector("canvas")!.getBoundingClientRect();
    const reach = Math.min(width, height) / 4;
    /** What tells the colours of two bodies apart; NaN: a grey, as of walls and paper. */
    const hue = (x: number, y: number) => {
      const [red, green, blue] = context.getImageData(x, y, 1, 1).data as unknown as [number, number, number];
      const range = Math.max(red, green, blue) - Math.min(red, green, blue);
      return range > 90 ? (green - blue) / range : NaN;
    };
    const isLike = (x: number, y: number, wanted: number) => Math.abs(hue(x, y) - wanted) < 0.3;
    const around = [-20, 0, 20];
    for (let far = 0; far < 2 * reach; far += 4) {
      for (let turn = 0; turn < 2 * Math.PI; turn += 0.3) {
        const x = left + width / 2 + far * Math.cos(turn);
        const y = top + height / 2 + far * Math.sin(turn);
        if (around.every((dx) => around.every((dy) => isLike(x + dx, y + dy, hue(x, y))))) return { x, y, reach };
      }
    }
    throw new Error("no body is near the middle");
  }, picture);
}

/** Waits until the page shows this tick. */
async function shows(page: Page, tick: number): Promise<void> {
  await page.waitForFunction((wanted) => Number(document.getElementById("status")!.dataset["shown"]) >= wanted, tick);
  await page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
}

/** Takes the stills of a drag of what is in the middle, up and to the side and back. */
async function film(page: Page, client: Client, size: Look["size"], to: string): Promise<void> {
  let tick = startTick;
  let body = { x: 0, y: 0, reach: 0 };
  for (let still = 0; still < stills; ++still) {
    if (still === pull.from) {
      body = await bodyPoint(page);
      await page.mouse.move(body.x, body.y);
      await page.mouse.down();
    }
    if (still > pull.from && still < pull.to) {
      const turn = (2 * Math.PI * (still - pull.from)) / (pull.to - pull.from);
      await page.mouse.move(body.x + body.reach * Math.sin(turn), body.y - 1.5 * body.reach * Math.sin(turn / 2));
    }
    if (still === pull.to) await page.mouse.up();
    tick += ticksAStill;
    await client.step(world, ticksAStill);
    await shows(page, tick);
    await page.screenshot({ path: join(to, `${String(still).padStart(3, "0")}.png`), clip: { x: 0, y: 0, ...size } });
  }
}

const server = await Server.start(["--scene", world]);
const browser = await chromium.launch({
  executablePath: "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
try {
  const client = await Client.connect(server.url);
  await client.pause(world);
  const { tick } = await client.stats(world);
  await client.step(world, startTick - Number(tick));
  for (const [name, look] of Object.entries<Look>({
    "page.png": { size: { width: 1_000, height: 640 }, colorScheme: "light" },
    "page-dark.png": { size: { width: 1_000, height: 640 }, colorScheme: "dark" },
  })) {
    const page = await open(browser, server, look);
    await shows(page, startTick);
    await new Promise((resolve) => setTimeout(resolve, settledMs)); // the view comes nearer
    await page.screenshot({ path: join(folder, name) });
    await page.close();
  }
  const size = { width: 600, height: 480 }; // as on a narrow screen: the controls are closed
  const page = await open(browser, server, { size, colorScheme: "light" });
  await shows(page, startTick);
  await new Promise((resolve) => setTimeout(resolve, settledMs));
  await film(page, client, size, join(folder, "stills"));
  client.close();
} finally {
  await browser.close();
  await server.kill();
}
