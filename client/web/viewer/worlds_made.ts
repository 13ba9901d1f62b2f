// Makes worlds, of the built-in scenes or of a file, and ends them.
import { Client, PneumaError } from "../src/index.js";
import { refuse, say } from "./effect.js";
import { element } from "./element.js";
import { checkSize } from "./files.js";
import { inWords } from "./words.js";

/** Those of the server (server/scenes), and what is in them. */
const scenes: readonly (readonly [string, string])[] = [
  ["hero", "Soft things that tumble in a drum"],
  ["five-balls", "Five balls in a room that turns"],
  ["rope-and-balloons", "Balloons on strings under a bar on ropes"],
  ["ball-pit", "Balls poured into a narrow box"],
  ["crumple", "A ball that loses its gas and folds"],
  ["balloon-under-load", "A tonne on a balloon of a kilogramme"],
  ["bouncing-ball", "A ball that bounces along a floor"],
  ["hanging-ball", "Balls hung by their tops, at several pressures"],
  ["wind-cloth", "A sheet of cloth in the wind"],
  ["hand", "A hand of gas, hit by a ball"],
  ["cost-curve", "Balls from coarse to fine"],
];

export class WorldsMade {
  private readonly dialog = element<HTMLDialogElement>("new-world");
  private readonly refusal = element("new-world-refusal");
  private readonly picker = element<HTMLInputElement>("scene-file");
  private readonly sources: readonly HTMLButtonElement[];
  private readonly confirm = element<HTMLDialogElement>("destroy-confirm");

  /** What is asked for from the dialog that is open. */
  private asked: object | undefined;
  private toDestroy: { client: Client; world: string } | undefined;

  /** @param open shows a world; null: any */
  constructor(
    private readonly current: () => { client: Client; world: string } | undefined,
    private readonly open: (world: string | null) => void,
  ) {
    const builtins = scenes.map(([name, what]) => {
      const button = document.createElement("button");
      const title = document.createElement("strong");
      title.textContent = name;
      button.append(title, what);
      button.addEventListener("click", () => void this.make({ case: "builtin", value: name }));
      return button;
    });
    element("scenes").append(...builtins);
    const fileButton = element<HTMLButtonElement>("scene-file-open");
    this.sources = [...builtins, fileButton];
    element("new-world-open").addEventListener("click", () => {
      this.refusal.textContent = "";
      this.dialog.showModal();
    });
    element("new-world-close").addEventListener("click", () => this.dialog.close());
    this.dialog.addEventListener("close", () => {
      if (!this.dialog.open) this.work(undefined);
    });
    fileButton.addEventListener("click", () => this.picker.click());
    this.picker.addEventListener("change", () => {
      const file = this.picker.files?.[0];
      if (file) void this.makeOf(file);
      this.picker.value = "";
    });
    element("destroy").addEventListener("click", () => {
      this.toDestroy = this.current();
      if (!this.toDestroy?.world) return;
      element("destroy-name").textContent = this.toDestroy.world;
      this.confirm.showModal();
    });
    element("destroy-no").addEventListener("click", () => this.confirm.close());
    element("destroy-yes").addEventListener("click", () => void this.destroy().catch(refuse));
  }

  private work(asked: object | undefined): void {
    this.asked = asked;
    this.dialog.classList.toggle("busy", asked !== undefined);
    for (const button of this.sources) button.disabled = asked !== undefined;
  }

  private async makeOf(file: File): Promise<void> {
    try {
      checkSize(file);
      await this.make({ case: "sceneJson", value: await file.text() });
    } catch (error) {
      this.refusal.textContent = error instanceof PneumaError ? inWords(error) : (error as Error).message;
    }
  }

  private async make(source: { case: "builtin" | "sceneJson"; value: string }): Promise<void> {
    const client = this.current()?.client;
    if (!client || this.asked) return;
    const asked = {};
    const isCurrent = () => this.asked === asked;
    this.work(asked);
    try {
      const { world } = await client.createWorld({
        name: element<HTMLInputElement>("world-name").value.trim(),
        source,
      });
      say(`${world} is made`);
      if (!isCurrent()) return; // cancelled: it is there, but is not turned to
      this.dialog.close();
      this.open(world);
    } catch (error) {
      if (isCurrent()) this.refusal.textContent = inWords(error as PneumaError);
      else refuse(error as PneumaError);
    } finally {
      if (isCurrent()) this.work(undefined);
    }
  }

  private async destroy(): Promise<void> {
    this.confirm.close();
    if (!this.toDestroy) return;
    const { client, world } = this.toDestroy;
    await client.destroyWorld(world);
    say(`${world} is gone`);
    if (this.current()?.world === world) this.open(null);
  }
}
