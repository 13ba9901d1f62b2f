// What is known of one body at a moment, in words and units.
import type { Frame, Scene, Stats } from "../src/index.js";
import { short } from "./quantities.js";

export interface Known {
  readonly stats: Stats;
  readonly scene: Scene;
  /** The newest; undefined: none has come. */
  readonly frame: Frame | undefined;
  /** Whether its contacts are all that there are. */
  readonly hasContacts: boolean;
}

export type Fact = readonly [name: string, value: string];
export interface Vector {
  readonly x: number;
  readonly y: number;
  readonly z: number;
}

export const factNames = {
  mass: "Mass",
  volume: "Volume",
  gas: "Gas",
  pressure: "Over-pressure",
  temperature: "Temperature",
  place: "Place, m",
  speed: "Speed",
  kinetic: "Kinetic energy",
  elastic: "Elastic energy",
  gasEnergy: "Gas energy",
  gravityEnergy: "Gravity energy",
  contacts: "Contacts",
  state: "State",
} as const;

const zeroCelsiusK = 273.15;
const nowhere = { x: 0, y: 0, z: 0 };

function length({ x, y, z }: Vector): number {
  return Math.hypot(x, y, z);
}

export function quantityText(value: number, unit: string): string {
  return `${short(value)} ${unit}`;
}

export function placeText({ x, y, z }: Vector = nowhere): string {
  return [x, y, z].map((each) => each.toFixed(2)).join(", ");
}

function stateText({ asleep, frozen }: { readonly asleep: boolean; readonly frozen: boolean }): string {
  return frozen ? "frozen" : asleep ? "asleep" : "awake";
}

function contactsOf(name: string, { frame, hasContacts }: Known): Fact[] {
  if (!frame || !hasContacts) return [];
  const soft = frame.layout.softBodies.findIndex((body) => body.name === name);
  const solid = frame.layout.solids.findIndex((body) => body.name === name);
  const isOfIt = (each: Frame["contacts"][number]) =>
    soft >= 0 ? each.soft === soft || each.otherSoft === soft : each.otherSolid === solid;
  return [[factNames.contacts, String(frame.contacts.filter(isOfIt).length)]];
}

function softFacts(body: Stats["softBodies"][number], known: Known): Fact[] {
  const massKg = known.scene.softBodies.find(({ name }) => name === body.name)?.massKg || 1;
  const hasGas = body.moles > 0;
  const gas: Fact[] = [
    [factNames.gas, quantityText(body.moles, "mol")],
    [factNames.pressure, quantityText(body.pressurePa, "Pa")],
    [factNames.temperature, quantityText(body.temperatureK - zeroCelsiusK, "°C")],
  ];
  return [
    [factNames.mass, quantityText(massKg, "kg")],
    [factNames.volume, quantityText(body.volumeM3, "m³")],
    ...(hasGas ? gas : []),
    [factNames.place, placeText(body.centreOfMass)],
    [factNames.speed, quantityText(length(body.momentum ?? nowhere) / massKg, "m/s")],
    [factNames.kinetic, quantityText(body.kineticJ, "J")],
    [factNames.elastic, quantityText(body.elasticJ, "J")],
    ...(hasGas ? ([[factNames.gasEnergy, quantityText(body.gasJ, "J")]] as const) : []),
    [factNames.gravityEnergy, quantityText(body.gravityJ, "J")],
    ...contactsOf(body.name, known),
    [factNames.state, stateText(body)],
  ];
}

function rigidFacts(body: Stats["rigidBodies"][number], known: Known): Fact[] {
  const massKg = known.scene.rigidBodies.find(({ name }) => name === body.name)?.massKg || 1;
  return [
    [factNames.mass, quantityText(massKg, "kg")],
    [factNames.place, placeText(body.position)],
    [factNames.speed, quantityText(length(body.velocity ?? nowhere), "m/s")],
    ...contactsOf(body.name, known),
    [factNames.state, stateText(body)],
  ];
}

/** Of a soft or rigid body; none of an obstacle, which only stands. */
export function factsOf(name: string, known: Known): readonly Fact[] {
  const soft = known.stats.softBodies.find((body) => body.name === name);
  if (soft) return softFacts(soft, known);
  const rigid = known.stats.rigidBodies.find((body) => body.name === name);
  return rigid ? rigidFacts(rigid, known) : [];
}
