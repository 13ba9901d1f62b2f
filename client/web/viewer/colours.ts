// Colours by how they look: Oklab (B. Ottosson, "A perceptual color space for image processing", 2020), in which equal
// distances are seen as equal.

/** Red, green and blue, linear, 0 to 1. */
export type Colour = readonly [number, number, number];

/** @param hue in degrees */
export function oklch(lightness: number, chroma: number, hue: number): Colour {
  const angle = (hue * Math.PI) / 180;
  const a = chroma * Math.cos(angle);
  const b = chroma * Math.sin(angle);
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  const inGamut = (value: number) => Math.min(1, Math.max(0, value));
  return [
    inGamut(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
    inGamut(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
    inGamut(-0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s),
  ];
}

/** As style sheets write it. */
export function css(colour: Colour): string {
  const encoded = (value: number) => (value <= 0.0031308 ? 12.92 * value : 1.055 * value ** (1 / 2.4) - 0.055);
  return `rgb(${colour.map((value) => Math.round(255 * encoded(value))).join(" ")})`;
}

// Lightness and hue: apart from each other as far as they can be, on light paper and on dark.
const tones = [
  [0.68, 35],
  [0.62, 250],
  [0.78, 85],
  [0.66, 145],
  [0.58, 300],
  [0.73, 350],
  [0.74, 200],
] as const;
const shades = [0, -0.12, 0.12];

/** Of the body at this place of a layout; the first 21 differ. */
export function bodyColour(index: number): Colour {
  const [lightness, hue] = tones[index % tones.length]!;
  return oklch(lightness + shades[Math.floor(index / tones.length) % shades.length]!, 0.13, hue);
}
