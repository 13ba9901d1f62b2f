// The sliders of a world: what they are about is in quantities.ts.
import { say } from "./effect.js";
import { allBodies, damping, gas, gravity, Pump, stiffness, temperature, Wind } from "./quantities.js";
import { Slider } from "./slider.js";
import type { WorldEdits } from "./world_edits.js";

// While gas flows, its amount is asked for so often.
const flowIntervalMs = 1000;

export class Sliders {
  private readonly factors = [gas(allBodies), stiffness(allBodies), damping(allBodies)] as const;
  private readonly pump = new Pump();
  private readonly wind = new Wind();
  private readonly sliders: readonly Slider[];

  constructor(edits: WorldEdits) {
    const tell = (tick: bigint) => say(`In effect from tick ${tick}`, "slider");
    const [gasFactor, stiffnessFactor, dampingFactor] = this.factors;
    this.sliders = [
      new Slider("gravity", gravity, edits, tell),
      new Slider("gas", gasFactor, edits, tell),
      new Slider("pump", this.pump, edits, tell),
      new Slider("temperature", temperature, edits, tell),
      new Slider("stiffness", stiffnessFactor, edits, tell),
      new Slider("damping", dampingFactor, edits, tell),
      new Slider("wind", this.wind, edits, tell),
    ];
    setInterval(() => {
      if (edits.scene && this.pump.isOpen(edits.scene)) void edits.stale();
    }, flowIntervalMs);
  }

  /** Shows what the scene has. */
  follow(): void {
    for (const slider of this.sliders) slider.follow();
  }

  /** Another world, or the same at its beginning. */
  forget(): void {
    for (const part of [...this.factors, this.pump, this.wind, ...this.sliders]) part.forget();
  }
}
