// The sliders: gravity, gas and stiffness of a world, as its scene has them and as they are changed.
import { type Client, PneumaError, type Scene } from "../src/index.js";
import { element } from "./element.js";
import { Latest } from "./latest.js";

type Changes = Parameters<Client["edit"]>[1]["changes"];

interface Slider {
  readonly input: HTMLInputElement;
  readonly output: HTMLOutputElement;
  text(value: number): string;
}

/** Gas and stiffness go by factors of what they were: powers of two, one a unit of the slider. */
function factorText(power: number): string {
  const factor = 2 ** power;
  return `× ${factor.toFixed(factor < 1 ? 2 : 1)}`;
}

export class Sliders {
  private readonly effect = element<HTMLOutputElement>("effect");
  private readonly gravity: Slider;
  private readonly gas: Slider;
  private readonly stiffness: Slider;
  private scene: Scene | undefined;
  private client: Client | undefined;
  private world = "";

  constructor() {
    this.gravity = this.slider(
      "gravity",
      (down) => `${down.toFixed(1)} m/s²`,
      (down) => {
        const { x = 0, z = 0 } = this.scene?.gravity ?? {};
        return [{ change: { case: "setGravity", value: { x, y: -down, z } } }];
      },
    );
    this.gas = this.slider("gas", factorText, (power) =>
      (this.scene?.softBodies ?? [])
        .filter(({ gas }) => gas?.moles !== undefined)
        .map(({ name, gas }) => {
          return { change: { case: "changeSoftBody", value: { name, gas: { moles: gas!.moles! * 2 ** power } } } };
        }),
    );
    this.stiffness = this.slider("stiffness", factorText, (power) =>
      (this.scene?.softBodies ?? [])
        .filter(({ springs }) => springs?.stiffnessNM !== undefined)
        .map(({ name, springs }) => {
          const stiffnessNM = springs!.stiffnessNM! * 2 ** power;
          return { change: { case: "changeSoftBody", value: { name, springs: { stiffnessNM } } } };
        }),
    );
  }

  /** Takes a world's scene for what the sliders begin with. */
  begin(client: Client, world: string, scene: Scene): void {
    this.client = client;
    this.world = world;
    this.scene = scene;
    this.effect.value = "";
    this.set(this.gravity, -(scene.gravity?.y ?? 0), true);
    this.set(
      this.gas,
      0,
      scene.softBodies.some(({ gas }) => (gas?.moles ?? 0) > 0),
    );
    this.set(
      this.stiffness,
      0,
      scene.softBodies.some(({ springs }) => springs?.stiffnessNM !== undefined),
    );
  }

  massKg(body: string): number {
    return this.scene?.softBodies.find(({ name }) => name === body)?.massKg ?? 1;
  }

  /** Says what a change did, or why it was refused. */
  say(text: string, isRefused: boolean): void {
    this.effect.value = text;
    this.effect.classList.toggle("refused", isRefused);
  }

  private slider(id: string, text: (value: number) => string, changesOf: (value: number) => Changes): Slider {
    const input = element<HTMLInputElement>(id);
    const output = input.parentElement!.querySelector("output")!;
    const send = async (value: number) => {
      const { client, world } = this;
      if (!client) return;
      const { tick } = await client.edit(world, { changes: changesOf(value) ?? [] });
      this.say(`In effect from tick ${tick}`, false);
    };
    const changes = new Latest<number>(send, (error) => this.say((error as PneumaError).message, true));
    input.addEventListener("input", () => {
      output.value = text(input.valueAsNumber);
      changes.put(input.valueAsNumber);
    });
    return { input, output, text };
  }

  private set({ input, output, text }: Slider, value: number, isUsable: boolean): void {
    input.disabled = !isUsable;
    input.value = String(value);
    output.value = isUsable ? text(input.valueAsNumber) : "none";
  }
}
