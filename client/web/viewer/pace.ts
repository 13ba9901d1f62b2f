// Says that the server cannot keep up with the world that is shown, as long as that is so.
import type { Client, Stats } from "../src/index.js";
import { hold, unsay } from "./effect.js";
import { Pace } from "./pace_window.js";

const intervalMs = 1000; // each ratio is of the last second
const topic = "pace";

export class PaceTold {
  private pace: Pace | undefined;
  private world = "";
  private isTold = false;
  private isAsking = false;

  /** @param live whose world it is at the moment, if any */
  constructor(private readonly live: () => { client: Client; world: string } | undefined) {
    setInterval(() => void this.ask(), intervalMs);
  }

  /** The world was late: it is looked at until it is not. */
  late(world: string): void {
    if (this.pace && this.world === world) return;
    this.world = world;
    this.pace = new Pace();
  }

  end(): void {
    this.pace = undefined;
    this.tell(false);
  }

  private async ask(): Promise<void> {
    const live = this.live();
    if (!this.pace || this.isAsking) return;
    if (live?.world !== this.world) return this.end();
    this.isAsking = true;
    const stats = await live.client.stats(this.world).catch((): Stats | undefined => undefined);
    this.isAsking = false;
    if (!stats || !this.pace || stats.world !== this.world) return;
    this.pace.add(stats.timeRatio);
    this.tell(this.pace.isSlow);
    if (this.pace.isOver) this.end();
  }

  private tell(isSlow: boolean): void {
    if (isSlow === this.isTold) return;
    this.isTold = isSlow;
    if (isSlow) hold("The server cannot keep up with this world", topic);
    else unsay(topic);
  }
}
