// Where frames are decoded: here, or in a worker (worker_decoder.ts).
import { FrameReader } from "./codec/frame_reader.js";
import { makeMeshOrder, type Triangles } from "./codec/mesh_order.js";
import {
  checkMechanics,
  type Mechanics,
  simulatedWork,
  simulatedWorkMax,
  SimulatedMotion,
} from "./codec/simulated_motion.js";
import { PneumaError } from "./errors.js";

/** Decodes the frames of any number of streams, each in the order in which it is asked to. */
export interface FrameDecoder {
  /**
   * Begins the frames of a layout: its meshes in order, and what a step of the grid is, in metres or metres a second.
   * @param mechanics of the bodies that are simulated, in order; where they cannot be, or take too long, decode()
   * rejects each frame with UNSUPPORTED
   */
  begin(
    stream: number,
    meshes: readonly Triangles[],
    gridStep: number,
    mechanics?: readonly (Mechanics | undefined)[],
  ): void;
  /**
   * The vertices of all meshes, in the grid's unit: x y z of each vertex, mesh after mesh. Rejects with PneumaError
   * MALFORMED what is no frame, with WRONG_STATE delta frames from the first whose check fails up to the next key frame,
   * with another code, as UNSUPPORTED, where no later one can be decoded either.
   * @param base the time layer whose last frame it builds on; undefined: a key frame
   * @param layer its own
   * @param check of the vertices as the server has them; undefined: it does not say
   */
  decode(
    stream: number,
    payload: Uint8Array,
    base: number | undefined,
    layer: number,
    check?: number,
  ): Promise<Float64Array>;
  /** Whether so many of a stream's frames wait that more are not to be asked for. */
  isBehind(stream: number): boolean;
  end(stream: number): void;
  /** Frees what it holds; nothing is asked of it after. */
  close(): void;
}

interface Decoding {
  readonly meshes: readonly Triangles[];
  /** Or why there is none. */
  readonly reader: FrameReader | PneumaError;
  readonly gridStep: number;
}

/** Throws PneumaError UNSUPPORTED for mechanics that cannot be, or that take too long. */
function readerOf(
  meshes: readonly Triangles[],
  gridStep: number,
  mechanics: readonly (Mechanics | undefined)[],
): FrameReader {
  let work = 0;
  const orders = meshes.map(makeMeshOrder);
  const simulations = orders.map((order, body) => {
    const own = mechanics[body];
    if (!own) return undefined;
    checkMechanics(order, own, gridStep);
    work += simulatedWork(own, meshes[body]!);
    if (work > simulatedWorkMax) {
      throw new PneumaError("UNSUPPORTED", "more to be simulated than any stream asks for", "mechanics");
    }
    return new SimulatedMotion(order, meshes[body]!, own, gridStep);
  });
  return new FrameReader(orders, simulations);
}

/** The decoder's work, done at once. */
export class StreamReaders {
  private readonly streams = new Map<number, Decoding>();

  begin(...[stream, meshes, gridStep, mechanics = []]: Parameters<FrameDecoder["begin"]>): void {
    let reader: FrameReader | PneumaError;
    try {
      reader = readerOf(meshes, gridStep, mechanics);
    } catch (error) {
      if (!(error instanceof PneumaError)) throw error;
      reader = error;
    }
    this.streams.set(stream, { meshes, reader, gridStep });
  }

  decode(...[stream, payload, base, layer, check]: Parameters<FrameDecoder["decode"]>): Float64Array {
    const decoding = this.streams.get(stream);
    if (!decoding) throw new PneumaError("MALFORMED", "a frame before its layout");
    const { meshes, reader, gridStep } = decoding;
    if (reader instanceof PneumaError) throw reader;
    reader.read(payload, base, layer, check);
    const positions = new Float64Array(3 * meshes.reduce((sum, mesh) => sum + mesh.vertexCount, 0));
    let begin = 0;
    meshes.forEach(({ vertexCount }, body) => {
      reader.positions(body, gridStep, positions.subarray(begin, begin + 3 * vertexCount));
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

  begin(...layout: Parameters<FrameDecoder["begin"]>): void {
    this.readers.begin(...layout);
  }

  decode(...frame: Parameters<FrameDecoder["decode"]>): Promise<Float64Array> {
    return new Promise((resolve) => resolve(this.readers.decode(...frame)));
  }

  isBehind(): boolean {
    return false;
  }

  end(stream: number): void {
    this.readers.end(stream);
  }

  close(): void {}
}
