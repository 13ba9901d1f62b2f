// One thing of the world that is chosen: its name, its own sliders, and its end.
import { create } from "@bufbuild/protobuf";
import { type Scene, SceneSchema } from "../src/index.js";
import { refuse, say } from "./effect.js";
import { element } from "./element.js";
import type { Change } from "./inverse_edit.js";
import { type Bodies, gas, stiffness } from "./quantities.js";
import { Slider } from "./slider.js";
import type { WorldEdits } from "./world_edits.js";

const removals = [
  ["softBodies", "removeSoftBody"],
  ["rigidBodies", "removeRigidBody"],
  ["colliders", "removeCollider"],
] as const;

const noScene = create(SceneSchema);

const groups = { softBodies: "Soft bodies", rigidBodies: "Rigid bodies", colliders: "Obstacles" } as const;

/** The joints that hold a body go before it. */
function withoutJoints({ joints }: Scene, body: string): Change[] {
  const held = joints.filter(({ first, second }) => first?.body.value === body || second?.body.value === body);
  return held.map(({ name }) => ({ change: { case: "removeJoint", value: name } }));
}

export class Selection {
  private readonly choice = element<HTMLSelectElement>("selected");
  private readonly removeButton = element<HTMLButtonElement>("remove");
  private readonly own = element("selected-own");
  private readonly factors;
  private readonly sliders: readonly Slider[];
  private name_ = "";
  private listed = "";

  constructor(
    private readonly edits: WorldEdits,
    private readonly highlight: (name: string) => void,
  ) {
    const bodies: Bodies = ({ softBodies }) => softBodies.filter(({ name }) => name === this.name_);
    const tell = (tick: bigint) => say(`${this.name_}: in effect from tick ${tick}`, "slider");
    this.factors = [gas(bodies), stiffness(bodies)] as const;
    this.sliders = [
      new Slider("own-gas", this.factors[0], edits, tell),
      new Slider("own-stiffness", this.factors[1], edits, tell),
    ];
    this.choice.addEventListener("change", () => this.select(this.choice.value));
    this.removeButton.addEventListener("click", () => void this.remove().catch(refuse));
  }

  get name(): string {
    return this.name_;
  }

  /** "" selects nothing. */
  select(name: string): void {
    if (name !== this.name_) for (const slider of this.sliders) slider.forget();
    this.name_ = name;
    this.follow();
  }

  /** Selects it, where its controls are in sight. */
  show(name: string): void {
    this.select(name);
    if (this.name_ !== "") this.choice.parentElement!.parentElement!.scrollIntoView({ block: "nearest" });
  }

  forget(): void {
    for (const part of [...this.factors, ...this.sliders]) part.forget();
    this.select("");
  }

  /** Shows what the scene has. */
  follow(): void {
    const scene = this.edits.scene ?? noScene;
    if (!removals.some(([list]) => scene[list].some(({ name }) => name === this.name_))) this.name_ = "";
    this.list(scene);
    this.choice.value = this.name_;
    this.removeButton.disabled = this.name_ === "";
    this.own.hidden = !scene.softBodies.some(({ name }) => name === this.name_);
    this.highlight(this.name_);
    for (const slider of this.sliders) slider.follow();
  }

  async remove(): Promise<void> {
    const name = this.name_;
    if (name === "") return;
    const made = await this.edits.make((scene) => {
      const found = removals.find(([list]) => scene[list].some((item) => item.name === name));
      if (!found) return undefined;
      const change: Change = { change: { case: found[1], value: name } };
      return {
        says: `Remove ${name}`,
        changes: [...withoutJoints(scene, name), change, ...this.withItsMesh(scene, name)],
      };
    });
    if (made) say(`${name} is gone from tick ${made.reply.tick} on`);
  }

  /** A mesh that was written out takes room, and goes with the last body that is made of it. */
  private withItsMesh({ softBodies, meshes }: Scene, name: string): Change[] {
    const mesh = softBodies.find((body) => body.name === name)?.mesh;
    const isLast = softBodies.filter((body) => body.mesh === mesh).length === 1;
    const isWritten = meshes.find((each) => each.name === mesh)?.shape.case === "triangles";
    return mesh !== undefined && isLast && isWritten ? [{ change: { case: "removeMesh", value: mesh } }] : [];
  }

  private list(scene: Scene): void {
    const listed = removals.map(([list]) => scene[list].map(({ name }) => name));
    if (JSON.stringify(listed) === this.listed) return;
    this.listed = JSON.stringify(listed);
    const lists = removals.map(([list], i) => {
      const group = document.createElement("optgroup");
      group.label = groups[list];
      group.append(...listed[i]!.map((name) => new Option(name, name)));
      return group;
    });
    this.choice.replaceChildren(new Option("nothing", ""), ...lists.filter(({ children }) => children.length > 0));
  }
}
