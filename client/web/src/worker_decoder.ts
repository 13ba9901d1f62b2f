// Frames decoded in a web worker, off the page's own thread. decode_worker.ts is what runs there.
import type { FrameDecoder } from "./decoder.js";
import { type ErrorCode, PneumaError } from "./errors.js";

/** To the worker, answered in order; only `decode` has an answer. */
export type DecodeRequest =
  | { kind: "begin"; layout: Parameters<FrameDecoder["begin"]> }
  | {
      kind: "decode";
      stream: number;
      payload: Uint8Array;
      base: number | undefined;
      layer: number;
      check: number | undefined;
    }
  | { kind: "end"; stream: number };

export type DecodeReply =
  | { positions: Float64Array; tookMs: number }
  | { code: ErrorCode; what: string; where: string };

// Half a second at 60 Hz. What waits longer is late already, and is memory that nothing else bounds.
const waitingMax = 30;

interface Waiting {
  readonly stream: number;
  resolve(positions: Float64Array): void;
  reject(error: PneumaError): void;
}

export class WorkerDecoder implements FrameDecoder {
  private readonly waiting: Waiting[] = [];
  private broken: PneumaError | undefined;
  private decodeMs_ = 0;

  /** @param worker runs `@pneuma/client/decode-worker` as a module */
  constructor(private readonly worker: Worker) {
    worker.onmessage = ({ data }: MessageEvent<DecodeReply>) => {
      const waiting = this.waiting.shift();
      if ("positions" in data) {
        this.decodeMs_ += data.tookMs;
        waiting?.resolve(data.positions);
      } else waiting?.reject(new PneumaError(data.code, data.what, data.where));
    };
    worker.onerror = (event) => {
      this.broken = new PneumaError("INTERNAL", event.message || "the decoding worker cannot be loaded");
      for (const waiting of this.waiting.splice(0)) waiting.reject(this.broken);
    };
  }

  /** Time that the worker took to decode, in all. */
  get decodeMs(): number {
    return this.decodeMs_;
  }

  begin(...layout: Parameters<FrameDecoder["begin"]>): void {
    this.post({ kind: "begin", layout });
  }

  decode(...[stream, payload, base, layer, check]: Parameters<FrameDecoder["decode"]>): Promise<Float64Array> {
    if (this.broken) return Promise.reject(this.broken);
    return new Promise((resolve, reject) => {
      this.waiting.push({ stream, resolve, reject });
      const own = payload.slice(); // a view of a message takes all of it along
      this.post({ kind: "decode", stream, payload: own, base, layer, check }, [own.buffer]);
    });
  }

  isBehind(stream: number): boolean {
    return this.waiting.filter((waiting) => waiting.stream === stream).length >= waitingMax;
  }

  end(stream: number): void {
    this.post({ kind: "end", stream });
  }

  close(): void {
    this.worker.terminate();
  }

  private post(request: DecodeRequest, transfer: Transferable[] = []): void {
    this.worker.postMessage(request, transfer);
  }
}
