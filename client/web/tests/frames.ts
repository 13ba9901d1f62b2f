import type { Frame, StreamListener } from "../src/index.js";

/** Hands a stream's frames to whoever waits for one. */
export class Frames implements StreamListener {
  private waiting: { isWanted: (frame: Frame) => boolean; resolve: (frame: Frame) => void }[] = [];

  frame(frame: Frame): void {
    const wanted = this.waiting.filter(({ isWanted }) => isWanted(frame));
    this.waiting = this.waiting.filter(({ isWanted }) => !isWanted(frame));
    for (const { resolve } of wanted) resolve(frame);
  }

  /** The first frame to come of which `isWanted` is true. */
  next(isWanted: (frame: Frame) => boolean = () => true): Promise<Frame> {
    return new Promise((resolve) => this.waiting.push({ isWanted, resolve }));
  }
}
