// Shadows follow how many pictures a second there are, down and up again.
import assert from "node:assert/strict";
import { test } from "node:test";
import { ShadowGauge, shadowQuality } from "../../viewer/shadow_quality.js";

/** A gauge that counts pictures at a rate from then on. */
class Pictures {
  readonly gauge = new ShadowGauge();
  private nowMs = 0;

  at(hz: number, seconds: number): string {
    for (const endMs = this.nowMs + 1000 * seconds; this.nowMs < endMs; this.nowMs += 1000 / hz) {
      this.gauge.count(this.nowMs);
    }
    return this.gauge.quality;
  }
}

test("slow pictures take the shadows, fast ones bring them back", () => {
  const pictures = new Pictures();
  assert.equal(pictures.at(60, 10), "soft");
  assert.equal(pictures.at(12, 6), "hard");
  assert.equal(pictures.at(12, 10), "none");
  assert.equal(pictures.at(30, 60), "none"); // not so fast that there is room for more
  assert.equal(pictures.at(60, 120), "soft");
});

test("shadows that are too slow come back later and later", () => {
  const pictures = new Pictures();
  const waits = [1, 2, 3].map(() => {
    while (pictures.at(12, 0.5) === "soft");
    let waitedS = 0;
    while (pictures.at(60, 0.5) !== "soft") waitedS += 0.5;
    return waitedS;
  });
  assert.ok(waits[0]! < waits[1]! && waits[1]! < waits[2]!, waits.join(" "));
});

test("a page that was not seen for a while is not slow by that", () => {
  const pictures = new Pictures();
  for (let time = 0; time < 10; ++time) {
    pictures.at(60, 1);
    pictures.at(0.1, 10);
  }
  assert.equal(pictures.gauge.quality, "soft");
});

test("a gauge begins with what was kept, and with the best where that is no quality", () => {
  assert.equal(new ShadowGauge(shadowQuality("none")).quality, "none");
  assert.equal(new ShadowGauge(shadowQuality("hard")).quality, "hard");
  assert.equal(new ShadowGauge(shadowQuality("much")).quality, "soft");
  assert.equal(new ShadowGauge(shadowQuality(null)).quality, "soft");
});
