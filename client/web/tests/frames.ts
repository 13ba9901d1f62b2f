import type { Frame, StreamListener } from "../src/index.js";

const patienceMs = 60_000;

interface Waiting {
  isWanted(frame: Frame): boolean;
  resolve(frame: Frame): void;
}

/** Hands a stream's frames to whoever waits for one. */
export class Frames implements StreamListener {
  private waiting: Waiting[] = [];

  frame(frame: Frame): void {
    const wanted = this.waiting.filter(({ isWanted }) => isWanted(frame));
    this.waiting = this.waiting.filter(({ isWanted }) => !isWanted(frame));
    for (const { resolve } of wanted) resolve(frame);
  }

  /** The first frame to come of which `isWanted` is true; rejects where none comes. */
  next(isWanted: (frame: Frame) => boolean = () => true): Promise<Frame> {
    return new Promise((resolve, reject) => {
      const late = () => reject(new Error(`no such frame in ${patienceMs / 1000} s`));
      const timer = setTimeout(late, patienceMs);
      const found = (frame: Frame) => {
        clearTimeout(timer);
        resolve(frame);
      };
      this.waiting.push({ isWanted, resolve: found });
    });
  }
}
