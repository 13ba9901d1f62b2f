// What a person can do to the world that is shown, beside pulling at it: all controls of the panel but those of looking.
import { create } from "@bufbuild/protobuf";
import { Vector3 } from "three";
import { type Applied, type Client, type Frame, type Scene, SoftBodySchema, Vec3Schema } from "../src/index.js";
import { addition, kinds, usualRadiusM } from "./additions.js";
import { refuse, say } from "./effect.js";
import { element } from "./element.js";
import type { Tool } from "./hands.js";
import type { Change } from "./inverse_edit.js";
import type { Picture } from "./picture.js";
import { short } from "./quantities.js";
import { Selection } from "./selection.js";
import { Share, type Shared } from "./share.js";
import { Sliders } from "./sliders.js";
import { throwAt } from "./throwing.js";
import { Upload } from "./upload.js";
import { WorldEdits } from "./world_edits.js";
import { WorldsMade } from "./worlds_made.js";

/** What is shown at the moment. */
export interface Present extends Shared {
  readonly client: Client;
}

export class Controls {
  private readonly edits: WorldEdits;
  private readonly sliders: Sliders;
  private readonly selection: Selection;
  private readonly undoButton = element<HTMLButtonElement>("undo");
  private readonly redoButton = element<HTMLButtonElement>("redo");
  private readonly addKind = element<HTMLSelectElement>("add-kind");
  private readonly addSize = element<HTMLInputElement>("add-size");
  private frames: Frame[] = []; // the last two
  private world = "";
  private throwing: Promise<void> = Promise.resolve();

  /** @param open shows another world; null: any */
  constructor(
    private readonly picture: Picture,
    present: () => Present | undefined,
    open: (world: string | null) => void,
  ) {
    this.edits = new WorldEdits(
      () => this.follow(),
      refuse,
      (scene, changes) => this.asItIs(scene, changes),
    );
    this.sliders = new Sliders(this.edits);
    this.selection = new Selection(this.edits, (name) => picture.highlight(name));
    new Upload(this.edits, () => ({ frame: this.frames.at(-1), centre: picture.orbit.target.clone() }));
    new Share(
      this.edits,
      () => present() ?? { url: "", token: "", world: "" },
      () => picture.snapshot(),
    );
    new WorldsMade(present, open);
    this.listen();
  }

  /** Turns to a world, or looks again at the one that is shown. */
  async begin(client: Client, world: string): Promise<void> {
    if (world !== this.world) {
      this.frames = [];
      this.sliders.forget();
      this.selection.forget();
      say("");
    }
    this.world = world;
    await this.edits.begin(client, world);
  }

  /** No world is shown: there is nothing to change. */
  end(): void {
    this.frames = [];
    this.world = "";
    this.sliders.forget();
    this.edits.end();
    this.selection.forget();
  }

  take(frame: Frame): void {
    this.frames = [...this.frames.slice(-1), frame];
  }

  /** Somebody changed the world, maybe this page. */
  applied({ command }: Applied): void {
    const kind = command?.request.case;
    if (kind === "reset") {
      this.edits.forget();
      this.sliders.forget();
    }
    if (kind === "edit" || kind === "reset") void this.edits.stale();
  }

  /** Somebody may have changed the world. */
  missed(): void {
    void this.edits.stale();
  }

  /** Whether there is something that a reset would take from Undo. */
  get hasDeeds(): boolean {
    return this.edits.toUndo !== undefined;
  }

  /** The name of what is selected; "": nothing. */
  get selected(): string {
    return this.selection.name;
  }

  massKg(body: string): number {
    return this.edits.scene?.softBodies.find(({ name }) => name === body)?.massKg ?? 1;
  }

  /** The pointer touched the picture without drawing. */
  clicked(x: number, y: number, tool: Tool): void {
    if (tool === "throw") this.throw(this.picture.aim(x, y));
    else this.selection.show(this.picture.nameAt(x, y) ?? "");
  }

  private throw(target: Vector3): void {
    this.throwing = this.throwing.then(async () => {
      const frame = this.frames.at(-1);
      if (!frame) return;
      const { name, changes } = throwAt(await this.edits.fresh(), frame, this.picture.eye, target);
      const { tick } = await this.edits.make(`Throw ${name}`, changes);
      say(`${name} flies from tick ${tick} on`);
    });
    this.throwing = this.throwing.catch(refuse);
  }

  private listen(): void {
    const onClick = (id: string, action: () => Promise<void>) =>
      element(id).addEventListener("click", () => void action().catch(refuse));
    onClick("undo", async () => {
      const undone = await this.edits.undo();
      if (undone) say(`Taken back: ${undone.says}, from tick ${undone.tick} on`);
    });
    onClick("redo", async () => {
      const redone = await this.edits.redo();
      if (redone) say(`Done again: ${redone.says}, from tick ${redone.tick} on`);
    });
    onClick("add", () => this.add());
    element("throw").addEventListener("click", () => this.throw(this.picture.aim()));
    this.addSize.addEventListener("input", () => this.tellSize());
    for (const id of ["add-gas", "add-stiffness"]) {
      const input = element<HTMLInputElement>(id);
      const tell = () => (input.parentElement!.querySelector("output")!.value = `× ${short(2 ** input.valueAsNumber)}`);
      input.addEventListener("input", tell);
      tell();
    }
    this.addKind.addEventListener("change", () => this.tellKind());
  }

  private async add(): Promise<void> {
    const frame = this.frames.at(-1);
    if (!frame) return;
    const power = (id: string) => 2 ** element<HTMLInputElement>(id).valueAsNumber;
    const wish = {
      kind: this.addKind.value,
      radiusM: this.radiusM,
      gas: power("add-gas"),
      stiffness: power("add-stiffness"),
    };
    const { name, changes } = addition(await this.edits.fresh(), frame, wish, this.picture.orbit.target.clone());
    const { tick } = await this.edits.make(`Add ${name}`, changes);
    say(`${name} is there from tick ${tick} on`);
    await this.edits.fresh();
    this.selection.select(name);
  }

  /** The scene is another one, or what can be undone. */
  private follow(): void {
    this.sliders.follow();
    this.selection.follow();
    this.listKinds();
    const { toUndo, toRedo } = this.edits;
    this.undoButton.disabled = toUndo === undefined;
    this.undoButton.title = toUndo === undefined ? "Nothing to undo" : `Undo: ${toUndo} (Ctrl+Z)`;
    this.redoButton.disabled = toRedo === undefined;
    this.redoButton.title = toRedo === undefined ? "Nothing to redo" : `Redo: ${toRedo} (Ctrl+Shift+Z)`;
  }

  private get radiusM(): number {
    return Number((usualRadiusM(this.frames.at(-1)) * 2 ** this.addSize.valueAsNumber).toPrecision(2));
  }

  private tellSize(): void {
    this.addSize.parentElement!.querySelector("output")!.value = `${short(2 * this.radiusM)} m across`;
  }

  private tellKind(): void {
    const kind = this.addKind.value;
    const show = (id: string, isShown: boolean) => (element(id).parentElement!.hidden = !isShown);
    show("add-size", !kind.startsWith("copy:") && kind !== "floor");
    show("add-gas", kind === "soft-ball");
    show("add-stiffness", kind === "soft-ball");
    this.tellSize();
  }

  /** Of soft bodies of one mesh the first is offered to be copied. */
  private listKinds(): void {
    const { softBodies = [] } = this.edits.scene ?? {};
    const firsts = softBodies.filter((body, i) => softBodies.findIndex(({ mesh }) => mesh === body.mesh) === i);
    const options = [
      ...Object.entries(kinds).map(([kind, what]) => new Option(what, kind)),
      ...firsts.map(({ name }) => new Option(`Another ${name}`, `copy:${name}`)),
    ];
    const chosen = this.addKind.value;
    this.addKind.replaceChildren(...options);
    if (options.some(({ value }) => value === chosen)) this.addKind.value = chosen;
    this.tellKind();
  }

  /** With the soft bodies that are to go as they are now: put back, they are where they were, and as fast on the whole. */
  private asItIs(scene: Scene, changes: readonly Change[]): Scene {
    const [before, now] = [this.frames.at(-2), this.frames.at(-1)];
    const going = new Set(changes.map(({ change }) => (change?.case === "removeSoftBody" ? change.value : "")));
    const softBodies = scene.softBodies.map((body) => {
      const i = now?.layout.softBodies.findIndex(({ name }) => name === body.name) ?? -1;
      if (!going.has(body.name) || i < 0) return body;
      const { position: _, orientation: __, velocity: ___, angularVelocity: ____, ...rest } = body;
      const points = now!.positions[i]!;
      const passedS = before?.layout === now!.layout ? now!.timeS - before.timeS : 0;
      const velocity = passedS > 0 ? meanMove(before!.positions[i]!, points).divideScalar(passedS) : new Vector3();
      return create(SoftBodySchema, { ...rest, startPositions: [...points], velocity: create(Vec3Schema, velocity) });
    });
    return { ...scene, softBodies };
  }
}

function meanMove(from: Float64Array, to: Float64Array): Vector3 {
  const sum = new Vector3();
  for (let i = 0; i < to.length; i += 3) {
    sum.add(new Vector3(to[i]! - from[i]!, to[i + 1]! - from[i + 1]!, to[i + 2]! - from[i + 2]!));
  }
  return sum.divideScalar(Math.max(1, to.length / 3));
}
