// What the real page shows of the worlds of a real server: see page.test.ts for how.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import type { Subscribe } from "../../proto/pneuma/v1/session_pb.js";
import {
  asked,
  client,
  colours,
  complaints,
  hash,
  page,
  pastTick,
  said,
  server,
  shownTick,
  standStill,
  test,
  until,
  usePage,
  world,
} from "./set_up.js";

interface Violation {
  readonly id: string;
  readonly nodes: readonly { readonly html: string }[];
}

/** A ball that hangs in the air without gravity or gas: at rest from the first. */
const stillScene = {
  name: "still",
  meshes: [{ name: "ball", icosphere: { subdivisions: 1 } }],
  softBodies: [{ name: "ball", mesh: "ball", springs: { stiffnessNM: 50, dampingNSM: 0.5 } }],
};

usePage();

/** What the page asked for with its last subscription. */
function subscription(): Subscribe {
  const last = asked.filter(({ case: kind }) => kind === "subscribe").at(-1);
  assert.ok(last?.case === "subscribe");
  return last.value;
}

/** Whether the picture of a world that stands still is another one with a control turned on, and the same again without. */
async function changesPicture(turn: (isOn: boolean) => Promise<unknown>): Promise<void> {
  const picture = () => page.screenshot({ clip: { x: 140, y: 100, width: 260, height: 260 } });
  await until(async () => {
    const before = await picture();
    await turn(true);
    const turned = await picture();
    await turn(false);
    return before.equals(await picture()) && !before.equals(turned);
  });
}

/** Waits until the server counts so many subscribers of each world, the page's own picture among them. */
async function subscribers(wanted: Record<string, number>): Promise<void> {
  await until(async () => {
    const counts = (await client.worlds()).map(({ name, subscribers }) => [name, subscribers]);
    return JSON.stringify(Object.fromEntries(counts.sort())) === JSON.stringify(wanted);
  });
}

test("the gallery shows a picture of each world, by one frame of it, and in cards of one size", async () => {
  await subscribers({ [world]: 1, "five-balls": 0 });
  await client.pause("five-balls"); // its card says so
  await page.click("#show-gallery");
  await page.waitForFunction(() =>
    [...document.querySelectorAll<HTMLCanvasElement>("#cards canvas")].every(
      (canvas) => new Set(canvas.getContext("2d")!.getImageData(0, 0, canvas.width, canvas.height).data).size > 10,
    ),
  );
  await subscribers({ [world]: 1, "five-balls": 0 });
  await page.waitForSelector("#cards small:has-text('paused, 5 bodies')");
  const places = await page.$$eval("#cards a", (cards) =>
    cards.map((card) => {
      const { top, width, height } = card.getBoundingClientRect();
      return [top, width, height].join();
    }),
  );
  assert.deepEqual(new Set(places).size, 1, places.join(" / "));
  const card = page.locator("#cards li", { hasText: "five-balls" });
  assert.ok((await colours(await card.screenshot())) > 10);
  await card.locator("a").click();
  await page.waitForSelector('#cards a[href="#world=five-balls"][aria-current="true"]');
  await page.click("#gallery .close");
  assert.ok(!(await page.isVisible("#gallery")));
  await subscribers({ [world]: 0, "five-balls": 1 });
  assert.deepEqual(complaints, []);
});

test("the card of the world that is shown is in sight, however many worlds there are", async () => {
  await page.setViewportSize({ width: 390, height: 844 });
  for (const name of ["a", "b", "c", "d"])
    await client.createWorld({ name, source: { case: "builtin", value: world } });
  await client.createWorld({ name: "z", source: { case: "builtin", value: "hanging-ball" } });
  await page.click("#show-gallery");
  const isInSight = () =>
    page.waitForFunction(() => {
      const rect = document.querySelector('#cards a[aria-current="true"]')?.getBoundingClientRect();
      return rect !== undefined && rect.left >= 0 && rect.right <= innerWidth;
    });
  await isInSight();
  await page.evaluate(() => (location.hash = "#world=z"));
  await page.waitForSelector('#cards a[href="#world=z"][aria-current="true"]');
  await isInSight();
});

test("the status is one row that is cut off, and leaves its key where it is", async () => {
  const keys = () => page.$eval("#show-keys", (button) => button.getBoundingClientRect().toJSON() as DOMRect);
  await page.setViewportSize({ width: 800, height: 600 });
  const before = await keys();
  const { height, isCut } = await page.$eval("#status", (status) => {
    status.append("much more than there is room for ".repeat(9));
    return { height: status.clientHeight, isCut: status.scrollWidth > status.clientWidth };
  });
  assert.ok(isCut && height < 30, `${height} px high`);
  assert.deepEqual(await keys(), before);
  const panel = await page.$eval("#panel", (each) => each.getBoundingClientRect().top);
  const effect = await page.$eval("#effect", (each) => each.getBoundingClientRect().top);
  const header = await page.$eval("#header", (each) => each.getBoundingClientRect().bottom);
  assert.ok(panel >= header && effect >= header, `${panel} and ${effect}, below ${header}`);
  await page.waitForFunction(() => document.getElementById("status")!.title.startsWith("tick "));
});

test("worlds that come and go are in the gallery without being asked for", async () => {
  await page.click("#show-gallery");
  await client.createWorld({ name: "late", source: { case: "builtin", value: "hanging-ball" } });
  await page.waitForSelector('#cards a[href="#world=late"]');
  await client.destroyWorld("late");
  await page.waitForSelector('#cards a[href="#world=late"]', { state: "detached" });
});

test("without a world in the address a lively one is shown, and the gallery with it", async () => {
  await page.goto("about:blank");
  await page.goto(`http://${server.http}/`);
  await page.waitForFunction(() => document.title.startsWith("five-balls"));
  await page.waitForSelector("#cards canvas");
});

test("the page says that its world is gone, and shows it when it is there again", async () => {
  await client.destroyWorld(world);
  await page.waitForSelector("body.gone");
  assert.match((await page.textContent("#notice"))!, /bouncing-ball.* is gone/);
  await page.waitForFunction(() => document.querySelectorAll("#world option").length === 1);
  await client.createWorld({ name: world, source: { case: "builtin", value: world } });
  await page.waitForSelector("body:not(.gone)");
  await page.waitForSelector("#notice", { state: "hidden" });
});

test("a world that there is not is told of, and nothing of the one before is changed", async () => {
  await page.waitForSelector("#gravity:enabled");
  await page.fill("#gravity", "3");
  await page.waitForSelector("#undo:enabled");
  await page.evaluate(() => (location.hash = "#world=nosuch"));
  await page.waitForSelector("body.gone");
  assert.match((await page.textContent("#notice"))!, /no world .*nosuch/);
  assert.equal(await page.title(), "Pneuma");
  await page.waitForFunction(() => document.getElementById("status")!.textContent!.startsWith("tick –"));
  assert.ok(await page.isVisible("#cards"));
  await page.waitForSelector("#gravity:disabled");
  assert.ok(await page.isDisabled("#undo"));
  assert.equal(await page.inputValue("#selected"), "");
  const edits = asked.filter(({ case: kind }) => kind === "edit").length;
  await page.keyboard.press("t");
  await page.keyboard.press("Control+z");
  await page.click("#show-view"); // the page has dealt with the keys
  assert.equal(asked.filter(({ case: kind }) => kind === "edit").length, edits);
});

test("bodies are coloured by pressure and by strain, with a legend in its unit", async () => {
  await page.click("#show-view");
  await page.check('input[value="pressure"]');
  await page.waitForFunction(() => / k?Pa$/.test(document.getElementById("legend-ends")!.textContent!));
  await page.check('input[value="strain"]');
  await page.waitForFunction(() => /Strain.*against tick \d+/.test(document.getElementById("legend")!.textContent!));
  await standStill(); // so that the world does not come to the same tick again
  const since = await page.textContent("#legend-title");
  await page.click("#reset");
  await page.waitForFunction((before) => document.getElementById("legend-title")!.textContent !== before, since);
  await page.check('input[value="body"]');
  await page.waitForSelector("#legend", { state: "hidden" });
  assert.ok(subscription().scalars);
  assert.deepEqual(complaints, []);
});

test("bounding volumes and vertices are drawn", async () => {
  await page.click("#show-view");
  await standStill();
  await page.click("#frame-all");
  await changesPicture((isOn) => page.selectOption("#bounds", isOn ? "ellipsoid" : "none"));
  await changesPicture((isOn) => page.setChecked("#points", isOn));
  assert.deepEqual(complaints, []);
});

test("velocities and contacts are streamed while they are shown, the world going on in between", async () => {
  const asks = () => [subscription().velocities, subscription().contacts];
  assert.deepEqual(asks(), [false, false]);
  await page.check("#velocities");
  await page.click("#show-view");
  await page.check("#contacts");
  await page.waitForFunction(() => Number(document.getElementById("contact-count")!.textContent) > 0);
  assert.deepEqual(asks(), [true, true]);
  await subscribers({ [world]: 1, "five-balls": 0 });
  await page.uncheck("#velocities");
  await until(async () => JSON.stringify(asks()) === "[false,true]");
  await pastTick((await shownTick()) + 10);
  assert.deepEqual(complaints, []);
});

test("the volume plot follows the gas, and the plots' figures have units", async () => {
  await page.click("#show-plots");
  const volume = async () => {
    const legend = page.locator("#charts figure", { hasText: "Volume, m³" }).locator(".u-legend");
    return Number(/volume:?\s*([\d.]+)/.exec(await legend.innerText())?.[1] ?? NaN);
  };
  const settled = (isWanted: (value: number) => boolean) => until(async () => isWanted(await volume()));
  await settled((value) => value > 0);
  const before = await volume();
  await page.fill("#gas", "2");
  await settled((value) => value > 1.2 * before);
  const titles = await page.locator("#charts figcaption").allInnerTexts();
  assert.ok(titles.length === 7 && titles.every((title) => /, (m³|Pa|J|kg m\/s|ms|bits a vertex)$/.test(title)));
  await page.click("#show-plots");
  assert.equal(await page.locator("#charts figure").count(), 0);
  assert.deepEqual(complaints, []);
});

test("the step plan names the integrator, why so many substeps, and what each stage takes", async () => {
  await page.click("#show-plan");
  // The page asks a few times a second, and a stage may have been used since.
  await until(async () => {
    const { substepsReason, stages } = await client.stats(world);
    const shown = await page.locator("#stages th").allInnerTexts();
    const used = stages.filter(({ calls }) => calls > 0n).map(({ name }) => name.replaceAll("_", " "));
    const isNamed = (await page.innerText("#step-facts")).includes(substepsReason);
    return isNamed && used.length > 0 && used.every((name) => shown.includes(name));
  });
});

test("a body at rest is said to be asleep, and one that ran away to be frozen", async () => {
  await client.createWorld({ name: "still", source: { case: "sceneJson", value: JSON.stringify(stillScene) } });
  await page.evaluate(() => (location.hash = "#world=still"));
  await page.waitForFunction(() => / 1 asleep/.test(document.getElementById("status")!.textContent!));
  await client.impulse("still", { body: "ball", at: { case: "vertex", value: 0 }, impulse: { x: 1e9 } });
  await page.waitForFunction(() => / 1 frozen/.test(document.getElementById("status")!.textContent!));
});

test("the camera is turned by the keyboard, and the selected body pulled and poked", async () => {
  await page.waitForSelector("#selected option[value=ball]", { state: "attached" });
  await page.selectOption("#selected", "ball");
  await page.waitForSelector("#status[data-shown]", { state: "attached" });
  await page.focus("#picture");
  await page.keyboard.press("ArrowLeft");
  await page.waitForFunction(() => location.hash.includes("camera="));
  const view = await hash();
  await page.keyboard.press("+");
  assert.notEqual(await hash(), view);
  const has = (wanted: string) => until(async () => asked.some(({ case: kind }) => kind === wanted));
  await page.keyboard.press("Enter");
  await has("grab");
  const held = await hash();
  const moves = () => asked.filter(({ case: kind }) => kind === "moveGrab").length;
  await until(async () => moves() === 1);
  await page.keyboard.press("ArrowUp");
  await until(async () => moves() === 2);
  assert.equal(await hash(), held, "the camera went with it");
  await page.keyboard.press("Enter");
  await has("releaseGrab");
  await page.keyboard.press("Enter");
  await until(async () => moves() === 3);
  await page.mouse.move(200, 560); // beside the ball
  await page.mouse.down();
  await page.mouse.move(240, 560);
  await page.mouse.up();
  assert.equal(moves(), 3, "what a key holds went with the pointer");
  await page.focus("#picture");
  await page.keyboard.press("2");
  await page.keyboard.press("Enter");
  await has("impulse");
  assert.deepEqual(complaints, []);
});

test("a picture that the browser takes away is told of, and comes back", async () => {
  await page.evaluate(() => {
    const canvas = document.getElementById("picture") as HTMLCanvasElement;
    const graphics = canvas.getContext("webgl2")!.getExtension("WEBGL_lose_context")!;
    Object.assign(globalThis, { graphics });
    graphics.loseContext();
  });
  await page.waitForFunction(() => /taken the picture/.test(document.getElementById("notice")!.textContent!));
  await page.evaluate(() => (globalThis as unknown as { graphics: WEBGL_lose_context }).graphics.restoreContext());
  await page.waitForSelector("#notice", { state: "hidden" });
});

test("a page that may keep nothing, and has no second WebGL, shows its world all the same", async () => {
  await page.addInitScript(() => {
    for (const kept of ["localStorage", "sessionStorage"]) {
      Object.defineProperty(globalThis, kept, {
        get: () => {
          throw new DOMException("The operation is insecure.", "SecurityError");
        },
      });
    }
    const { getContext } = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement, kind: string, ...rest: unknown[]) {
      if (kind.startsWith("webgl") && this.id !== "picture") return null;
      return Reflect.apply(getContext, this, [kind, ...rest]);
    } as typeof getContext;
  });
  await page.reload();
  await page.waitForSelector("#status[data-tick]");
  await page.click("#show-gallery");
  await page.waitForSelector("#cards a");
  await pastTick((await shownTick()) + 10);
  await page.waitForSelector("#notice", { state: "hidden" });
});

test("a body whose gas is gone is said to have burst", async () => {
  const { mesh, gas, springs, massKg } = (await client.scene(world)).softBodies[0]!;
  const thin = {
    name: "bubble",
    mesh,
    springs: springs!,
    massKg: massKg!,
    position: { y: 5 },
    gas: { ...gas!, burstPressurePa: 1e-3 },
  };
  await client.edit(world, { changes: [{ change: { case: "addSoftBody", value: thin } }] });
  await said(/bubble has burst/);
});

test("the theme is the system's, until it is chosen, which is remembered", async () => {
  const isDark = () => page.$eval("html", (root) => root.classList.contains("dark"));
  assert.ok(!(await isDark()));
  await page.emulateMedia({ colorScheme: "dark" });
  await page.waitForSelector("html.dark");
  await page.click("#dark");
  assert.ok(!(await isDark()));
  await page.reload();
  await page.waitForSelector("#status[data-tick]");
  assert.ok(!(await isDark()));
});

test("the page measures itself: frames decoded, scenes brought up to date, pictures drawn", async () => {
  await page.waitForFunction(() => {
    const { frames, pictures, updateMs, decodeMs } = document.getElementById("status")!.dataset;
    return Number(frames) > 30 && Number(pictures) > 0 && Number(updateMs) > 0 && Number(decodeMs) > 0;
  });
});

test("messages are below each other, and none has a path of the wire", async () => {
  await page.keyboard.press("t");
  await page.keyboard.press("t");
  await said(/^thrown-2 flies/);
  await page.setInputFiles("#mesh-file", { name: "b.obj", mimeType: "text/plain", buffer: Buffer.from("no mesh") });
  await said(/^b\.obj: there are no triangles/);
  const boxes = await page.$$eval("#effect p", (lines) =>
    lines.map((line) => line.getBoundingClientRect()).map(({ top, bottom }) => ({ top, bottom })),
  );
  boxes.slice(1).forEach(({ top }, i) => assert.ok(top >= boxes[i]!.bottom));
  const words = await page.evaluate(() => (globalThis as unknown as { messages: string[] }).messages.join("\n"));
  assert.ok(!/changes\[|edit\.|step\./.test(words), words);
});

test("the keys are listed, and an empty server offers to make a world", async () => {
  await page.keyboard.press("?");
  await page.waitForSelector("#keys[open]");
  assert.match(await page.innerText("#key-list"), /Space\s+Pause/);
  assert.match(await page.innerText("#key-list"), /W\s+Wireframe[^]*Delete\s+Remove/);
  await page.click("#keys-close");
  assert.ok(!(await page.isVisible("#make-first")));
  for (const { name } of await client.worlds()) await client.destroyWorld(name);
  await page.click("#make-first");
  await page.waitForSelector("#new-world[open]");
});

for (const colorScheme of ["light", "dark"] as const) {
  test(`axe finds nothing to complain about in any sheet, ${colorScheme}`, async () => {
    const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
    const violations = () =>
      page.evaluate(async () => {
        const { axe } = globalThis as unknown as { axe: { run(): Promise<{ violations: Violation[] }> } };
        const { violations } = await axe.run();
        return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html).join()}`);
      });
    await page.emulateMedia({ colorScheme });
    await page.evaluate(axe); // not as a script of the page, which takes none but its own
    await page.$eval("#picture", (picture) => (picture.style.width = picture.style.height = "20px")); // it takes the time
    await page.$$eval("#panel details", (groups) => {
      for (const group of groups) (group as HTMLDetailsElement).open = true;
    });
    for (const sheet of ["gallery", "view", "plots", "plan", "scene"]) {
      await page.click(`#show-${sheet}`);
      await page.waitForSelector(`#${sheet}`);
      if (sheet === "scene") await page.fill("#scene-text", '{"name": "bouncing-ball", "colour": 1}');
      if (sheet === "scene") await page.waitForSelector("#scene-problems button");
      assert.deepEqual(await violations(), [], sheet);
    }
    for (const dialog of ["keys", "new-world"]) {
      await page.click(dialog === "keys" ? "#show-keys" : "#new-world-open");
      assert.deepEqual(await violations(), [], dialog);
      await page.click(`#${dialog}-close`);
    }
  });
}
