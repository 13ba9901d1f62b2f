// The scene as text, in a real browser: what is written becomes an edit, or is told to be wrong at its line.
import assert from "node:assert/strict";
import { asked, client, complaints, hash, page, said, test, until, usePage, world } from "./set_up.js";

usePage();

function text(): Promise<string> {
  return page.inputValue("#scene-text");
}

/** Opens the sheet, and waits until the text has come. */
async function openSheet(name = world): Promise<void> {
  await page.click("#show-scene");
  await shows(`"name": "${name}"`);
}

/** Waits until the text has these words. */
async function shows(words: string): Promise<void> {
  await until(async () => (await text()).includes(words));
}

/** Writes the text with each of `words` replaced. */
async function rewrite(...words: readonly (readonly [string, string])[]): Promise<string> {
  const written = words.reduce(
    (changed, [from, to]) => {
      assert.ok(changed.includes(from), `${from} in ${changed}`);
      return changed.replace(from, to);
    },
    await text(),
  );
  await page.fill("#scene-text", written);
  return written;
}

async function edits(): Promise<number> {
  return asked.filter(({ case: kind }) => kind === "edit").length;
}

/** The line that the text's cursor is in, from 1, if the text has the focus. */
function focusedLine(): Promise<number> {
  return page.evaluate(() => {
    const { activeElement } = document;
    if (!(activeElement instanceof HTMLTextAreaElement)) return 0;
    return activeElement.value.slice(0, activeElement.selectionStart).split("\n").length;
  });
}

function lineOf(written: string, words: string): number {
  return written.slice(0, written.indexOf(words)).split("\n").length;
}

/** Waits until this line alone is told to be wrong, by number and mark, and has the focus. */
async function isToldAt(line: number, what: RegExp): Promise<void> {
  await page.waitForFunction(
    (number) => document.querySelector("#scene-problems button")?.textContent?.startsWith(`Line ${number}: `),
    line,
  );
  assert.match((await page.locator("#scene-problems button").allInnerTexts()).join("\n"), what);
  assert.deepEqual(await page.locator("#scene mark").allInnerTexts(), [String(line)]);
  assert.equal(await focusedLine(), line);
  assert.equal(await page.getAttribute("#scene-text", "aria-invalid"), "true");
}

test("what is written takes effect by one edit, and is taken back by Undo", async () => {
  await openSheet();
  const lines = (await text()).split("\n").length;
  assert.equal((await page.innerText(".numbered pre")).trim().split("\n").length, lines);
  assert.ok(await page.isDisabled("#scene-apply"));
  await rewrite(
    ['"y": -9.81', '"y": -1.5'],
    ['"mass_kg": 1', '"mass_kg": 2'],
    ['"stiffness_n_m": 200', '"stiffness_n_m": 300'],
  );
  await page.click("#scene-apply");
  await said(/^The scene is as written from tick \d+ on$/);
  assert.equal(await edits(), 1);
  const { gravity, softBodies } = await client.scene(world);
  assert.deepEqual([gravity?.y, softBodies[0]?.massKg, softBodies[0]?.springs?.stiffnessNM], [-1.5, 2, 300]);
  await page.waitForSelector("#scene-apply:disabled");
  await page.click("#undo");
  await shows('"y": -9.81');
  assert.equal((await client.scene(world)).softBodies[0]?.massKg, 1);
  assert.deepEqual(complaints, []);
});

test("a body begins anew where the text puts it, with a finer mesh, and its keys are the text's", async () => {
  await openSheet();
  await rewrite(
    ['"subdivisions": 2', '"subdivisions": 3'],
    ['"position": {"x": -2, "y": 2}', '"position": {"x": -1, "y": 3}'],
  );
  await page.press("#scene-text", "r"); // a letter, not the key of Reset
  await page.press("#scene-text", "Control+z");
  await page.press("#scene-text", "Control+Enter");
  await said(/^The scene is as written from tick \d+ on\. ball begins anew$/);
  const { vertices } = (await client.worlds()).find(({ name }) => name === world)!;
  assert.equal(vertices, 642);
  assert.equal((await client.scene(world)).softBodies[0]?.position?.x, -1);
  assert.ok(!asked.some(({ case: kind }) => kind === "reset"));
  await page.click("#undo");
  await said(/^Taken back: Change the scene/);
  assert.equal((await client.worlds()).find(({ name }) => name === world)!.vertices, 162);
});

test("what is no JSON, no field or no value is told at its line, before the server is asked", async () => {
  await openSheet();
  const original = await text();
  const broken = await rewrite(['"mass_kg": 1,', '"mass_kg": 1']);
  await page.waitForSelector("#scene-problems button"); // unasked, once the hands rest
  await page.click("#scene-apply");
  await isToldAt(lineOf(broken, '"mass_kg": 1') + 1, /a comma or } is missing/i);
  await page.fill("#scene-text", original);
  await page.waitForSelector("#scene-problems button", { state: "detached" });
  const misspelt = await rewrite(['"mass_kg"', '"mas_kg"']);
  await page.click("#scene-apply");
  await isToldAt(lineOf(misspelt, "mas_kg"), /"mas_kg" is unknown here; did you mean mass_kg\?/);
  await page.fill("#scene-text", original.replace('"name": "bouncing-ball"', '"name": "mine"'));
  await page.click("#scene-apply");
  await isToldAt(2, /A world's scene keeps its name; or make a new world of it/);
  await page.focus("#pause");
  await page.click("#scene-problems button");
  assert.equal(await focusedLine(), 2);
  assert.equal(await edits(), 0);
});

test("what the server refuses is told at its line in the page's words, and nothing of the edit is done", async () => {
  await openSheet();
  const written = await rewrite(['"y": -9.81', '"y": -1.5'], ['"restitution": 0.8', '"restitution": 8']);
  await page.click("#scene-apply");
  await isToldAt(lineOf(written, '"restitution": 8'), /: Restitution: is 8; /);
  assert.equal((await client.scene(world)).gravity?.y, -9.81);
  assert.equal(await text(), written);
  assert.ok(!/changes\[|edit\./.test(await page.innerText("#scene")));
});

test("a text that nobody wrote in follows the scene; one that somebody did stays, and the page says so", async () => {
  await openSheet();
  await client.edit(world, { changes: [{ change: { case: "setGravity", value: { y: -2 } } }] });
  await shows('"y": -2');
  const written = await rewrite(['"mass_kg": 1', '"mass_kg": 3']);
  await client.edit(world, { changes: [{ change: { case: "setGravity", value: { y: -4 } } }] });
  await page.waitForFunction(() =>
    /^The scene has changed since/.test(document.getElementById("scene-note")!.textContent!),
  );
  assert.equal(await text(), written);
  await page.click("#scene-apply"); // what others did stays
  await shows('"y": -4');
  assert.equal((await client.scene(world)).softBodies[0]?.massKg, 3);
  assert.equal(await page.textContent("#scene-note"), "");
  const mine = await rewrite(['"mass_kg": 3', '"mass_kg": 5']);
  await page.click("#scene-load");
  await shows('"mass_kg": 3');
  await page.click('#scene-load:text-is("My text again")');
  await until(async () => (await text()) === mine);
  await page.waitForSelector("#scene-apply:enabled");
  await page.waitForSelector('#scene-load:text-is("Load again")');
  assert.deepEqual(complaints, []);
});

test("what is written for a world is there again after another one was shown", async () => {
  await openSheet();
  const written = await rewrite(['"mass_kg": 1', '"mass_kg": 7']);
  await page.evaluate(() => (location.hash = "#world=five-balls"));
  await shows('"name": "five-balls"');
  await page.evaluate((name) => (location.hash = `#world=${name}`), world);
  await until(async () => (await text()) === written);
  await page.waitForSelector("#scene-apply:enabled");
});

test("a new world is made of the text, under a name of its own", async () => {
  await openSheet();
  await rewrite(['"mass_kg": 1', '"mass_kg": 7']);
  await page.click("#scene-new");
  await said(/^bouncing-ball-2 is made/);
  await page.waitForFunction(() => document.title.startsWith("bouncing-ball-2"));
  assert.equal((await client.scene("bouncing-ball-2")).softBodies[0]?.massKg, 7);
  assert.equal((await client.scene(world)).softBodies[0]?.massKg, 1);
  assert.match(await hash(), /world=bouncing-ball-2/);
  const wrong = await rewrite(['"friction": 0.3', '"friction": -3']);
  await page.click("#scene-new");
  await isToldAt(lineOf(wrong, '"friction": -3'), /: Friction: is -3; /);
});

test("on a phone the sheet is as wide as the screen, its buttons as high as a finger", async () => {
  await page.setViewportSize({ width: 390, height: 844 });
  await openSheet();
  await rewrite(['"mass_kg"', '"mas_kg"']);
  await page.click("#scene-apply");
  const { width, x } = (await page.locator(".numbered").boundingBox())!;
  assert.ok(width > 320 && x >= 0 && x + width <= 390, `${x}, ${width}`);
  const heights = await page.$$eval("#scene button", (buttons) =>
    buttons.map((button) => button.getBoundingClientRect().height),
  );
  assert.ok(heights.length === 4 && heights.every((height) => height >= 44), heights.join());
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 390);
  const phone = await page.context().newCDPSession(page);
  await phone.send("Emulation.setTouchEmulationEnabled", { enabled: true });
  const sizes = await page.$$eval("input, select, textarea", (fields) =>
    fields.map((field) => parseFloat(getComputedStyle(field).fontSize)),
  );
  assert.ok(sizes.length > 3 && sizes.every((size) => size >= 16), sizes.join());
});
