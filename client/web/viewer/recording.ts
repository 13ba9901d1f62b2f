// A recording that is played (`pneuma play`): whether a world is one, how long it is, and where in it a tick is.
import type { Client, PneumaError } from "../src/index.js";

// Past the end of every recording.
const neverS = 1e300;

export class Recording {
  constructor(
    readonly world: string,
    readonly durationS: number,
    readonly firstTick: number,
    private readonly rateHz: number,
    /** Whether velocities can be had. */
    readonly hasVelocities: boolean,
  ) {}

  /** Play time of a tick, from the first frame on. */
  atS(tick: number): number {
    return Math.min(this.durationS, Math.max(0, (tick - this.firstTick) / this.rateHz));
  }

  isEnd(tick: number): boolean {
    return this.atS(tick + 0.5) >= this.durationS;
  }
}

/**
 * Undefined: it is a world that runs, or this token may not seek. The server refuses to go past a recording's end, and
 * tells where that is; which tick is its first is told by going there. So a recording that was at its end begins again.
 */
export async function findRecording(client: Client, world: string): Promise<Recording | undefined> {
  const durationS = await durationOf(client, world);
  if (durationS === undefined) return undefined;
  const { tick, rateHz } = await client.stats(world);
  const firstTick = Number((await client.seek(world, 0)).tick);
  const recording = new Recording(world, durationS, firstTick, rateHz, await hasVelocities(client, world));
  const wasAt = Number(tick);
  if (wasAt > firstTick && !recording.isEnd(wasAt)) await client.seek(world, recording.atS(wasAt + 0.5));
  return recording;
}

async function durationOf(client: Client, world: string): Promise<number | undefined> {
  try {
    await client.seek(world, neverS);
  } catch (error) {
    const { code, what } = error as PneumaError;
    const end = /ends at (\S+) s/.exec(what);
    if (code === "INVALID_ARGUMENT" && end) return Number(end[1]);
    if (code === "UNAVAILABLE") throw error;
  }
  return undefined;
}

async function hasVelocities(client: Client, world: string): Promise<boolean> {
  try {
    const stream = await client.subscribe(world, { velocities: true, maxErrorM: 0, rateHz: 1 }, { frame: () => {} });
    await client.unsubscribe(stream);
    return true;
  } catch (error) {
    if ((error as PneumaError).code === "UNAVAILABLE") throw error;
    return false;
  }
}
