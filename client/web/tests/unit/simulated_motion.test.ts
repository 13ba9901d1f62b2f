// Shows that mechanics which cannot be are refused. That bodies move as they should, the golden vectors show
// (frame_reader.test.ts).
import assert from "node:assert/strict";
import { test } from "node:test";
import type { Mechanics } from "../../src/codec/simulated_motion.js";
import { StreamReaders } from "../../src/decoder.js";
import { goldenBodies } from "../golden.js";

const [first] = goldenBodies();

test("mechanics that cannot be are refused with the frames that need them", () => {
  const { mesh, mechanics } = first!;
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
  const mechanics = { ...first!.mechanics, massesKg: [1], stiffnessesNM: [1], restLengthsM: [] };
  const [plane] = mechanics.planes;
  const readers = new StreamReaders();
  readers.begin(1, [mesh, mesh], 1, [
    { ...mechanics, substeps: 4, planes: [plane!] },
    { ...mechanics, substeps: 9, planes: [] },
  ]);
  assert.throws(() => readers.decode(1, Uint8Array.of(5), undefined, 0), { code: "UNSUPPORTED", where: "mechanics" });
});
