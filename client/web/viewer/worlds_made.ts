// Makes worlds, of the built-in scenes or of a file, and ends them.
import { Client, PneumaError } from "../src/index.js";
import { refuse, say } from "./effect.js";
import { element } from "./element.js";

/** Those of the server (server/scenes), and what is in them. */
const scenes: readonly (readonly [string, string])[] = [
  ["five-balls", "Five balls in a room that turns"],
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
  private readonly confirm = element<HTMLDialogElement>("destroy-confirm");

  /** @param open shows a world; null: any */
  constructor(
    private readonly current: () => { client: Client; world: string } | undefined,
    private readonly open: (world: string | null) => void,
  ) {
    const list = element("scenes");
    for (const [name, what] of scenes) {
      const button = document.createElement("button");
      const title = document.createElement("strong");
      title.textContent = name;
      button.append(title, what);
      button.addEventListener("click", () => void this.make({ case: "builtin", value: name }));
      list.append(button);
    }
    element("new-world-open").addEventListener("click", () => {
      this.refusal.textContent = "";
      this.dialog.showModal();
    });
    element("new-world-close").addEventListener("click", () => this.dialog.close());
    element("scene-file-open").addEventListener("click", () => this.picker.click());
    this.picker.addEventListener("change", () => {
      const file = this.picker.files?.[0];
      if (file) void file.text().then((value) => this.make({ case: "sceneJson", value }));
      this.picker.value = "";
    });
    element("destroy").addEventListener("click", () => {
      const world = this.current()?.world;
      if (!world) return;
      element("destroy-name").textContent = world;
      this.confirm.showModal();
    });
    element("destroy-no").addEventListener("click", () => this.confirm.close());
    element("destroy-yes").addEventListener("click", () => void this.destroy().catch(refuse));
  }

  private async make(source: { case: "builtin" | "sceneJson"; value: string }): Promise<void> {
    const client = this.current()?.client;
    if (!client) return;
    this.dialog.classList.add("busy");
    try {
      const { world } = await client.createWorld({
        name: element<HTMLInputElement>("world-name").value.trim(),
        source,
      });
      this.dialog.close();
      say(`${world} is made`);
      this.open(world);
    } catch (error) {
      this.refusal.textContent = (error as PneumaError).message;
    } finally {
      this.dialog.classList.remove("busy");
    }
  }

  private async destroy(): Promise<void> {
    this.confirm.close();
    const current = this.current();
    if (!current) return;
    await current.client.destroyWorld(current.world);
    say(`${current.world} is gone`);
    this.open(null);
  }
}
