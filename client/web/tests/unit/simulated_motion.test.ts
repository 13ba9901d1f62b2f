// Holds the simulated prediction to the golden vectors, bit by bit, and to refuse mechanics that cannot be.
import assert from "node:assert/strict";
import { test } from "node:test";
import { makeMeshOrder } from "../../src/codec/mesh_order.js";
import { checkMechanics, type Mechanics, SimulatedMotion } from "../../src/codec/simulated_motion.js";
import { StreamReaders } from "../../src/decoder.js";
import { mechanicsIn, readGolden } from "../golden.js";

const allRecords = readGolden("simulated_motion.txt")
  .split("\n\n")
  .map((record) => record.split("\n").filter((line) => line !== "" && !line.startsWith("#")))
  .filter((lines) => lines.length > 0)
  .map((lines) => lines.map((line): [string, string] => [line.split(" ", 1)[0]!, line.slice(line.indexOf(" ") + 1)]));

const records = allRecords.filter(([first]) => first![0] === "body");
const badRecords = allRecords.filter(([first]) => first![0] === "bad-body");

function allOf(record: readonly [string, string][], key: string): number[][] {
  return record.filter(([name]) => name === key).map(([, value]) => value.split(" ").map(Number));
}

function bodyOf(record: readonly [string, string][]) {
  const [vertexCount, ...indices] = allOf(record, "mesh")[0]!;
  return { mesh: { vertexCount: vertexCount!, indices }, mechanics: mechanicsIn(record)! };
}

assert.ok(records.length >= 4);
for (const record of records) {
  test(`a simulated body ${record[0]![1]} is where the golden vectors have it`, () => {
    const { mesh, mechanics } = bodyOf(record);
    const order = makeMeshOrder(mesh);
    const gridStepM = allOf(record, "grid_step_m")[0]![0]!;
    checkMechanics(order, mechanics, gridStepM);
    const motion = new SimulatedMotion(order, mesh, mechanics, gridStepM);
    const points = Float64Array.from(allOf(record, "points")[0]!);
    const [first, ...velocitiesAfter] = allOf(record, "velocities");
    let velocities: Int32Array = Int32Array.from(first!);
    const drift = new Int32Array(points.length);
    const moves = allOf(record, "moves");
    assert.ok(moves.length >= 3);
    for (const [frame, expected] of allOf(record, "drift").entries()) {
      motion.predict(points, velocities, drift);
      assert.deepEqual([...drift], expected, `drift of frame ${frame}`);
      velocities = motion.correct(Int32Array.from(moves[frame]!));
      assert.deepEqual([...velocities], velocitiesAfter[frame], `velocities of frame ${frame}`);
      for (const [i, move] of moves[frame]!.entries()) points[i]! += move;
    }
  });
}

assert.ok(badRecords.length >= 2);
for (const record of badRecords) {
  test(`a simulated body ${record[0]![1]} is refused`, () => {
    const { mesh, mechanics } = bodyOf(record);
    const gridStepM = allOf(record, "grid_step_m")[0]![0]!;
    assert.throws(() => checkMechanics(makeMeshOrder(mesh), mechanics, gridStepM), { code: "UNSUPPORTED" });
  });
}

test("mechanics that cannot be are refused with the frames that need them", () => {
  const { mesh, mechanics } = bodyOf(records[0]!);
  const refused = (changed: Partial<Mechanics>, where: string) => {
    const readers = new StreamReaders();
    readers.begin(1, [mesh], 1, [{ ...mechanics, ...changed }]);
    assert.throws(() => readers.decode(1, Uint8Array.of(5), undefined, 0), { code: "UNSUPPORTED", where });
  };
  refused({ substeps: 0 }, "mechanics.substeps");
  refused({ substeps: 65 }, "mechanics.substeps");
  refused({ frameS: NaN }, "mechanics.frame_s");
  refused({ massesKg: [1, 1] }, "mechanics.masses_kg");
  refused({ restLengthsM: mechanics.restLengthsM.slice(1) }, "mechanics.rest_lengths_m");
  refused({ stiffnessesNM: [-1] }, "mechanics.stiffnesses_n_m");
  refused({ dampingNSM: -1 }, "mechanics.damping_n_s_m");
  refused({ gas: { ...mechanics.gas, volumeM3: 0 } }, "mechanics.gas");
  refused({ gravityMS2: [0, Infinity, 0] }, "mechanics.gravity_m_s2");
  refused({ planes: [{ ...mechanics.planes[0]!, normal: [0, 1.25, 0] }] }, "mechanics.planes");
  refused({ planes: [{ ...mechanics.planes[0]!, normal: [0, 1, NaN] }] }, "mechanics.planes");
  refused({ frameS: 1e200 }, "mechanics.frame_s");
  refused({ gas: { ...mechanics.gas, pressurePa: 1e308 }, frameS: 1e3 }, "mechanics.frame_s");
  refused({ planes: Array.from({ length: 17 }, () => mechanics.planes[0]!) }, "mechanics.planes");
});

test("more than may be simulated is refused", () => {
  const mesh = { vertexCount: 65_536, indices: [] };
  const mechanics = { ...bodyOf(records[0]!).mechanics, massesKg: [1], stiffnessesNM: [1], restLengthsM: [] };
  const [plane] = mechanics.planes;
  const readers = new StreamReaders();
  readers.begin(1, [mesh, mesh], 1, [
    { ...mechanics, substeps: 4, planes: [plane!] },
    { ...mechanics, substeps: 9, planes: [] },
  ]);
  assert.throws(() => readers.decode(1, Uint8Array.of(5), undefined, 0), { code: "UNSUPPORTED", where: "mechanics" });
});
