// Where frames are decoded: here, or in a worker (worker_decoder.ts).
import { FrameReader } from "./codec/frame_reader.js";
import { makeMeshOrder, type Triangles } from "./codec/mesh_order.js";
import { PneumaError } from "./errors.js";

/** Decodes the frames of any number of streams, each in the order in which it is asked to. */
export interface FrameDecoder {
  /** Begins the frames of a layout: its meshes in order, and the metres that a step of the grid is. */
  begin(stream: number, meshes: readonly Triangles[], gridStepM: number): void;
  /**
   * The vertices of all meshes, in metres: x y z of each vertex, mesh after mesh. Rejects with PneumaError MALFORMED
   * what is no frame.
   */
  decode(stream: number, payload: Uint8Array, isKey: boolean): Promise<Float64Array>;
  end(stream: number): void;
  /** Frees what it holds; nothing is asked of it after. */
  close(): void;
}

interface Decoding {
  readonly meshes: readonly Triangles[];
  readonly reader: FrameReader;
  readonly gridStepM: number;
}

/** The decoder's work, done at once. */
export class StreamReaders {
  private readonly streams = new Map<number, Decoding>();

  begin(stream: number, meshes: readonly Triangles[], gridStepM: number): void {
    this.streams.set(stream, { meshes, reader: new FrameReader(meshes.map(makeMeshOrder)), gridStepM });
  }

  decode(stream: number, payload: Uint8Array, isKey: boolean): Float64Array {
    const decoding = this.streams.get(stream);
    if (!decoding) throw new PneumaError("MALFORMED", "a frame before its layout");
    const { meshes, reader, gridStepM } = decoding;
    reader.read(payload, isKey);
    const positions = new Float64Array(3 * meshes.reduce((sum, mesh) => sum + mesh.vertexCount, 0));
    let begin = 0;
    meshes.forEach(({ vertexCount }, body) => {
      reader.positions(body, gridStepM, positions.subarray(begin, begin + 3 * vertexCount));
      begin += 3 * vertexCount;
    });
    return positions;
  }

  end(stream: number): void {
    this.streams.delete(stream);
  }
}

/** Decodes on the thread that it is used on. */
export class InlineDecoder implements FrameDecoder {
  private readonly readers = new StreamReaders();

  begin(stream: number, meshes: readonly Triangles[], gridStepM: number): void {
    this.readers.begin(stream, meshes, gridStepM);
  }

  decode(stream: number, payload: Uint8Array, isKey: boolean): Promise<Float64Array> {
    return new Promise((resolve) => resolve(this.readers.decode(stream, payload, isKey)));
  }

  end(stream: number): void {
    this.readers.end(stream);
  }

  close(): void {}
}
