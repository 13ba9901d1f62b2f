// A slider over something of the scene. It shows what holds at the server: while a hand is on it, what it asks for.
import { type PneumaError, type Scene, Stepping_OnUnstable } from "../src/index.js";
import { element } from "./element.js";
import type { Change } from "./inverse_edit.js";
import { Latest } from "./latest.js";
import { inWords } from "./words.js";
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
  /** One and the same as long as it is about the same. */
  private subject = {};
  private lastInputMs = 0;
  /** From which on the last change of a gesture that goes on is in effect. */
  private tick: bigint | undefined;

  /** @param tell is told from which tick on a change is in effect, when the gesture that made it ends */
  constructor(
    id: string,
    private readonly quantity: Quantity,
    private readonly edits: WorldEdits,
    private readonly tell: (tick: bigint) => void,
  ) {
    this.input = element<HTMLInputElement>(id);
    this.output = this.input.parentElement!.querySelector("output")!;
    this.output.setAttribute("aria-live", "off"); // the slider itself tells what it is at
    this.note.className = "note";
    this.note.id = `${id}-note`;
    this.offer.textContent = "Take as many substeps as it takes";
    this.offer.className = "offer";
    this.input.after(this.note);
    this.input.parentElement!.after(this.offer);
    this.input.setAttribute("aria-describedby", this.note.id);
    this.refuse("");
    this.asks = new Latest<Ask>(
      (ask) => this.send(ask),
      (error) => this.refuse(inWords(error as PneumaError)),
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
    if (!scene) this.show("–");
    else this.show(value === undefined ? "none" : this.quantity.text(value, scene));
  }

  private show(text: string): void {
    this.output.value = text;
    this.input.setAttribute("aria-valuetext", text);
  }

  /** For another world, or another body: what was asked for and refused there is of no interest. */
  forget(): void {
    this.asks.drop();
    this.gesture = {};
    this.subject = {};
    this.tick = undefined;
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
    if (scene) this.show(this.quantity.text(this.input.valueAsNumber, scene));
    const value = this.input.valueAsNumber;
    this.offer.onclick = () => this.asks.put({ value, takesSubsteps: true });
    this.asks.put({ value, takesSubsteps: false });
  }

  private async send({ value, takesSubsteps }: Ask): Promise<void> {
    const { quantity, gesture, subject } = this;
    const made = await this.edits.make(
      (scene) => {
        if (subject !== this.subject) return undefined;
        const changes = quantity.changesOf(scene, value);
        const more = takesSubsteps && changes.length > 0 ? [takeSubsteps] : [];
        return { says: quantity.says, changes: [...more, ...changes] };
      },
      takesSubsteps ? undefined : gesture,
    );
    if (!made || subject !== this.subject) return;
    this.refuse("");
    this.tick = made.reply.tick;
  }

  private async settle(): Promise<void> {
    if (this.tick !== undefined && !this.isHeld) {
      this.tell(this.tick);
      this.tick = undefined;
    }
    if (!this.edits.scene) return this.follow();
    try {
      await this.edits.fresh();
      this.follow();
    } catch (error) {
      this.refuse(inWords(error as PneumaError));
    }
  }

  private refuse(why: string): void {
    this.note.value = why;
    this.offer.hidden = !why.includes(moreSubsteps);
    this.input.classList.toggle("refused", why !== "");
  }
}
