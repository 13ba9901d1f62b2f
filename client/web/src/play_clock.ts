// The play time of a recording's frames: proto/WIRE.md, "Recordings".
import type { Frame } from "../proto/pneuma/v1/frame_pb.js";

// The rarest stream has a frame a day; more is no time of ours.
const frameIntervalMaxS = 86_400;

export class PlayClock {
  private durationS_ = 0;
  private last: { readonly tick: bigint; readonly timeS: number } | undefined;

  /**
   * @param rateHz of the world
   * @param tickS of the world's time, where a frame does not tell its own
   */
  constructor(
    private readonly rateHz: number,
    private readonly tickS: number,
  ) {}

  /** From the first frame on, to the last one that came. */
  get durationS(): number {
    return this.durationS_;
  }

  /** The world's time, of the last frame that came. */
  get timeS(): number {
    return this.last?.timeS ?? 0;
  }

  take(frame: Frame): void {
    const { tick } = frame;
    const timeS = this.timeOf(frame);
    if (this.last) {
      let stepS = timeS - this.last.timeS;
      // Back to the start, or no time at all: the ticks go on counting.
      if (!(stepS >= 0)) stepS = Math.max(0, Number(tick - this.last.tick)) / this.rateHz;
      this.durationS_ += Math.min(stepS, frameIntervalMaxS);
    }
    this.last = { tick, timeS };
  }

  /** Where the frame does not tell it, it follows from any frame before as from its base. */
  private timeOf({ tick, timeS }: Frame): number {
    if (timeS !== undefined || !this.last) return timeS ?? 0;
    return this.last.timeS + Number(tick - this.last.tick) * this.tickS;
  }
}
