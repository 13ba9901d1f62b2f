// How fast the world's time goes, and that of the picture with it.
import type { Client, Done } from "../src/index.js";
import { refuse, say } from "./effect.js";
import { element } from "./element.js";

export class SlowMotion {
  private readonly choice = element<HTMLSelectElement>("time-scale");
  private scale_ = 1;

  /** @param current the world that is shown, and whether it stands still */
  constructor(
    private readonly current: () => { client: Client; world: string; isPaused: boolean } | undefined,
    private readonly changed: (scale: number) => void,
  ) {
    this.choice.addEventListener("change", () => void this.choose().catch(refuse));
  }

  /** What a paused world is to go on with; undefined: as it was. */
  get wished(): number | undefined {
    const scale = Number(this.choice.value);
    return scale === this.scale_ ? undefined : scale;
  }

  /** Lets these be chosen, too. */
  offer(scales: readonly number[]): void {
    for (const scale of scales) this.list(new Option(`${scale} ×`, String(scale)));
  }

  /** The fastest comes first. */
  private list(option: HTMLOptionElement): void {
    const slower = [...this.choice.options].find(({ value }) => Number(value) < Number(option.value));
    this.choice.add(option, slower ?? null);
  }

  /** What the server says. Of a world that stands still, what was chosen to go on with stays chosen. */
  follow(scale: number, isPaused: boolean): void {
    if (isPaused && scale === this.scale_) return;
    this.show(scale);
  }

  /** What was chosen was for a world that is not shown any more. */
  forget(): void {
    this.show(1);
  }

  private show(scale: number): void {
    this.scale_ = scale;
    // The speed that a recording began with may be past what the server takes: it is left, and not chosen.
    for (const option of [...this.choice.options]) if (option.dataset["isUnlisted"]) option.remove();
    if (![...this.choice.options].some(({ value }) => Number(value) === scale)) {
      const option = new Option(`${scale} ×`, String(scale));
      option.dataset["isUnlisted"] = "true";
      this.list(option);
    }
    this.choice.value = String(scale);
    this.changed(scale);
  }

  private async choose(): Promise<Done | undefined> {
    const current = this.current();
    if (!current) return undefined;
    if (current.isPaused) {
      say(`Time goes at ${this.choice.selectedOptions[0]!.text} when the world goes on`, "time");
      return undefined;
    }
    try {
      const done = await current.client.resume(current.world, this.wished);
      say(`Time goes at ${this.choice.selectedOptions[0]!.text} from tick ${done.tick} on`, "time");
      return done;
    } catch (error) {
      this.show(this.scale_);
      throw error;
    }
  }
}
