// A few seconds of the picture as a film.
import { PneumaError } from "../src/index.js";

const seconds = 6;
const rateHz = 30;
const bitsPerS = 8_000_000;

// By what a browser can write, the best first.
const kinds = [
  ["video/webm;codecs=vp9", "webm"],
  ["video/webm", "webm"],
  ["video/mp4", "mp4"],
] as const;

export interface FilmFile {
  readonly parts: readonly Blob[];
  readonly ending: string;
  readonly type: string;
}

/** Films the canvas, from now on until it is told to end, and no longer than six seconds. */
export class Film {
  private readonly parts: Blob[] = [];
  private readonly recorder: MediaRecorder;
  private readonly beganMs = performance.now();
  readonly file: Promise<FilmFile>;

  /** Throws where the browser makes no films. */
  constructor(canvas: HTMLCanvasElement) {
    const kind = globalThis.MediaRecorder && kinds.find(([type]) => MediaRecorder.isTypeSupported(type));
    if (!kind) throw new PneumaError("UNSUPPORTED", "this browser makes no films");
    const [type, ending] = kind;
    const stream = canvas.captureStream(rateHz);
    this.recorder = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: bitsPerS });
    this.file = new Promise((resolve, reject) => {
      this.recorder.onstop = () => resolve({ parts: this.parts, ending, type });
      this.recorder.onerror = () => reject(new PneumaError("INTERNAL", "the film broke off"));
    });
    this.recorder.ondataavailable = ({ data }) => this.parts.push(data);
    this.recorder.start();
    const timer = setTimeout(() => this.stop(), 1000 * seconds);
    void this.file
      .finally(() => {
        clearTimeout(timer);
        for (const track of stream.getTracks()) track.stop();
      })
      .catch(() => {}); // whoever waits for the file is told
  }

  get leftS(): number {
    return Math.max(0, seconds - (performance.now() - this.beganMs) / 1000);
  }

  stop(): void {
    if (this.recorder.state !== "inactive") this.recorder.stop();
  }
}
