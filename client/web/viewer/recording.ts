// A recording that is played (`pneuma play`): how long it is, and where in it a tick is.
import type { WorldList_Recording, WorldList_World } from "../src/index.js";

export class Recording {
  readonly durationS: number;
  readonly firstTick: number;
  /** Whether velocities can be had. */
  readonly hasVelocities: boolean;
  private readonly lastTick: number;

  constructor(
    readonly world: string,
    { durationS, firstTick, lastTick, velocities }: WorldList_Recording,
    private readonly rateHz: number,
  ) {
    this.durationS = durationS;
    this.firstTick = Number(firstTick);
    this.lastTick = Number(lastTick);
    this.hasVelocities = velocities;
  }

  /** Undefined: there is no such world, or it runs. */
  static among(list: readonly WorldList_World[], world: string): Recording | undefined {
    const listed = list.find(({ name }) => name === world);
    return listed?.recording && new Recording(world, listed.recording, listed.rateHz);
  }

  /** Play time of a tick, from the first frame on. */
  atS(tick: number): number {
    return Math.min(this.durationS, Math.max(0, (tick - this.firstTick) / this.rateHz));
  }

  isEnd(tick: number): boolean {
    return tick >= this.lastTick;
  }
}
