// The scene of one world as it holds now: read when it is asked for, and a while after it was changed.
import type { Client, Scene } from "../src/index.js";

// Many changes may come in a row, a slider's of another page: the scene is read when there was none for so long,
const quietMs = 250;
// or after so long at the latest,
const waitMsMax = 1000;
// and again no sooner than so many of its numbers were worth: about 1 MB/s.
const numbersAMs = 128;

/** How many numbers a message is of: that is about how large it is. */
export function numbersIn(value: unknown): number {
  if (typeof value === "number") return 1;
  if (typeof value !== "object" || value === null) return 0;
  if (Array.isArray(value) && typeof value[0] === "number") return value.length;
  let sum = 0;
  for (const part of Object.values(value)) sum += numbersIn(part);
  return sum;
}

export class SceneFeed {
  private scene_: Scene | undefined;
  private isStale_ = true;
  private changedAtMs = 0;
  private isWaiting = false;
  private reading: Promise<Scene> | undefined;
  private nextAtMs = 0;

  /** @param changed called when there is another scene */
  constructor(
    readonly client: Pick<Client, "scene" | "edit">,
    readonly world: string,
    private readonly changed: () => void,
  ) {}

  /** As it was read last. */
  get scene(): Scene | undefined {
    return this.scene_;
  }
  get isStale(): boolean {
    return this.isStale_;
  }

  /** The world was changed, as far as is known. */
  age(): void {
    this.isStale_ = true;
    this.changedAtMs = performance.now();
  }

  /** As it is now, to what is known. */
  async fresh(): Promise<Scene> {
    if (this.isStale_ || !this.scene_) return this.read();
    return this.reading ?? this.scene_;
  }

  /** As the server has it. One at a time: what was asked for while one is under way may be older than that. */
  async read(): Promise<Scene> {
    while (this.reading) await this.reading.catch(() => {});
    this.isStale_ = false;
    this.reading = this.client.scene(this.world);
    try {
      this.scene_ = await this.reading;
    } catch (error) {
      this.isStale_ = true;
      throw error;
    } finally {
      this.reading = undefined;
    }
    this.nextAtMs = performance.now() + numbersIn(this.scene_) / numbersAMs;
    this.changed();
    return this.scene_;
  }

  /** Whether it is for the caller to read the scene now: changes have come to rest. Of many callers one is told so. */
  async settled(): Promise<boolean> {
    if (this.isWaiting) return false;
    this.isWaiting = true;
    const latestMs = performance.now() + waitMsMax;
    for (;;) {
      const dueMs = Math.max(Math.min(this.changedAtMs + quietMs, latestMs), this.nextAtMs);
      const leftMs = dueMs - performance.now();
      if (leftMs <= 0) break;
      await new Promise((resolve) => setTimeout(resolve, leftMs));
    }
    this.isWaiting = false;
    return this.isStale_;
  }
}
