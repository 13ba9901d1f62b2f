// Shows that the golden vectors hold a decoder to the whole of its format: each mutant of ours, with one thing wrong
// that another implementation could have wrong too, fails some vector. Those that cannot fail are listed with why.
import assert from "node:assert/strict";
import { cpSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { type Codec, firstWrong } from "../golden_runs.js";

/** The file of the compiled decoder, what stands there exactly once, and what takes its place. */
type Mutant = readonly [file: string, from: string, to: string];

const mutants: readonly Mutant[] = [
  // The order of the vertices.
  ["mesh_order", "const levelsMax = 12;", "const levelsMax = 13;"],
  ["mesh_order", "const levelsMax = 12;", "const levelsMax = 11;"],
  ["mesh_order", "const coloursMax = 8;", "const coloursMax = 9;"],
  ["mesh_order", "const coloursMax = 8;", "const coloursMax = 7;"],
  ["mesh_order", "const listMax = 16;", "const listMax = 17;"],
  ["mesh_order", "const listMax = 16;", "const listMax = 15;"],
  ["mesh_order", "Math.min(begins[vertex + 1], begins[vertex] + listMax)", "begins[vertex + 1]"],
  ["mesh_order", "Math.min(begins[near + 1], begins[near] + listMax)", "begins[near + 1]"],
  ["mesh_order", "end - begin < listMax", "end - begin < listMax - 1"],
  ["mesh_order", "end - begin < listMax", "end - begin < listMax + 1"],
  ["mesh_order", "&& count < parentsMax", "&& count < parentsMax - 1"],
  ["mesh_order", "&& count < parentsMax", ""],
  ["mesh_order", "inverse(byRank), true)", "inverse(byRank), false)"],
  ["mesh_order", "renamed(lists, ranks, slots, false)", "renamed(lists, ranks, slots, true)"],
  ["mesh_order", "colours[other] !== 0 || other === vertex", "colours[other] !== 0"],
  ["mesh_order", "if (!nextEntries.subarray(begin, end).includes(other))", ""],
  [
    "mesh_order",
    "other !== vertex && (end === begin || all[end - 1] !== other)",
    "end === begin || all[end - 1] !== other",
  ],
  ["mesh_order", "other !== vertex && (end === begin || all[end - 1] !== other)", "other !== vertex"],
  ["mesh_order", "ranks.map((rank) => byRank[rank])", "ranks"],
  ["mesh_order", "parent >= slot", "parent > slot + size"],
  // Prediction.
  ["move_reader", "const sizeMax = 1 << 24;", "const sizeMax = 1 << 25;"],
  ["move_reader", "const sizeMax = 1 << 24;", "const sizeMax = 1 << 23;"],
  ["move_reader", "const sizeMax = 1 << 24;", "const sizeMax = 2 ** 31 - 1;"],
  ["move_reader", "const weightLevel = 44;", "const weightLevel = 43;"],
  ["move_reader", "errors[p3] + errors[p4] + errors[p5]) | 0;", "errors[p3] + errors[p4] + errors[p5]);"],
  ["move_reader", "errors[p4 + 1] + errors[p5 + 1]) | 0;", "errors[p4 + 1] + errors[p5 + 1]);"],
  ["move_reader", "ringX - 6 * flow[at] + 32) >> 6", "ringX - 6 * flow[at] + 31) >> 6"],
  ["move_reader", "ringZ - 6 * flow[at + 2] + 32) >> 6", "ringZ - 6 * flow[at + 2]) >> 6"],
  ["move_reader", "(x + 8) >> 4", "(x + 7) >> 4"],
  ["move_reader", "16 - 16 * parity", "16"],
  ["move_reader", "Math.min(levelOf(listSize + 4 * mean), levelMax)", "levelOf(listSize + 4 * mean)"],
  ["move_reader", "levelOf(listSize + 4 * mean)", "levelOf(4 * mean)"],
  ["move_reader", "levelOf(listSize + 4 * mean)", "levelOf(listSize + mean)"],
  ["move_reader", "(sum * parentShares[slot] + nudge) | 0", "Math.round(sum * parentShares[slot])"],
  ["move_reader", "(sumX * share + nudgeDown) | 0", "(sumX * share) | 0"],
  ["move_reader", "(sumY * share + nudgeDown) | 0", "Math.round(sumY * share) | 0"],
  ["move_reader", "b3 = 0, b4 = 0", "b4 = 0, b3 = 0"],
  ["move_reader", "a3 = 0, a4 = 0", "a4 = 0, a3 = 0"],
  ["move_reader", "addRests(rests, m1, c, flow);", ""],
  ["move_reader", "addRests(rests, flow, 1, drift);", ""],
  ["move_reader", "Math.imul(a4, x4)) << 3", "Math.imul(a4, x4)) << 2"],
  ["move_reader", "+ 2 * (Math.abs(residuals[at + 1])", "+ (Math.abs(residuals[at + 1])"],
  ["move_reader", "errors[at + 3] = (moveX << 4) - driftX", "errors[at + 3] = (moveX << 4) - x"],
  // Residuals.
  ["residual_tables", "const levelMax = 91;", "const levelMax = 90;"],
  ["residual_tables", "const levelMax = 91;", "const levelMax = 92;"],
  ["residual_tables", "const residualMax = 31;", "const residualMax = 30;"],
  ["residual_tables", "52960, 56420, 58420", "52960, 56520, 58420"],
  ["residual_tables", "52960, 56420, 58420", "52960, 56420, 58400"],
  ["residual_tables", "150, 3730", "250, 3730"],
  ["residual_tables", "1 + Math.floor((2 * share) / sum)", "Math.floor((2 * share) / sum)"],
  ["residual_tables", "Math.max(level, 0) >> 1", "level >> 1"],
  ["residual_tables", "(level >> 2) - (tableCount / 2 - 1)", "(level >> 2) - tableCount / 2"],
  ["residual_tables", "((raised >> octave) & 3)", "((size >> octave) & 3)"],
  ["residual_tables", "<< (level >> 2)) - 4", "<< (level >> 2))"],
  ["triple_reader", "const escapeLengthBits = 6;", "const escapeLengthBits = 5;"],
  ["triple_reader", "const stepLowBitsMax = 16 - probabilityBits;", "const stepLowBitsMax = 5;"],
  ["triple_reader", "length === 0 || length > 32", "length > 32"],
  ["triple_reader", "length === 0 || length > 32", "length === 0 || length > 33"],
  ["triple_reader", "length > 16 ? this.plain", "length > 17 ? this.plain"],
  ["triple_reader", "- ((1 << lowBits) >> 1)", ""],
  ["triple_reader", "(code >>> 1) ^ -(code & 1)", "(code >> 1) ^ -(code & 1)"],
  ["triple_reader", "this.states.every((state) => state === stateMin)", "true"],
  ["triple_reader", "this.next === this.end", "true"],
  ["triple_reader", "this.broken ||= this.states[i] >>> 16 === 0", ""],
  ["triple_reader", "text.length % 2 !== 0 ||", ""],
  // The layout of a payload.
  ["block_heads", "const format = 5;", "const format = 4;"],
  ["block_heads", "if (mode > (isSimulated ? 5 : 4))", "if (mode > 5)"],
  ["block_heads", "if (mode > (isSimulated ? 5 : 4))", "if (mode > (isSimulated ? 6 : 4))"],
  ["block_heads", "isKey && mode !== 1 && mode !== 2", "isKey && mode === 0"],
  ["block_heads", "if (level > levelMax)\n", "if (level === 256)\n"],
  ["block_heads", "level > levelMax && level !== levelOfRest", "level > 254 && level !== levelOfRest"],
  ["block_heads", "const levelOfRest = 255;", "const levelOfRest = 254;"],
  ["block_heads", "hasWeights: mode === 3", "hasWeights: true"],
  ["block_heads", "getInt32(this.at + 4, true)", "getUint32(this.at + 4, true)"],
  ["frame_reader", "moves: next(none)", "moves"],
  ["frame_reader", "velocities: simulation && none", "velocities: last.velocities"],
  ["frame_reader", "weights: last.weights, velocities", "weights: new Int32Array(9), velocities"],
  ["frame_reader", "simulation && velocitiesOf(move)", "last.velocities"],
  ["frame_reader", "move[i] << 8", "move[i] << 7"],
  ["frame_reader", "twice >> 1", "(twice / 2) | 0"],
  ["frame_reader", "moves[i] << 4", "0"],
  ["frame_reader", "return velocitiesOf(move);", "return new Int32Array(move.length);"],
  // The check.
  ["points_check", "const digestFactor = 16_777_619;", "const digestFactor = 16_777_621;"],
  ["points_check", "Math.imul(3,", "Math.imul(2,"],
  ["points_check", "(coordinate + near) * highUnit", "coordinate * highUnit"],
  ["points_check", "sum >>> 15", "sum >>> 16"],
  ["points_check", "sum >>> 15", "sum >> 15"],
  ["points_check", "(Math.imul(sum, digestFactor) + digest) | 0", "(sum + digest) | 0"],
  // Simulated motion.
  ["simulated_motion", "entry(mechanics.massesKg, vertex)", "entry(mechanics.massesKg, slot)"],
  ["simulated_motion", "const velocityGain = 0.2;", "const velocityGain = 0.25;"],
  ["simulated_motion", "Math.max(-stepsAFrameMax, Math.min(stepsAFrameMax, move))", "Math.max(-stepsAFrameMax, move)"],
  ["simulated_motion", "Math.max(-stepsAFrameMax, Math.min(stepsAFrameMax, move))", "Math.min(stepsAFrameMax, move)"],
  ["simulated_motion", "Math.max(-velocityMax, Math.min(velocityMax, velocity))", "Math.max(-velocityMax, velocity)"],
  ["simulated_motion", "Math.max(-velocityMax, Math.min(velocityMax, velocity))", "Math.min(velocityMax, velocity)"],
  ["simulated_motion", "Math.abs(moved) < stepsAFrameMax && Math.abs(speed)", "Math.abs(speed)"],
  [
    "simulated_motion",
    "Math.abs(moved) < stepsAFrameMax && Math.abs(speed) < stepsAFrameMax",
    "Math.abs(moved) < stepsAFrameMax",
  ],
  ["simulated_motion", "const squareLengthMin = 2 ** -10;", "const squareLengthMin = -1;"],
  ["simulated_motion", "const volumeShareMin = 2 ** -6;", "const volumeShareMin = 2 ** -7;"],
  ["simulated_motion", "const reach = 2;", "const reach = 0.5;"],
  ["simulated_motion", "substep === 0 ? 2 * this.#damping : this.#damping", "this.#damping"],
  ["simulated_motion", "if (substep % 2 === 0)", ""],
  ["simulated_motion", "product < 2 ? product : 2", "product"],
  ["simulated_motion", "i < exponent65536ths >>> 16", "i < 1"],
  ["simulated_motion", "inverse > 0 ? 1 : 0", "1"],
  ["simulated_motion", "substep + 1 < this.#substeps ? 0.5 : 0", "0.5"],
  ["simulated_motion", "rubbed < speed ? 1 - rubbed / speed : 0", "1 - rubbed / speed"],
  ["simulated_motion", "value + roundingShift - roundingShift", "Math.round(value)"],
  ["simulated_motion", "if (!(inward < 0))", "if (inward === 0)"],
  ["simulated_motion", "const substepsMax = 64;", "const substepsMax = 63;"],
  ["simulated_motion", "const substepsMax = 64;", "const substepsMax = 65;"],
  ["simulated_motion", "const planesMax = 16;", "const planesMax = 15;"],
  ["simulated_motion", "const planesMax = 16;", "const planesMax = 17;"],
  ["simulated_motion", "const exponentMax = 16 * 65536;", "const exponentMax = 16 * 65536 - 1;"],
  ["simulated_motion", "const exponentMax = 16 * 65536;", "const exponentMax = 16 * 65536 + 1;"],
  ["simulated_motion", "Math.abs(coordinate) <= 1", "Math.abs(coordinate) < 1"],
  ["simulated_motion", "gas.volumeM3 > 0", "true"],
];

const lastBit = "the last bit of a double, of which a 16th of a step shows one in a thousand million";
const noBits = "what is cut off here is cut off by the array that it goes into";

/** Mutants that no vector tells from the decoder, and why. */
const equivalents: readonly (readonly [...Mutant, why: string])[] = [
  ["move_reader", "+ residuals[at]) | 0;", "+ residuals[at]);", noBits],
  ["residual_tables", "52960, 56420, 58420", "52960, 56421, 58420", "its table is the same"],
  [
    "simulated_motion",
    "(middle[0] + middle[1] + middle[2]) * (2 / 3)",
    "(2 * (middle[0] + middle[1] + middle[2])) / 3",
    lastBit,
  ],
  ["simulated_motion", "+ falls * gx)", ") + falls * gx", lastBit],
];

let folder: string;
let made = 0;

before(() => {
  folder = mkdtempSync(join(tmpdir(), "mutants-"));
  writeFileSync(join(folder, "package.json"), '{ "type": "module" }');
});
after(() => rmSync(folder, { recursive: true }));

/** A copy of the decoder, changed as it is told. */
async function decoderWith(mutant?: Mutant): Promise<Codec> {
  const copy = join(folder, String(made++));
  cpSync(fileURLToPath(new URL("../../src/codec", import.meta.url)), join(copy, "codec"), { recursive: true });
  cpSync(fileURLToPath(new URL("../../src/errors.js", import.meta.url)), join(copy, "errors.js"));
  if (mutant) {
    const [file, from, to] = mutant;
    const path = join(copy, "codec", `${file}.js`);
    const parts = readFileSync(path, "utf8").split(from);
    assert.equal(parts.length, 2, `${file}: "${from}" stands there once`);
    writeFileSync(path, parts.join(to));
  }
  const load = (file: string) => import(pathToFileURL(join(copy, "codec", `${file}.js`)).href);
  return { ...(await load("frame_reader")), ...(await load("mesh_order")), ...(await load("simulated_motion")) };
}

/** A decoder that throws anything but a refusal fails, too. */
function isFailing(codec: Codec): boolean {
  try {
    return firstWrong(codec) !== undefined;
  } catch {
    return true;
  }
}

test("a copy of the decoder passes the golden vectors", async () => {
  assert.equal(firstWrong(await decoderWith()), undefined);
});

test("every mutant of the decoder fails the golden vectors", async () => {
  const passed: string[] = [];
  for (const mutant of mutants) {
    if (!isFailing(await decoderWith(mutant))) passed.push(mutant.join(" | "));
  }
  assert.deepEqual(passed, []);
});

test("those that are listed as equivalent pass", async () => {
  for (const [file, from, to, why] of equivalents) {
    assert.ok(!isFailing(await decoderWith([file, from, to])), `${file}: ${to}: ${why}`);
  }
});
