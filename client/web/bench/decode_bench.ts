// Time to decode a frame: of cost-curve (13,650 vertices in five balls, at 0.1 mm) as a server here sends it.
import { Client, type FrameDecoder, type Triangles } from "../src/index.js";
import { StreamReaders } from "../src/decoder.js";
import { Server } from "../tests/server.js";

interface Recorded {
  readonly meshes: readonly Triangles[];
  readonly payloads: { readonly payload: Uint8Array; readonly base: number | undefined }[];
}

/** Keeps what it is asked to decode. */
class Recorder implements FrameDecoder {
  readonly recorded: Recorded = { meshes: [], payloads: [] };

  begin(_stream: number, meshes: readonly Triangles[]): void {
    Object.assign(this.recorded, { meshes });
  }
  decode(_stream: number, payload: Uint8Array, base: number | undefined): Promise<Float64Array> {
    this.recorded.payloads.push({ payload, base });
    return Promise.resolve(new Float64Array(3 * this.recorded.meshes.reduce((sum, mesh) => sum + mesh.vertexCount, 0)));
  }
  isBehind(): boolean {
    return false;
  }
  end(): void {}
  close(): void {}
}

async function record(world: string, frames: number): Promise<Recorded> {
  const server = await Server.start(["--scene", world]);
  const decoder = new Recorder();
  const client = await Client.connect(server.url, { decoder });
  await new Promise<void>((resolve, reject) => {
    const frame = () => decoder.recorded.payloads.length >= frames && resolve();
    client.subscribe(world, { maxErrorM: 1e-4 }, { frame }).catch(reject);
  });
  client.close();
  await server.kill();
  return decoder.recorded;
}

const { meshes, payloads } = await record("cost-curve", 240);
const vertices = meshes.reduce((sum, mesh) => sum + mesh.vertexCount, 0);
// Of several rounds, the quickest of each frame: what else the machine does is left out.
const rounds = 10;
const quickest = payloads.map(() => Infinity);
for (let round = 0; round < rounds; ++round) {
  const readers = new StreamReaders();
  readers.begin(0, meshes, 1);
  payloads.forEach(({ payload, base }, i) => {
    const begin = performance.now();
    readers.decode(0, payload, base, 0);
    quickest[i] = Math.min(quickest[i]!, performance.now() - begin);
  });
}
const times = quickest.filter((_, i) => payloads[i]!.base !== undefined);
times.sort((a, b) => a - b);
const bytes = payloads.reduce((sum, { payload }) => sum + payload.length, 0) / payloads.length;
const of = (ms: number) => `${ms.toFixed(3)} ms (${((1e6 * ms) / vertices).toFixed(1)} ns a vertex)`;
console.log(`${vertices} vertices, ${payloads.length} frames of ${((8 * bytes) / vertices).toFixed(2)} bits a vertex`);
console.log(`median ${of(times[times.length >> 1]!)}, 99 % within ${of(times[Math.floor(times.length * 0.99)]!)}`);
console.log(`10,000 vertices: ${((times[times.length >> 1]! * 10_000) / vertices).toFixed(3)} ms`);
