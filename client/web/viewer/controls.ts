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
import { SceneSheet } from "./scene_sheet.js";
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
  private readonly share: Share;
  private readonly sceneSheet: SceneSheet;
  private readonly undoButton = element<HTMLButtonElement>("undo");
  private readonly redoButton = element<HTMLButtonElement>("redo");
  private readonly addKind = element<HTMLSelectElement>("add-kind");
  private readonly addSize = element<HTMLInputElement>("add-size");
  private frames: Frame[] = []; // the last two
  private world = "";

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
    const around = () => ({ frame: this.frames.at(-1), centre: picture.orbit.target.clone() });
    new Upload(this.edits, around, (name) => picture.bringIntoView(name));
    this.share = new Share(this.edits, () => present() ?? { url: "", token: "", world: "" }, picture);
    new WorldsMade(present, open);
    this.sceneSheet = new SceneSheet(this.edits, () => present()?.client, open);
    this.listen();
  }

  /** Turns to a world, or looks again at the one that is shown. */
  async begin(client: Client, world: string): Promise<void> {
    if (world !== this.world) this.end();
    this.world = world;
    await this.edits.begin(client, world);
  }

  /** No world is shown: nothing can be done to the one that was. */
  end(): void {
    this.world = "";
    this.frames = [];
    this.edits.end();
    this.sliders.forget();
    this.selection.forget();
  }

  take(frame: Frame): void {
    const last = this.frames.at(-1);
    // A reset that was left out of the stream, or another life of the server.
    if (last && frame.timeS < last.timeS) {
      this.restarted();
      void this.edits.stale();
    }
    this.frames = [...this.frames.slice(-1), frame];
  }

  /** Somebody changed the world, maybe this page. */
  applied({ command }: Applied): void {
    const kind = command?.request.case;
    if (kind === "reset") this.restarted();
    if (kind === "edit" || kind === "reset") void this.edits.stale();
  }

  private restarted(): void {
    this.edits.forget();
    this.sliders.forget();
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

  get scene(): Scene | undefined {
    return this.edits.scene;
  }

  openScene(isOpen: boolean): void {
    this.sceneSheet.open(isOpen);
  }

  get isRecording(): boolean {
    return this.share.isRecording;
  }

  massKg(body: string): number {
    return this.edits.scene?.softBodies.find(({ name }) => name === body)?.massKg ?? 1;
  }

  /** The pointer touched the picture without drawing. */
  clicked(x: number, y: number, tool: Tool): void {
    if (tool === "throw") void this.throw(this.picture.aim(x, y)).catch(refuse);
    else this.selection.show(this.picture.nameAt(x, y) ?? "");
  }

  private async throw(target: Vector3): Promise<void> {
    const frame = this.frames.at(-1);
    if (!frame) return;
    const eye = this.picture.eye.clone();
    const made = await this.edits.make((scene) => throwAt(scene, frame, eye, target));
    if (made) say(`${made.name} flies from tick ${made.reply.tick} on`);
  }

  private listen(): void {
    const onClick = (id: string, action: () => Promise<void>) =>
      element(id).addEventListener("click", () => void action().catch(refuse));
    onClick("undo", async () => {
      const undone = await this.edits.undo();
      if (!undone) return;
      const { says, tick, isWhole } = undone;
      if (tick === undefined) say(`${says}: it is not as it was left here any more, and stays as it is`);
      else
        say(`Taken back: ${says}, from tick ${tick} on${isWhole ? "" : ", but for what is not as it was left here"}`);
    });
    onClick("redo", async () => {
      const redone = await this.edits.redo();
      if (redone) say(`Done again: ${redone.says}, from tick ${redone.tick} on`);
    });
    onClick("add", () => this.add());
    onClick("throw", () => this.throw(this.picture.aim()));
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
    const thing = {
      kind: this.addKind.value,
      radiusM: this.radiusM,
      gas: power("add-gas"),
      stiffness: power("add-stiffness"),
    };
    const centre = this.picture.orbit.target.clone();
    const made = await this.edits.make((scene) => addition(scene, frame, thing, centre));
    if (!made) return;
    const { name, reply } = made;
    say(`${name} is there from tick ${reply.tick} on`);
    this.picture.bringIntoView(name);
    await this.edits.fresh();
    this.selection.select(name);
  }

  /** The scene is another one, or what can be undone. */
  private follow(): void {
    this.sliders.follow();
    this.selection.follow();
    this.sceneSheet.follow(this.world);
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
