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

type Fact = readonly [name: string, value: string];
interface Vector {
  readonly x: number;
  readonly y: number;
  readonly z: number;
}

const zeroCelsiusK = 273.15;
const nowhere = { x: 0, y: 0, z: 0 };

function length({ x, y, z }: Vector): number {
  return Math.hypot(x, y, z);
}

function placeText({ x, y, z }: Vector = nowhere): string {
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
  return [["Contacts", String(frame.contacts.filter(isOfIt).length)]];
}

function softFacts(body: Stats["softBodies"][number], known: Known): Fact[] {
  const massKg = known.scene.softBodies.find(({ name }) => name === body.name)?.massKg || 1;
  const hasGas = body.moles > 0;
  const gas: Fact[] = [
    ["Gas", `${short(body.moles)} mol`],
    ["Over-pressure", `${short(body.pressurePa)} Pa`],
    ["Temperature", `${short(body.temperatureK - zeroCelsiusK)} °C`],
  ];
  return [
    ["Mass", `${short(massKg)} kg`],
    ["Volume", `${short(body.volumeM3)} m³`],
    ...(hasGas ? gas : []),
    ["Place, m", placeText(body.centreOfMass)],
    ["Speed", `${short(length(body.momentum ?? nowhere) / massKg)} m/s`],
    ["Kinetic", `${short(body.kineticJ)} J`],
    ["Elastic", `${short(body.elasticJ)} J`],
    ...(hasGas ? ([["In the gas", `${short(body.gasJ)} J`]] as const) : []),
    ["By height", `${short(body.gravityJ)} J`],
    ...contactsOf(body.name, known),
    ["State", stateText(body)],
  ];
}

function rigidFacts(body: Stats["rigidBodies"][number], known: Known): Fact[] {
  const massKg = known.scene.rigidBodies.find(({ name }) => name === body.name)?.massKg || 1;
  return [
    ["Mass", `${short(massKg)} kg`],
    ["Place, m", placeText(body.position)],
    ["Speed", `${short(length(body.velocity ?? nowhere))} m/s`],
    ...contactsOf(body.name, known),
    ["State", stateText(body)],
  ];
}

/** Of a soft or rigid body; none of an obstacle, which only stands. */
export function factsOf(name: string, known: Known): readonly Fact[] {
  const soft = known.stats.softBodies.find((body) => body.name === name);
  if (soft) return softFacts(soft, known);
  const rigid = known.stats.rigidBodies.find((body) => body.name === name);
  return rigid ? rigidFacts(rigid, known) : [];
}
