// Numbers as colours: maps whose steps look even, and the scale that a legend shows.
import { type Colour, css, oklch } from "./colours.js";

const steps = 256;

export class ColourMap {
  private readonly table = new Float32Array(3 * steps);

  constructor(colourAt: (fraction: number) => Colour) {
    for (let i = 0; i < steps; ++i) this.table.set(colourAt(i / (steps - 1)), 3 * i);
  }

  at(fraction: number): Colour {
    const i = 3 * this.step(fraction);
    return [this.table[i]!, this.table[i + 1]!, this.table[i + 2]!];
  }

  /** Writes the linear colour of a fraction, 0 to 1, what is past them as they are. */
  write(fraction: number, colours: Float32Array, at: number): void {
    const i = 3 * this.step(fraction);
    colours[at] = this.table[i]!;
    colours[at + 1] = this.table[i + 1]!;
    colours[at + 2] = this.table[i + 2]!;
  }

  /** As a style sheet's background, from left to right. */
  gradient(): string {
    const stops = Array.from({ length: 17 }, (_, i) => css(this.at(i / 16)));
    return `linear-gradient(to right, ${stops.join(", ")})`;
  }

  private step(fraction: number): number {
    return fraction > 0 ? Math.min(steps - 1, Math.round(fraction * (steps - 1))) : 0;
  }
}

/** From little, dark blue, to much, light yellow: lightness and hue go evenly. */
export const sequential = new ColourMap((fraction) => {
  const chroma = 0.06 + 0.07 * Math.sin(Math.PI * fraction);
  return oklch(0.3 + 0.62 * fraction, chroma, 285 - 180 * fraction);
});

/** From blue through a light grey in the middle to red: lightness falls to both sides alike. */
export const diverging = new ColourMap((fraction) => {
  const side = 2 * fraction - 1;
  return oklch(0.94 - 0.46 * Math.abs(side), 0.15 * Math.abs(side), side < 0 ? 255 : 30);
});

/** The least of 1, 2, 5, 10... that is not below a positive number. */
export function niceCeiling(value: number): number {
  const unit = 10 ** Math.floor(Math.log10(value));
  return unit * [1, 2, 5, 10].find((factor) => factor * unit >= value * (1 - 1e-9))!;
}
