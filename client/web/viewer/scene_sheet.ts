// The sheet with the scene as text: shows it, has it changed by one edit or made a world of, and tells what is wrong where.
import type { JsonValue } from "@bufbuild/protobuf";
import type { Client, PneumaError, Scene } from "../src/index.js";
import { refuse, say } from "./effect.js";
import { element } from "./element.js";
import { placeOf } from "./json_text.js";
import { NumberedText } from "./numbered_text.js";
import { whyNotEdit } from "./permitted.js";
import { difference, isSame } from "./scene_difference.js";
import { type Refusal, refusalOfEdit, refusalOfWorld } from "./scene_refusal.js";
import { type Problem, type Reading, readScene, sceneText } from "./scene_text.js";
import { sentence } from "./words.js";
import type { WorldEdits } from "./world_edits.js";

// What is written is looked through when the hands rest for so long.
const restMs = 500;
const namedMax = 3;
const says = "Change the scene";

/** The text of a world's scene, as it was before anybody wrote in it. */
interface Draft {
  readonly world: string;
  readonly scene: Scene;
  readonly written: string;
  readonly kept: readonly JsonValue[];
}

interface Written {
  readonly draft: Draft;
  readonly text: string;
}

type Read = Extract<Reading, { scene: Scene }>;

function freeName(wanted: string, taken: readonly string[]): string {
  if (!taken.includes(wanted)) return wanted;
  const base = wanted.replace(/-\d+$/, "");
  let number = 2;
  while (taken.includes(`${base}-${number}`)) ++number;
  return `${base}-${number}`;
}

export class SceneSheet {
  private readonly editor = new NumberedText(element<HTMLTextAreaElement>("scene-text"), () => this.wrote());
  private readonly applyButton = element<HTMLButtonElement>("scene-apply");
  private readonly newButton = element<HTMLButtonElement>("scene-new");
  private readonly loadButton = element<HTMLButtonElement>("scene-load");
  private readonly note = element("scene-note");
  private readonly list = element("scene-problems");
  private draft: Draft | undefined;
  /** What was written for other worlds, by their names. */
  private readonly aside = new Map<string, Written>();
  /** What Load again took out of the sheet, until something else is written. */
  private replaced: Written | undefined;
  private world = "";
  private isOpen = false;
  private isBusy = false;
  /** Whether the world's scene is another one than the text was written of. */
  private isOld = false;
  private rest: ReturnType<typeof setTimeout> | undefined;

  /** @param open shows another world */
  constructor(
    private readonly edits: WorldEdits,
    private readonly client: () => Client | undefined,
    private readonly turnTo: (world: string) => void,
  ) {
    this.applyButton.addEventListener("click", () => void this.work(() => this.apply()));
    this.newButton.addEventListener("click", () => void this.work(() => this.makeWorld()));
    this.loadButton.addEventListener("click", () => void this.work(() => this.loadAgain()));
    this.editor.area.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" || !(event.ctrlKey || event.metaKey)) return;
      event.preventDefault();
      this.applyButton.click();
    });
    addEventListener("beforeunload", (event) => {
      if (this.isEdited || this.aside.size > 0) event.preventDefault(); // it would be lost
    });
  }

  open(isOpen: boolean): void {
    this.isOpen = isOpen;
    if (isOpen && this.world !== "" && !this.isEdited) void this.work(() => this.load());
    this.tell();
  }

  /** The scene is another one, or the world; "": none is shown. */
  follow(world: string): void {
    const isOther = world !== this.world;
    this.world = world;
    if (isOther && world !== "" && this.draft?.world !== world) this.turn();
    const { scene } = this.edits;
    const { draft, isEdited } = this;
    if (scene && world !== "" && (this.isOpen || isEdited) && !this.isBusy) {
      this.isOld = draft !== undefined && !isSame(scene, draft.scene);
      if (!isEdited && (this.isOld || !draft)) this.show(world, scene);
    }
    this.tell();
  }

  private get isEdited(): boolean {
    return this.draft !== undefined && this.editor.text !== this.draft.written;
  }

  /** Puts what was written for the last world aside, and takes what was written for this one. */
  private turn(): void {
    const { draft } = this;
    if (draft && this.isEdited) this.aside.set(draft.world, { draft, text: this.editor.text });
    const again = this.aside.get(this.world);
    this.aside.delete(this.world);
    this.replaced = undefined;
    this.take(again);
  }

  private take(written: Written | undefined): void {
    this.draft = written?.draft;
    this.isOld = false;
    this.editor.text = written?.text ?? "";
    this.look();
  }

  private show(world: string, scene: Scene): void {
    const { text, kept } = sceneText(scene);
    this.draft = { world, scene, kept, written: text };
    this.isOld = false;
    this.editor.text = text;
    this.tellProblems([]);
  }

  /** What was written comes back by a second press. */
  private async loadAgain(): Promise<void> {
    const { draft, isEdited, replaced } = this;
    if (replaced && !isEdited) {
      this.replaced = undefined;
      return this.take(replaced);
    }
    const written = draft && isEdited ? { draft, text: this.editor.text } : undefined;
    await this.load();
    if (this.draft !== draft) this.replaced = written;
  }

  private async load(): Promise<void> {
    const { world } = this;
    const scene = await this.edits.read();
    if (world === this.world) this.show(world, scene);
  }

  private async work(action: () => Promise<void>): Promise<void> {
    if (this.isBusy) return;
    this.isBusy = true;
    this.tell();
    try {
      await action();
    } catch (error) {
      refuse(error as PneumaError);
    } finally {
      this.isBusy = false;
      this.follow(this.world);
    }
  }

  private wrote(): void {
    this.replaced = undefined;
    clearTimeout(this.rest);
    this.rest = setTimeout(() => this.look(), restMs);
    this.tell();
  }

  /** Tells what is wrong in the text, and leaves the focus where it is. */
  private look(): void {
    if (!this.draft) return this.tellProblems([]);
    const read = readScene(this.editor.text, this.draft.kept);
    this.tellProblems("problems" in read ? read.problems : []);
  }

  /** The scene that is written; undefined: what is wrong is told, and has the focus. */
  private read(): Read | undefined {
    clearTimeout(this.rest);
    const read = readScene(this.editor.text, this.draft!.kept);
    if (!("problems" in read)) return read;
    this.showProblems(read.problems);
    return undefined;
  }

  private async apply(): Promise<void> {
    const { draft } = this;
    const read = draft && this.read();
    if (!read) return;
    const { changes, anew, problems } = difference(draft.scene, read.scene);
    if (problems.length > 0) {
      const hint = document.body.classList.contains("may-admin") ? "; or make a new world of it" : "";
      return this.showProblems(problems.map(({ at, what }) => ({ at: read.at(at), what: what + hint })));
    }
    if (changes.length === 0) return say("The text says nothing else than the scene", "scene");
    try {
      const made = await this.edits.make(() => ({ says, changes: changes.map(({ change }) => change) }));
      if (made) say(`The scene is as written from tick ${made.reply.tick} on${begunAnew(anew)}`, "scene");
    } catch (error) {
      return this.refused(error as PneumaError, draft, read, refusalOfEdit(changes, error as PneumaError));
    }
    if (this.draft === draft) await this.load();
    else this.aside.delete(draft.world); // it is done, though another world is shown by now
  }

  private async makeWorld(): Promise<void> {
    const client = this.client();
    const { draft } = this;
    const read = draft && this.read();
    if (!client || !read) return;
    const taken = (await client.worlds()).map(({ name }) => name);
    const name = freeName(read.scene.name || "world", taken);
    try {
      const { world } = await client.createWorld({ name, source: { case: "scene", value: read.scene } });
      say(`${world} is made`);
      if (this.draft === draft) this.show(draft.world, draft.scene); // what was written is the new world's now
      this.turnTo(world);
    } catch (error) {
      this.refused(error as PneumaError, draft, read, refusalOfWorld(error as PneumaError));
    }
  }

  /** Tells it at its line, if it has one and the text is still shown. */
  private refused(error: PneumaError, draft: Draft, read: Read, { at, what }: Refusal): void {
    if (at.length === 0 || this.draft !== draft) throw error;
    this.showProblems([{ at: read.at(at), what }]);
  }

  private showProblems(problems: readonly Problem[]): void {
    this.tellProblems(problems);
    if (problems[0]) this.editor.select(problems[0].at);
  }

  private tellProblems(problems: readonly Problem[]): void {
    const { editor } = this;
    const placed = problems.map(({ at, what }) => ({ at, what, ...placeOf(editor.text, at.start) }));
    editor.mark(placed.map(({ line }) => line));
    editor.area.setAttribute("aria-invalid", String(problems.length > 0));
    this.list.replaceChildren(
      ...placed.map(({ at, what, line }) => {
        const button = document.createElement("button");
        button.textContent = `Line ${line}: ${sentence(what)}`;
        button.addEventListener("click", () => editor.select(at));
        const item = document.createElement("li");
        item.append(button);
        return item;
      }),
    );
  }

  private tell(): void {
    const why = whyNotEdit();
    const { draft, isEdited, isBusy } = this;
    this.editor.area.readOnly = why !== "" || isBusy;
    this.applyButton.disabled = !isEdited || isBusy;
    this.newButton.disabled = !draft || isBusy;
    this.loadButton.disabled = this.world === "" || isBusy;
    this.loadButton.textContent = this.replaced && !isEdited ? "My text again" : "Load again";
    this.note.textContent = isEdited && this.isOld ? changedElsewhere : why;
  }
}

const changedElsewhere =
  "The scene has changed since this text was loaded. Apply changes only what you have changed; Load again shows the scene as it is now, without your changes.";

function begunAnew(names: readonly string[]): string {
  if (names.length === 0) return "";
  const more = names.length - namedMax;
  const told = names.slice(0, namedMax).join(", ") + (more > 0 ? ` and ${more} more` : "");
  return `. ${told} ${names.length === 1 ? "begins" : "begin"} anew`;
}
