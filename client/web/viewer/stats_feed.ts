// What the server tells of a world and how long it takes to answer, asked for as often as those need who look.
import type { Client, Stats } from "../src/index.js";

const intervalMs = 250;

export interface Measured {
  readonly stats: Stats;
  /** From a ping to its pong; undefined: nobody wants to know. */
  readonly roundTripMs: number | undefined;
}

export interface Wish {
  readonly intervalMs: number;
  readonly hasRoundTrip: boolean;
}

/** A few times a second. */
export const often: Wish = { intervalMs, hasRoundTrip: false };

async function roundTripOf(client: Client): Promise<number> {
  const begin = performance.now();
  await client.call({ case: "ping", value: {} }, "pong");
  return performance.now() - begin;
}

export class StatsFeed {
  private readonly watchers = new Map<(measured: Measured) => void, { wish: Wish; askedAtMs: number }>();
  private isAsking = false;

  /** @param from whose world it is at the moment, if any */
  constructor(private readonly from: () => { client: Client; world: string } | undefined) {
    setInterval(() => void this.ask(), intervalMs);
  }

  watch(watcher: (measured: Measured) => void, isOn: boolean, wish: Wish): void {
    if (!isOn) this.watchers.delete(watcher);
    else if (!this.watchers.has(watcher)) this.watchers.set(watcher, { wish, askedAtMs: -Infinity });
  }

  private async ask(): Promise<void> {
    const source = this.from();
    if (!source || this.isAsking || document.hidden) return;
    const nowMs = performance.now();
    // A timer that is a little early is as good as the next one.
    const isDue = ({ wish, askedAtMs }: { wish: Wish; askedAtMs: number }) =>
      nowMs - askedAtMs > wish.intervalMs - intervalMs / 2;
    const due = [...this.watchers].filter(([, watching]) => isDue(watching));
    if (due.length === 0) return;
    this.isAsking = true;
    for (const [, watching] of due) watching.askedAtMs = nowMs;
    try {
      const hasRoundTrip = due.some(([, { wish }]) => wish.hasRoundTrip);
      const roundTripMs = hasRoundTrip ? await roundTripOf(source.client) : undefined;
      const stats = await source.client.stats(source.world);
      const isShown = this.from()?.world === stats.world;
      for (const [watcher] of due) if (isShown && this.watchers.has(watcher)) watcher({ stats, roundTripMs });
    } catch {
      // The page says elsewhere that its world or the connection is gone.
    }
    this.isAsking = false;
  }
}
