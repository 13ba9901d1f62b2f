// A slider over something of the scene. It shows what holds at the server: while a hand is on it, what it asks for.
import { type PneumaError, type Scene, Stepping_OnUnstable } from "../src/index.js";
import { element } from "./element.js";
import type { Change } from "./inverse_edit.js";
import { Latest } from "./latest.js";
import type { WorldEdits } from "./world_edits.js";

// Inputs of a keyboard that come quicker are one deed, as those of a hand that holds the slider are.
const gesturePauseMs = 800;

// In a refusal that the server would not make, were it free to choose the substeps.
const moreSubsteps = "on_unstable SUBSTEP";
const takeSubsteps: Change = {
  change: { case: "setStepping", value: { onUnstable: Stepping_OnUnstable.SUBSTEP } },
};

export interface Quantity {
  /** What a change of it is called: "Change the gas". */
  readonly says: string;
  /** As the scene has it, in the slider's units; undefined where it has nothing of the kind. */
  valueOf(scene: Scene): number | undefined;
  changesOf(scene: Scene, value: number): Change[];
  text(value: number, scene: Scene): string;
}

interface Ask {
  readonly value: number;
  /** Whether the world is to take as many substeps as that asks for. */
  readonly takesSubsteps: boolean;
}

export class Slider {
  private readonly input: HTMLInputElement;
  private readonly output: HTMLOutputElement;
  private readonly note = document.createElement("output");
  private readonly offer = document.createElement("button");
  private readonly asks: Latest<Ask>;
  private isHeld = false;
  private gesture = {};
  private lastInputMs = 0;

  /** @param tell is told from which tick on a change is in effect */
  constructor(
    id: string,
    private readonly quantity: Quantity,
    private readonly edits: WorldEdits,
    private readonly tell: (tick: bigint) => void,
  ) {
    this.input = element<HTMLInputElement>(id);
    this.output = this.input.parentElement!.querySelector("output")!;
    this.note.className = "note";
    this.note.id = `${id}-note`;
    this.offer.textContent = "Take as many substeps as it takes";
    this.offer.className = "offer";
    this.input.after(this.note, this.offer);
    this.input.setAttribute("aria-describedby", this.note.id);
    this.refuse("");
    this.asks = new Latest<Ask>(
      (ask) => this.send(ask),
      (error) => this.refuse(error.message),
      () => void this.settle(),
    );
    this.listen();
  }

  /** Shows what holds, unless it is being moved. */
  follow(): void {
    const { scene } = this.edits;
    if (this.isHeld || this.asks.isSending) return;
    const value = scene && this.quantity.valueOf(scene);
    this.input.disabled = value === undefined;
    if (value !== undefined) this.input.value = String(value);
    this.output.value = value === undefined ? "none" : this.quantity.text(value, scene!);
  }

  /** For another world, or another body: what was refused there is of no interest. */
  forget(): void {
    this.refuse("");
  }

  private listen(): void {
    this.input.addEventListener("pointerdown", () => {
      this.isHeld = true;
      this.gesture = {};
    });
    for (const end of ["pointerup", "pointercancel", "change"]) {
      this.input.addEventListener(end, () => {
        this.isHeld = false;
        if (!this.asks.isSending) void this.settle();
      });
    }
    this.input.addEventListener("input", () => this.take());
  }

  private take(): void {
    const nowMs = performance.now();
    if (!this.isHeld && nowMs - this.lastInputMs > gesturePauseMs) this.gesture = {};
    this.lastInputMs = nowMs;
    const { scene } = this.edits;
    if (scene) this.output.value = this.quantity.text(this.input.valueAsNumber, scene);
    const value = this.input.valueAsNumber;
    this.offer.onclick = () => this.asks.put({ value, takesSubsteps: true });
    this.asks.put({ value, takesSubsteps: false });
  }

  private async send({ value, takesSubsteps }: Ask): Promise<void> {
    const changes = this.quantity.changesOf(this.edits.scene ?? (await this.edits.fresh()), value);
    if (changes.length === 0) return;
    const { tick } = takesSubsteps
      ? await this.edits.make(this.quantity.says, [takeSubsteps, ...changes])
      : await this.edits.make(this.quantity.says, changes, this.gesture);
    this.refuse("");
    this.tell(tick);
  }

  private async settle(): Promise<void> {
    try {
      await this.edits.fresh();
      this.follow();
    } catch (error) {
      this.refuse((error as PneumaError).message);
    }
  }

  private refuse(why: string): void {
    this.note.value = why;
    this.offer.hidden = !why.includes(moreSubsteps);
    this.input.classList.toggle("refused", why !== "");
  }
}
