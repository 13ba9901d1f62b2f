// What is done with the page's hands, in a real browser: each deed is asked of the server by another client.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { promisify } from "node:util";
import type { Page } from "playwright-core";
import { type Applied, type Client, type Scene } from "../../src/index.js";
import { clientProgram } from "../server.js";
import {
  asked,
  browser,
  client,
  complaints,
  hash,
  open,
  page,
  said,
  server,
  standStill,
  test,
  unfold,
  until,
  usePage,
  world,
} from "./set_up.js";

usePage();

/** Waits until the world's scene is as wanted: it is looked at after each change of the world. */
async function scene(isWanted: (scene: Scene) => boolean, of: Client = client): Promise<Scene> {
  let changed = () => {};
  const stream = await of.subscribe(
    world,
    { commands: true, maxErrorM: 0.02, rateHz: 1 },
    { frame: () => {}, applied: () => changed() },
  );
  try {
    for (;;) {
      const next = new Promise<void>((resolve) => (changed = resolve));
      const now = await of.scene(world);
      if (isWanted(now)) return now;
      await next;
    }
  } finally {
    await of.unsubscribe(stream);
  }
}

function names(of: readonly { readonly name: string }[]): string[] {
  return of.map(({ name }) => name);
}

/** As patient as the first, and small: both are drawn in software. */
async function anotherPage(): Promise<Page> {
  const another = await browser.newPage({ viewport: { width: 640, height: 320 }, deviceScaleFactor: 0.5 });
  another.setDefaultTimeout(60_000);
  return another;
}

/** A cube of eight vertices as an OBJ, whose first face may be left out. */
function cube(isWhole: boolean): string {
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => `v ${i & 1} ${(i >> 1) & 1} ${i >> 2}`);
  const sides = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"];
  return [...corners, ...sides.slice(isWhole ? 0 : 1).map((side) => `f ${side}`)].join("\n");
}

/** A tetrahedron with edges of 1, 2 and 3 along the axes, in each format. */
function meshFiles(): Record<string, Buffer> {
  const corners = [
    [0, 0, 0],
    [1, 0, 0],
    [0, 2, 0],
    [0, 0, 3],
  ];
  const faces = [
    [0, 2, 1],
    [0, 1, 3],
    [0, 3, 2],
    [1, 2, 3],
  ];
  const lines = (rows: readonly (readonly (number | string)[])[]) => rows.map((row) => row.join(" ")).join("\n");
  const facets = faces.map((face) => {
    const vertices = lines(face.map((corner) => ["vertex", ...corners[corner]!]));
    return `facet normal 0 0 0\nouter loop\n${vertices}\nendloop\nendfacet`;
  });
  const head = [
    "ply",
    "format ascii 1.0",
    "element vertex 4",
    "property float x",
    "property float y",
    "property float z",
  ];
  head.push("element face 4", "property list uchar int vertex_indices", "end_header");
  const buffer = Buffer.alloc(48 + 24);
  corners.flat().forEach((number, i) => buffer.writeFloatLE(number, 4 * i));
  faces.flat().forEach((corner, i) => buffer.writeUInt16LE(corner, 48 + 2 * i));
  const gltf = (uri?: string) => ({
    asset: { version: "2.0" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0, scale: [1, 1, 1] }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1, material: 0 }] }],
    materials: [{ pbrMetallicRoughness: { baseColorTexture: { index: 0 } } }],
    textures: [{ source: 0 }],
    images: [{ uri: "not-there.png" }],
    buffers: [{ byteLength: buffer.length, ...(uri === undefined ? {} : { uri }) }],
    bufferViews: [
      { buffer: 0, byteOffset: 0, byteLength: 48 },
      { buffer: 0, byteOffset: 48, byteLength: 24 },
    ],
    accessors: [
      { bufferView: 0, componentType: 5126, count: 4, type: "VEC3", min: [0, 0, 0], max: [1, 2, 3] },
      { bufferView: 1, componentType: 5123, count: 12, type: "SCALAR" },
    ],
  });
  const json = Buffer.from(JSON.stringify(gltf()));
  const padded = Buffer.concat([json, Buffer.alloc((4 - (json.length % 4)) % 4, " ")]);
  const words = (...numbers: number[]) => Buffer.from(Uint32Array.from(numbers).buffer);
  return {
    "t.obj": Buffer.from(
      lines([...corners.map((at) => ["v", ...at]), ...faces.map((face) => ["f", ...face.map((i) => i + 1)])]),
    ),
    "t.stl": Buffer.from(`solid t\n${facets.join("\n")}\nendsolid t\n`),
    "t.ply": Buffer.from(`${head.join("\n")}\n${lines([...corners, ...faces.map((face) => [3, ...face])])}\n`),
    "t.gltf": Buffer.from(JSON.stringify(gltf(`data:application/octet-stream;base64,${buffer.toString("base64")}`))),
    "t.glb": Buffer.concat([
      words(0x46546c67, 2, 12 + 8 + padded.length + 8 + buffer.length),
      words(padded.length, 0x4e4f534a),
      padded,
      words(buffer.length, 0x004e4942),
      buffer,
    ]),
  };
}

async function upload(name: string, text: string): Promise<void> {
  await page.setInputFiles("#mesh-file", { name, mimeType: "text/plain", buffer: Buffer.from(text) });
  await page.waitForSelector("#upload[open]");
}

test("a ball is thrown where the pointer points, and undone and done again", async () => {
  await page.click("#tool-throw");
  await page.mouse.click(250, 300);
  const { rigidBodies } = await scene((now) => now.rigidBodies.length === 1);
  assert.deepEqual(names(rigidBodies), ["thrown-1"]);
  await said(/thrown-1 flies from tick \d+/);
  await page.keyboard.press("Control+z");
  await scene((now) => now.rigidBodies.length === 0);
  await said(/Taken back: Throw thrown-1/);
  await page.keyboard.press("Control+Shift+Z");
  await scene((now) => now.rigidBodies.length === 1);
  assert.deepEqual(complaints, []);
});

test("of the balls that were thrown the oldest go", async () => {
  for (let ball = 1; ball <= 14; ++ball) await page.keyboard.press("t");
  const { rigidBodies } = await scene((now) => names(now.rigidBodies).includes("thrown-14"));
  assert.deepEqual(names(rigidBodies).at(0), "thrown-3");
  assert.equal(rigidBodies.length, 12);
});

test("a soft ball is added, selected, removed, and put back where it was", async () => {
  await unfold("Add");
  await page.waitForSelector("#add-kind option[value=soft-ball]", { state: "attached" });
  await page.selectOption("#add-kind", "soft-ball");
  await page.click("#add");
  const { softBodies } = await scene((now) => now.softBodies.length === 2);
  assert.deepEqual(names(softBodies), ["ball", "soft-ball-1"]);
  await said(/soft-ball-1 is there/);
  await page.waitForFunction(() => (document.getElementById("selected") as HTMLSelectElement).value === "soft-ball-1");
  await standStill();
  const before = (await client.stats(world)).softBodies[1]!.centreOfMass!;
  await page.waitForFunction(() => document.getElementById("pause")!.textContent === "Resume");
  await page.keyboard.press("Delete");
  await scene((now) => now.softBodies.length === 1);
  await page.click("#undo");
  await scene((now) => now.softBodies.length === 2);
  const after = (await client.stats(world)).softBodies[1]!.centreOfMass!;
  const away = Math.hypot(after.x - before.x, after.y - before.y, after.z - before.z);
  assert.ok(away < 0.05, `${away} m from where it was`);
  assert.deepEqual(complaints, []);
});

test("obstacles and rigid bodies are added", async () => {
  await unfold("Add");
  await page.waitForSelector("#add-kind option[value=block]", { state: "attached" });
  for (const kind of ["ball", "box", "block", "bump", "floor"]) {
    await page.selectOption("#add-kind", kind);
    await page.click("#add");
    await said(new RegExp(`${kind}-1 is there`));
  }
  const { rigidBodies, colliders } = await client.scene(world);
  assert.deepEqual(names(rigidBodies), ["ball-1", "box-1"]);
  assert.deepEqual(names(colliders), ["floor", "block-1", "bump-1", "floor-1"]);
});

test("a click selects a body, whose own gas is another then", async () => {
  await standStill();
  await page.waitForSelector("#selected option[value=ball]", { state: "attached" });
  const panel = (await (await page.$("#panel"))!.boundingBox())!;
  await page.click("#frame-all");
  await page.mouse.click(panel.x / 2, 300);
  assert.equal(await page.inputValue("#selected"), "ball");
  await page.waitForFunction(() => {
    const card = document.getElementById("card")!.innerText.replaceAll("\n", " ");
    return /Mass .* kg.* Over-pressure .* Pa.* Speed .* m\/s.* State (awake|asleep)/.test(card);
  });
  assert.ok(!asked.some(({ case: kind }) => kind === "ping"), "the card does not tell how long an answer takes");
  await page.waitForSelector("#own-gas:enabled");
  const { moles } = (await client.scene(world)).softBodies[0]!.gas!;
  await page.fill("#own-gas", "1");
  const changed = await scene((now) => now.softBodies[0]!.gas!.moles! > 1.5 * moles!);
  assert.ok(Math.abs(changed.softBodies[0]!.gas!.moles! / moles! - 2) < 0.01);
});

test("a slider that is refused says why, and goes back to what holds", async () => {
  // Steps that are given, and may be too long: AUTO takes others.
  await client.editJson(world, '{"changes": [{"set_stepping": {"integrator": "MIDPOINT", "substeps": 16}}]}');
  await page.waitForSelector("#stiffness:enabled");
  await page.fill("#stiffness", "2");
  await page.waitForSelector("#stiffness-note:not(:empty)");
  assert.match((await page.textContent("#stiffness-note"))!, /stable|substeps/);
  await page.waitForFunction(() => (document.getElementById("stiffness") as HTMLInputElement).valueAsNumber === 0);
  const before = (await client.scene(world)).softBodies[0]!.springs!.stiffnessNM!;
  await page.click("label:has(#stiffness) + .offer"); // to have as many substeps as it takes
  const stiff = await scene((now) => now.softBodies[0]!.springs!.stiffnessNM! > before);
  assert.ok(Math.abs(stiff.softBodies[0]!.springs!.stiffnessNM! / before - 4) < 0.01);
  await page.waitForSelector("#stiffness-note:empty", { state: "attached" });
});

test("wind brings air, and an undo takes both away", async () => {
  await page.waitForSelector("#wind:enabled");
  await page.fill("#wind", "5");
  const windy = await scene(({ atmosphere }) => atmosphere?.wind?.x === 5);
  assert.ok(windy.atmosphere!.densityKgM3 > 1);
  await page.waitForSelector("#undo:enabled");
  await page.click("#undo");
  const still = await scene(({ atmosphere }) => !atmosphere?.wind?.x);
  assert.equal(still.atmosphere!.densityKgM3, 0);
});

test("two pages see the same world: the sliders of one follow the other's", async () => {
  const second = await anotherPage();
  try {
    await open(second);
    await second.waitForSelector("#gravity:enabled");
    await page.fill("#gravity", "3");
    await second.waitForFunction(() => (document.getElementById("gravity") as HTMLInputElement).value === "3");
    await page.waitForFunction(() => /1 other watches/.test(document.getElementById("status")!.textContent!));
    await page.click("#undo");
    await page.waitForSelector("#undo:disabled");
    await page.keyboard.press("r"); // it takes from the other what is theirs
    await page.waitForSelector("#reset-confirm[open]");
    await page.click("#reset-no");
    await page.fill("#gravity", "3");
    await page.keyboard.press("t");
    await second.waitForSelector("#selected option[value=thrown-1]", { state: "attached" });
    await client.reset(world);
    await second.waitForFunction(() => (document.getElementById("gravity") as HTMLInputElement).value === "9.8");
    await second.waitForFunction(() => !document.querySelector("#selected option[value=thrown-1]"));
  } finally {
    await second.close();
  }
});

test("in slow motion a world goes on slowly, and another page is told", async () => {
  let heard: (applied: Applied) => void;
  const applied = new Promise<Applied>((resolve) => (heard = resolve));
  const listener = { frame: () => {}, applied: (each: Applied) => heard(each) };
  const stream = await client.subscribe(world, { commands: true }, listener);
  await page.selectOption("#time-scale", "0.25");
  const { command } = await applied;
  assert.equal(command?.request.case === "resume" && command.request.value.timeScale, 0.25);
  assert.equal((await client.stats(world)).timeScale, 0.25);
  await client.unsubscribe(stream);
  await client.resume(world, 1);
  await page.waitForFunction(() => (document.getElementById("time-scale") as HTMLSelectElement).value === "1");
});

test("a mesh of a file appears", async () => {
  await upload("crate.obj", cube(true));
  assert.match((await page.textContent("#upload-facts"))!, /8 vertices · 12 faces/);
  await page.press("#upload-size", "Enter"); // adds it, and mends nothing unasked
  const { softBodies, meshes } = await scene((now) => now.softBodies.length === 2);
  assert.equal(softBodies[1]!.name, "crate-1");
  const { shape } = meshes[1]!;
  assert.equal(shape.case === "triangles" && shape.value.positions.length, 8);
  assert.equal(meshes[1]!.mend, undefined);
  await page.waitForSelector("#selected option[value=crate-1]", { state: "attached" });
  assert.deepEqual(complaints, []);
});

test("OBJ, STL, PLY, glTF and GLB files are read, each to the same mesh", async () => {
  for (const [name, bytes] of Object.entries(meshFiles())) {
    await page.setInputFiles("#mesh-file", { name, mimeType: "application/octet-stream", buffer: bytes });
    await page.waitForFunction((title) => document.getElementById("upload-name")!.textContent === title, name);
    assert.match((await page.textContent("#upload-facts"))!, /4 vertices · 4 faces · 1 × 2 × 3/, name);
    await page.click("#upload-cancel");
  }
  await page.setInputFiles("#mesh-file", { name: "bad.glb", mimeType: "", buffer: Buffer.from("no mesh") });
  await said(/^bad\.glb: it cannot be read as GLB$/);
  await page.waitForSelector("#effect .refused");
  const isLeftToBrowser = await page.evaluate(() => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File(["no mesh"], "picture.png"));
    return dispatchEvent(new DragEvent("drop", { dataTransfer, cancelable: true }));
  });
  assert.ok(!isLeftToBrowser, "it would leave the page");
  await said(/^picture\.png: the page reads OBJ/);
  assert.deepEqual(complaints, []);
});

test("a broken mesh shows the server's refusal, and mended the report", async () => {
  await upload("open.obj", cube(false));
  await page.click("#upload-add");
  await page.waitForSelector("#upload-mend:not([hidden])");
  assert.match((await page.textContent("#upload-refusal"))!, /open|border|closed/);
  await page.click("#upload-mend");
  await said(/open-1 is there from tick \d+ on\. Mended: .*1 hole closed/);
  assert.equal((await client.scene(world)).softBodies.length, 2);
  await page.waitForSelector("#selected option[value=open-1]", { state: "attached" });
  await page.selectOption("#selected", "open-1");
  await page.click("#remove");
  assert.equal((await scene((now) => now.softBodies.length === 1)).meshes.length, 1);
  await page.click("#undo");
  await scene((now) => now.softBodies.length === 2 && now.meshes.length === 2);
});

test("the address opens the same view, and the scene that is saved makes the same world", async () => {
  await page.mouse.move(60, 500);
  await page.mouse.down();
  await page.mouse.move(200, 450, { steps: 4 });
  await page.mouse.up();
  await page.waitForFunction(() => location.hash.includes("camera="));
  const view = await hash();
  const again = await anotherPage();
  try {
    await again.goto(`http://${server.http}/${view}`);
    await again.waitForSelector("#status[data-tick]");
    await until(async () => {
      await again.mouse.click(60, 250); // it notes its own view
      return (await hash(again)) === view;
    });
  } finally {
    await again.close();
  }
  await unfold("Share");
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#save-scene")]);
  const { meshes } = await client.scene(world);
  const file = join(await mkdtemp(join(tmpdir(), "pneuma-")), "scene.json");
  await download.saveAs(file);
  assert.ok((await readFile(file, "utf8")).includes('"soft_bodies"'));
  const { tcp } = server;
  await promisify(execFile)(clientProgram, ["--server", tcp, "create", file, "--name", "again"]);
  assert.deepEqual((await client.scene("again")).meshes, meshes);
});

/** Where the pixels of lively colour are in the middle, as a share of the picture's width. */
function colouredAt(png: Buffer): Promise<number> {
  return page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const picture = await createImageBitmap(new Blob([bytes]));
    const context = new OffscreenCanvas(picture.width, picture.height).getContext("2d")!;
    context.drawImage(picture, 0, 0);
    const { data, width } = context.getImageData(0, 0, picture.width, picture.height);
    let [sum, count] = [0, 0];
    for (let i = 0; i < data.length; i += 4) {
      const colours = [data[i]!, data[i + 1]!, data[i + 2]!];
      if (Math.max(...colours) - Math.min(...colours) < 90) continue;
      sum += (i / 4) % width;
      ++count;
    }
    return sum / count / width;
  }, png.toString("base64"));
}

test("a picture that is saved has in its middle what the page shows beside the panel", async () => {
  await standStill();
  await page.click("#frame-all");
  await unfold("Share");
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#save-picture")]);
  const folder = await mkdtemp(join(tmpdir(), "pneuma-"));
  const file = join(folder, "picture.png");
  await download.saveAs(file);
  const at = await colouredAt(await readFile(file));
  assert.ok(Math.abs(at - 0.5) < 0.05, `at ${at} of its width`);
  await rm(folder, { recursive: true });
});

test("a world is made of a built-in scene and of a file, and destroyed when that is confirmed", async () => {
  await page.keyboard.press("n");
  await page.fill("#world-name", "made-here");
  await page.click("#scenes button:has-text('hanging-ball')");
  await page.waitForFunction(() => document.title.startsWith("made-here"));
  await page.keyboard.press("n");
  const folder = await mkdtemp(join(tmpdir(), "pneuma-"));
  const file = join(folder, "scene.json");
  await writeFile(file, JSON.stringify({ name: "of-a-file", gravity: { y: "down" } }));
  await page.setInputFiles("#scene-file", file);
  await page.waitForSelector("#new-world-refusal:not(:empty)");
  await page.fill("#world-name", "");
  await writeFile(file, JSON.stringify({ name: "of-a-file", gravity: { y: -1 } }));
  await page.setInputFiles("#scene-file", file);
  await page.waitForFunction(() => document.title.startsWith("of-a-file"));
  await unfold("Worlds");
  await page.click("#destroy");
  await page.click("#destroy-no");
  assert.ok(names(await client.worlds()).includes("of-a-file"));
  await page.click("#destroy");
  await page.click("#destroy-yes");
  await page.waitForFunction(() => !document.title.startsWith("of-a-file"));
  assert.ok(!names(await client.worlds()).includes("of-a-file"));
});
