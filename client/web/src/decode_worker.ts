// Runs in a web worker: decodes what a WorkerDecoder sends.
import { StreamReaders } from "./decoder.js";
import { PneumaError } from "./errors.js";
import type { DecodeReply, DecodeRequest } from "./worker_decoder.js";

const readers = new StreamReaders();

function decode({ stream, payload, base, layer, check }: DecodeRequest & { kind: "decode" }): DecodeReply {
  try {
    const begin = performance.now();
    const positions = readers.decode(stream, payload, base, layer, check);
    return { positions, tookMs: performance.now() - begin };
  } catch (error) {
    if (!(error instanceof PneumaError)) return { code: "INTERNAL", what: String(error), where: "" };
    return { code: error.code, what: error.what, where: error.where };
  }
}

self.onmessage = ({ data }: MessageEvent<DecodeRequest>) => {
  if (data.kind === "begin") {
    readers.begin(...data.layout);
  } else if (data.kind === "end") {
    readers.end(data.stream);
  } else {
    const reply = decode(data);
    self.postMessage(reply, { transfer: "positions" in reply ? [reply.positions.buffer] : [] });
  }
};
