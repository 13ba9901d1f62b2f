// What the colours of the bodies say: a bar with its ends in numbers.
import { type ColourMap, diverging, sequential } from "./colour_map.js";
import { element } from "./element.js";

export type Field = "body" | "pressure" | "strain";

export interface Scale {
  readonly map: ColourMap;
  readonly low: number;
  readonly high: number;
}

/** The scale of a field whose values went from `low` to `high`. */
export function scaleOf(field: Field, low: number, high: number): Scale {
  if (field === "strain") return { map: diverging, low: -high, high };
  return { map: sequential, low, high };
}

function pressureText(pa: number): string {
  return Math.abs(pa) >= 1000 ? `${(pa / 1000).toPrecision(3)} kPa` : `${pa.toPrecision(3)} Pa`;
}

export class Legend {
  private text = "";

  show(field: Field, { map, low, high }: Scale, since: string): void {
    const isStrain = field === "strain";
    const percent = (value: number) => `${value > 0 ? "+" : "−"}${Math.abs(100 * value).toPrecision(2)} %`;
    const ends = isStrain ? [percent(low), "0", percent(high)] : [pressureText(low), "", pressureText(high)];
    const title = isStrain ? `Strain of the edges, against ${since}` : "Pressure of the gas over the outside";
    const text = [title, ...ends].join("|");
    element("legend").hidden = false;
    if (text === this.text) return;
    this.text = text;
    element("legend-title").textContent = title;
    element("legend-bar").style.background = map.gradient();
    element("legend-ends").replaceChildren(
      ...ends.map((end) => Object.assign(document.createElement("span"), { textContent: end })),
    );
  }

  hide(): void {
    element("legend").hidden = true;
    this.text = "";
  }
}
