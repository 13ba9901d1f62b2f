// A frame in a quarter of its memory, to be looked at later: a place is off by no more than a 131,000th of its body's
// size, which no picture shows.
import { create } from "@bufbuild/protobuf";
import { type Frame, QuaternionSchema, type SolidPose, Vec3Schema } from "../src/index.js";

const stepsMax = 65_535; // of 16 bits
const poseNumbers = 7; // a place and a quaternion
const bodyBytes = 4 * 8 + 5 * 8; // where its box begins, a step, and its scalars
const frameBytes = 200; // the objects themselves

interface PackedBody {
  readonly low: readonly [number, number, number];
  readonly stepM: number;
  readonly steps: Uint16Array;
}

function packBody(points: Float64Array): PackedBody {
  const low: [number, number, number] = [Infinity, Infinity, Infinity];
  const high: [number, number, number] = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < points.length; ++i) {
    low[i % 3] = Math.min(low[i % 3]!, points[i]!);
    high[i % 3] = Math.max(high[i % 3]!, points[i]!);
  }
  const stepM = Math.max(high[0] - low[0], high[1] - low[1], high[2] - low[2]) / stepsMax;
  const steps = new Uint16Array(points.length);
  // A body of one point has no size, and no steps.
  if (stepM > 0) for (let i = 0; i < points.length; ++i) steps[i] = Math.round((points[i]! - low[i % 3]!) / stepM);
  return { low, stepM, steps };
}

function unpackBody({ low, stepM, steps }: PackedBody): Float64Array {
  return Float64Array.from(steps, (step, i) => low[i % 3]! + stepM * step);
}

function packPoses(poses: readonly SolidPose[]): Float32Array {
  const numbers = poses.flatMap(({ position: p, orientation: q }) => [p.x, p.y, p.z, q.x, q.y, q.z, q.w]);
  return Float32Array.from(numbers);
}

function unpackPoses(numbers: Float32Array): SolidPose[] {
  return Array.from({ length: numbers.length / poseNumbers }, (_, solid) => {
    const [x, y, z, qx, qy, qz, qw] = numbers.subarray(poseNumbers * solid) as unknown as number[];
    return {
      position: create(Vec3Schema, { x: x!, y: y!, z: z! }),
      orientation: create(QuaternionSchema, { x: qx!, y: qy!, z: qz!, w: qw! }),
    };
  });
}

/** What a frame takes once it is packed. */
export function packedBytes({ positions, poses }: Frame): number {
  const points = positions.reduce((sum, { length }) => sum + 2 * length, 0);
  return frameBytes + points + bodyBytes * positions.length + 4 * poseNumbers * poses.length;
}

/** Without its velocities and contacts. */
export class PackedFrame {
  readonly bytes: number;
  private readonly rest: Omit<Frame, "positions" | "poses" | "velocities" | "contacts">;
  private readonly bodies: readonly PackedBody[];
  private readonly poses: Float32Array;

  constructor(frame: Frame) {
    const { positions, poses, velocities: _, contacts: __, ...rest } = frame;
    this.bytes = packedBytes(frame);
    this.rest = rest;
    this.bodies = positions.map(packBody);
    this.poses = packPoses(poses);
  }

  unpack(): Frame {
    const { rest, bodies, poses } = this;
    return {
      ...rest,
      positions: bodies.map(unpackBody),
      poses: unpackPoses(poses),
      velocities: undefined,
      contacts: [],
    };
  }

  get layout(): Frame["layout"] {
    return this.rest.layout;
  }
}
