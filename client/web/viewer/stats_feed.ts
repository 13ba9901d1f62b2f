// What the server tells of a world and how long it takes to answer, asked for a few times a second while anyone looks.
import type { Client, Stats } from "../src/index.js";

const intervalMs = 250;

export interface Measured {
  readonly stats: Stats;
  /** From a ping to its pong. */
  readonly roundTripMs: number;
}

export class StatsFeed {
  private readonly watchers = new Set<(measured: Measured) => void>();
  private isAsking = false;

  /** @param from whose world it is at the moment, if any */
  constructor(private readonly from: () => { client: Client; world: string } | undefined) {
    setInterval(() => void this.ask(), intervalMs);
  }

  watch(watcher: (measured: Measured) => void, isOn: boolean): void {
    if (isOn) this.watchers.add(watcher);
    else this.watchers.delete(watcher);
  }

  private async ask(): Promise<void> {
    const source = this.from();
    if (!source || this.watchers.size === 0 || this.isAsking || document.hidden) return;
    this.isAsking = true;
    try {
      const begin = performance.now();
      await source.client.call({ case: "ping", value: {} }, "pong");
      const roundTripMs = performance.now() - begin;
      const stats = await source.client.stats(source.world);
      if (this.from()?.world === stats.world) for (const watcher of this.watchers) watcher({ stats, roundTripMs });
    } catch {
      // The page says elsewhere that its world or the connection is gone.
    }
    this.isAsking = false;
  }
}
