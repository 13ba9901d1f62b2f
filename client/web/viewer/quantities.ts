// What the sliders are about: of the whole world, or of some of its soft bodies.
import type { Scene, SoftBody } from "../src/index.js";
import type { Change } from "./inverse_edit.js";
import type { Quantity } from "./slider.js";
import { temperatureUnsetK } from "./unset.js";

/** The bodies that a slider is for. */
export type Bodies = (scene: Scene) => SoftBody[];

export const allBodies: Bodies = ({ softBodies }) => softBodies;

// A pump that is fully open moves what a body had in it at first in so long.
const pumpS = 4;
// Of what is called air where a scene has none, and of a skin in it.
const airKgM3 = 1.2;
const dragNormal = 1;

function mean(values: readonly number[]): number | undefined {
  return values.length === 0 ? undefined : values.reduce((sum, value) => sum + value, 0) / values.length;
}

type BodyChange = Extract<Change["change"], { case: "changeSoftBody" }>["value"];

function changeBody(value: BodyChange): Change {
  return { change: { case: "changeSoftBody", value } };
}

/** Three digits, and no more. */
export function short(value: number): string {
  const size = Math.abs(value);
  return size !== 0 && (size < 0.001 || size >= 10_000) ? value.toExponential(1) : String(Number(value.toPrecision(3)));
}

/** An amount that each body has of its own, by powers of two of what it was when this page saw it first. */
export class Factor implements Quantity {
  private readonly first = new Map<string, number>();

  constructor(
    readonly says: string,
    private readonly bodies: Bodies,
    private readonly amountOf: (body: SoftBody) => number | undefined,
    private readonly change: (amount: number) => BodyChange,
    private readonly unit: string,
  ) {}

  /** For another world, or the same at its beginning: what is there is × 1. */
  forget(): void {
    this.first.clear();
  }

  valueOf(scene: Scene): number | undefined {
    const powers = this.bodies(scene).flatMap((body) => {
      const first = this.firstOf(body);
      return first === undefined ? [] : [Math.log2(Math.max(this.amountOf(body) ?? 0, 1e-9 * first) / first)];
    });
    return mean(powers);
  }

  changesOf(scene: Scene, power: number): Change[] {
    return this.bodies(scene).flatMap((body) => {
      const first = this.firstOf(body);
      if (first === undefined) return [];
      return [changeBody({ name: body.name, ...this.change(first * 2 ** power) })];
    });
  }

  text(power: number, scene: Scene): string {
    const amounts = this.bodies(scene).flatMap((body) => {
      const first = this.firstOf(body);
      return first === undefined ? [] : [first * 2 ** power];
    });
    const amount = `${short(mean(amounts) ?? 0)} ${this.unit}`;
    const isSame = amounts.every((each) => short(each) === short(amounts[0]!));
    return amounts.length === 1 ? amount : `${amount} ${isSame ? "each" : "on average"}`;
  }

  private firstOf(body: SoftBody): number | undefined {
    const amount = this.amountOf(body);
    if (!this.first.has(body.name) && amount !== undefined && amount > 0) this.first.set(body.name, amount);
    return amount === undefined ? undefined : this.first.get(body.name);
  }
}

export function gas(bodies: Bodies): Factor {
  return new Factor(
    "Change the gas",
    bodies,
    ({ gas }) => gas?.moles,
    (moles) => ({ gas: { moles } }),
    "mol",
  );
}

export function stiffness(bodies: Bodies): Factor {
  return new Factor(
    "Change the stiffness",
    bodies,
    ({ springs }) => springs?.stiffnessNM,
    (stiffnessNM) => ({ springs: { stiffnessNM } }),
    "N/m",
  );
}

export function damping(bodies: Bodies): Factor {
  return new Factor(
    "Change the damping",
    bodies,
    ({ springs }) => springs?.dampingNSM,
    (dampingNSM) => ({ springs: { dampingNSM } }),
    "N s/m",
  );
}

export const gravity: Quantity = {
  says: "Change gravity",
  valueOf: (scene) => -(scene.gravity?.y ?? 0),
  changesOf: ({ gravity }, down) => {
    const { x = 0, z = 0 } = gravity ?? {};
    return [{ change: { case: "setGravity", value: { x, y: -down, z } } }];
  },
  text: (down) => `${down.toFixed(1)} m/s²`,
};

export const temperature: Quantity = {
  says: "Change the temperature",
  valueOf: ({ softBodies }) =>
    mean(softBodies.flatMap(({ gas }) => (gas ? [gas.temperatureK ?? temperatureUnsetK] : []))),
  changesOf: ({ softBodies }, temperatureK) =>
    softBodies.filter(({ gas }) => gas).map(({ name }) => changeBody({ name, gas: { temperatureK } })),
  text: (kelvin) => `${Math.round(kelvin - 273.15)} °C`,
};

/** In shares of the pump, in where positive: of what a body had in it when this page saw it first. */
export class Pump implements Quantity {
  readonly says = "Pump";
  private readonly first = new Map<string, number>();

  forget(): void {
    this.first.clear();
  }

  /** Whether any gas flows, so that there is another amount of it all the time. */
  isOpen({ softBodies }: Scene): boolean {
    return softBodies.some(({ gas }) => (gas?.flowMolS ?? 0) !== 0);
  }

  valueOf({ softBodies }: Scene): number | undefined {
    const pumped = softBodies.filter((body) => this.fullOf(body) > 0);
    return mean(pumped.map((body) => (body.gas?.flowMolS ?? 0) / this.fullOf(body)));
  }

  changesOf({ softBodies }: Scene, share: number): Change[] {
    return softBodies
      .filter(({ gas }) => gas)
      .map((body) => changeBody({ name: body.name, gas: { flowMolS: share * this.fullOf(body) } }));
  }

  text(share: number, { softBodies }: Scene): string {
    if (share === 0) return "off";
    const flow = softBodies.reduce((sum, body) => sum + share * this.fullOf(body), 0);
    return `${share > 0 ? "in" : "out"} ${short(Math.abs(flow))} mol/s`;
  }

  /** What flows through a pump that is fully open, in mol/s. */
  private fullOf({ name, gas }: SoftBody): number {
    const moles = gas?.moles ?? 0;
    if (!this.first.has(name) && moles > 0) this.first.set(name, moles);
    return gas ? (this.first.get(name) ?? 0) / pumpS : 0;
  }
}

/** Along the wind that the scene has, or x. Where there is no air for it, it brings some. */
export class Wind implements Quantity {
  readonly says = "Change the wind";
  private along = { x: 1, y: 0, z: 0 };

  forget(): void {
    this.along = { x: 1, y: 0, z: 0 };
  }

  valueOf({ atmosphere, softBodies }: Scene): number | undefined {
    const { x = 0, y = 0, z = 0 } = atmosphere?.wind ?? {};
    const speed = Math.hypot(x, y, z);
    if (speed > 0) this.along = { x: x / speed, y: y / speed, z: z / speed };
    return softBodies.length === 0 ? undefined : speed;
  }

  changesOf({ atmosphere, softBodies }: Scene, speed: number): Change[] {
    const { x, y, z } = this.along;
    const wind = { x: speed * x, y: speed * y, z: speed * z };
    if ((atmosphere?.densityKgM3 ?? 0) > 0) return [{ change: { case: "setWind", value: wind } }];
    const air = { pressurePa: atmosphere?.pressurePa ?? 0, densityKgM3: airKgM3, wind };
    const smooth = softBodies.filter(({ drag }) => !drag?.normal && !drag?.tangential);
    return [
      { change: { case: "setAtmosphere", value: air } },
      ...smooth.map(({ name }) => changeBody({ name, drag: { normal: dragNormal } })),
    ];
  }

  text(speed: number, { atmosphere }: Scene): string {
    const hasAir = (atmosphere?.densityKgM3 ?? 0) > 0;
    if (speed === 0) return hasAir ? "still" : "no air";
    return `${speed.toFixed(1)} m/s`;
  }
}
