// Holds the simulated prediction to the golden vectors, bit by bit.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { makeMeshOrder } from "../../src/codec/mesh_order.js";
import { SimulatedMotion } from "../../src/codec/simulated_motion.js";

const path = join(process.env["PNEUMA_SOURCE"] ?? "../..", "tests/golden/simulated_motion.txt");
const records = readFileSync(path, "utf8")
  .split("\n\n")
  .map((record) => record.split("\n").filter((line) => line !== "" && !line.startsWith("#")))
  .filter((lines) => lines.length > 0)
  .map((lines) => lines.map((line): [string, string] => [line.split(" ", 1)[0]!, line.slice(line.indexOf(" ") + 1)]));

assert.ok(records.length >= 4);
for (const record of records) {
  test(`a simulated body ${record[0]![1]} is where the golden vectors have it`, () => {
    const all = (key: string) =>
      record.filter(([name]) => name === key).map(([, value]) => value.split(" ").map(Number));
    const one = (key: string) => all(key)[0]!;
    const [vertexCount, ...indices] = one("mesh");
    const mesh = { vertexCount: vertexCount!, indices };
    const [pressurePa, volumeM3, exponent65536ths, outsidePa] = one("gas") as [number, number, number, number];
    const mechanics = {
      frameS: one("frame_s")[0]!,
      substeps: one("substeps")[0]!,
      massesKg: one("masses_kg"),
      restLengthsM: one("rest_lengths_m"),
      stiffnessesNM: one("stiffnesses_n_m"),
      dampingNSM: one("damping_n_s_m")[0]!,
      gas: { pressurePa, volumeM3, exponent65536ths, outsidePa },
      gravityMS2: one("gravity_m_s2"),
      planes: all("plane").map(([x, y, z, offsetM, restitution, friction]) => ({
        normal: [x!, y!, z!],
        offsetM: offsetM!,
        restitution: restitution!,
        friction: friction!,
      })),
    };
    const motion = new SimulatedMotion(makeMeshOrder(mesh), mesh, mechanics, one("grid_step_m")[0]!);
    const points = Float64Array.from(one("points"));
    const [first, ...velocitiesAfter] = all("velocities");
    const velocities = Int32Array.from(first!);
    const drift = new Int32Array(points.length);
    const moves = all("moves");
    assert.ok(moves.length >= 3);
    for (const [frame, expected] of all("drift").entries()) {
      motion.predict(points, velocities, drift);
      assert.deepEqual([...drift], expected, `drift of frame ${frame}`);
      motion.correct(Int32Array.from(moves[frame]!), velocities);
      assert.deepEqual([...velocities], velocitiesAfter[frame], `velocities of frame ${frame}`);
      for (const [i, move] of moves[frame]!.entries()) points[i]! += move;
    }
  });
}
