// Where a soft body will be a frame from now: a few steps of its own springs, gas and planes. The same doubles in the
// same order as the server's codec/simulated_motion, which says why; tests/golden/simulated_motion.txt holds both to it.
import { PneumaError } from "../errors.js";
import type { MeshOrder, Triangles } from "./mesh_order.js";

export interface Plane {
  /** Of length 1; the body stays where its product with a position is `offsetM` or more. */
  readonly normal: readonly number[];
  readonly offsetM: number;
  readonly restitution: number;
  readonly friction: number;
}

export interface Mechanics {
  readonly frameS: number;
  readonly substeps: number;
  /** One a vertex, or one for all; 0: of what nothing moves. */
  readonly massesKg: readonly number[];
  /** One of each of springEdges(). */
  readonly restLengthsM: readonly number[];
  /** Likewise, or one for all. */
  readonly stiffnessesNM: readonly number[];
  readonly dampingNSM: number;
  readonly gas: {
    readonly pressurePa: number;
    readonly volumeM3: number;
    readonly exponent65536ths: number;
    readonly outsidePa: number;
  };
  readonly gravityMS2: readonly number[];
  readonly planes: readonly Plane[];
}

/** Velocities are whole numbers of this unit: steps of the grid a frame. */
const velocityUnit = 0.125;
const velocityGain = 0.2;
const stepsAFrameMax = 2 ** 26;
const velocityMax = stepsAFrameMax / velocityUnit;
const squareLengthMin = 2 ** -10;
const volumeShareMin = 2 ** -6;
const reach = 2;
const roundingShift = 1.5 * 2 ** 52;

/** To the nearest whole number, of two the even one. */
function rounded(value: number): number {
  return value + roundingShift - roundingShift;
}

function power(base: number, exponent65536ths: number): number {
  let result = 1;
  for (let i = 0; i < exponent65536ths >>> 16; ++i) result *= base;
  let root = base;
  for (let bits = (exponent65536ths << 16) >>> 0; bits !== 0; bits = (bits << 1) >>> 0) {
    root = Math.sqrt(root);
    if (bits >>> 31) result *= root;
  }
  return result;
}

/** The slots of each edge's ends, the lower first: slot by slot, the neighbours of a slot in the order of its ring. */
export function springEdges({ size, rings }: MeshOrder): [number, number][] {
  const edges: [number, number][] = [];
  for (let slot = 0; slot < size; ++slot) {
    for (let i = rings.begins[slot]!; i < rings.begins[slot + 1]!; ++i) {
      if (rings.entries[i]! > slot) edges.push([slot, rings.entries[i]!]);
    }
  }
  return edges;
}

const substepsMax = 64;
const planesMax = 16;
const exponentMax = 16 * 65536;
/** Of all bodies of a stream together, of simulatedWork(). */
export const simulatedWorkMax = 2 ** 20;

/** What a frame of such a body takes, in vertices, faces and vertices held off a plane, each simulated once. */
export function simulatedWork({ substeps, planes }: Mechanics, { vertexCount, indices }: Triangles): number {
  return substeps * (vertexCount * (1 + planes.length) + indices.length / 3);
}

/** The mechanics in steps of the grid a substep, and masses, but for what each spring and plane has. */
function unitsOf({ frameS, substeps, dampingNSM, gas, gravityMS2 }: Mechanics, gridStepM: number) {
  const substepS = frameS / substeps;
  const squareS2 = substepS * substepS;
  const areaFactor = (gridStepM * squareS2) / 6;
  return {
    squareS2,
    damping: dampingNSM * substepS,
    gasPressure: gas.pressurePa * areaFactor,
    outside: gas.outsidePa * areaFactor,
    sixGasVolumes: (6 * gas.volumeM3) / (gridStepM * gridStepM * gridStepM),
    gravity: gravityMS2.map((axis) => (axis * squareS2) / gridStepM),
  };
}

function largest(values: readonly number[]): number {
  return values.reduce((most, value) => Math.max(most, value), 0);
}

/**
 * Throws PneumaError UNSUPPORTED for what a body of this order cannot have: the server would tell the same again.
 * @param gridStepM of the frames
 */
export function checkMechanics(order: MeshOrder, mechanics: Mechanics, gridStepM: number): void {
  const { frameS, substeps, massesKg, restLengthsM, stiffnessesNM, dampingNSM, gas, gravityMS2, planes } = mechanics;
  const edges = order.rings.entries.length / 2;
  const need = (isSound: boolean, where: string) => {
    if (!isSound) throw new PneumaError("UNSUPPORTED", "mechanics that no body has", `mechanics.${where}`);
  };
  const areAtLeast = (least: number, values: readonly number[]) =>
    values.every((value) => Number.isFinite(value) && value >= least);
  const oneOr = (count: number, { length }: readonly number[]) => length === 1 || length === count;
  need(frameS > 0 && Number.isFinite(frameS), "frame_s");
  need(substeps >= 1 && substeps <= substepsMax, "substeps");
  need(oneOr(order.size, massesKg) && areAtLeast(0, massesKg), "masses_kg");
  need(restLengthsM.length === edges && areAtLeast(0, restLengthsM), "rest_lengths_m");
  need(oneOr(edges, stiffnessesNM) && areAtLeast(0, stiffnessesNM), "stiffnesses_n_m");
  need(areAtLeast(0, [dampingNSM]), "damping_n_s_m");
  need(
    areAtLeast(0, [gas.pressurePa, gas.volumeM3, gas.outsidePa]) &&
      gas.volumeM3 > 0 &&
      gas.exponent65536ths <= exponentMax,
    "gas",
  );
  need(areAtLeast(-Infinity, gravityMS2), "gravity_m_s2");
  need(planes.length <= planesMax, "planes");
  for (const { normal, offsetM, restitution, friction } of planes) {
    need(
      normal.every((coordinate) => Math.abs(coordinate) <= 1) &&
        Number.isFinite(offsetM / gridStepM) &&
        areAtLeast(0, [restitution, friction]),
      "planes",
    );
  }
  const { squareS2, damping, gasPressure, outside, sixGasVolumes, gravity } = unitsOf(mechanics, gridStepM);
  // Of the largest ones, which no spring's own are past.
  const stiffness = largest(stiffnessesNM) * squareS2;
  const tension = stiffness * (largest(restLengthsM) / gridStepM);
  const inSteps = [stiffness, tension, damping, gasPressure, outside, sixGasVolumes, ...gravity];
  need(inSteps.every(Number.isFinite), "frame_s");
}

/** The velocities that a frame's moves amount to. */
export function velocitiesOf(moves: Int32Array): Int32Array {
  return moves.map((move) => Math.max(-stepsAFrameMax, Math.min(stepsAFrameMax, move)) / velocityUnit);
}

/** Of a list of one for all, too. */
function entry(values: readonly number[], i: number): number {
  return values[values.length === 1 ? 0 : i]!;
}

/** Of each entry of the rings, which of springEdges() it is. */
function springsOfRings(
  { size, rings: { begins, entries } }: MeshOrder,
  edges: readonly [number, number][],
): Int32Array {
  // By slot, the edges that it is the higher end of; those that it is the lower end of follow each other.
  const ends = new Int32Array(size + 1);
  for (const [, high] of edges) ends[high + 1]! += 1;
  for (let slot = 0; slot < size; ++slot) ends[slot + 1]! += ends[slot]!;
  const next = ends.slice();
  const fromLower = new Int32Array(edges.length);
  edges.forEach(([, high], edge) => {
    fromLower[next[high]!++] = edge;
  });
  const springs = new Int32Array(entries.length);
  const springTo = new Int32Array(size); // each lower neighbour of the slot at hand
  let edge = 0;
  for (let slot = 0; slot < size; ++slot) {
    for (let i = ends[slot]!; i < ends[slot + 1]!; ++i) springTo[edges[fromLower[i]!]![0]] = fromLower[i]!;
    for (let i = begins[slot]!; i < begins[slot + 1]!; ++i) {
      springs[i] = entries[i]! > slot ? edge++ : springTo[entries[i]!]!;
    }
  }
  return springs;
}

interface PlacedPlane {
  readonly x: number;
  readonly y: number;
  readonly z: number;
  readonly w: number;
  readonly restitution: number;
  readonly friction: number;
}

export class SimulatedMotion {
  readonly #order: MeshOrder;
  readonly #faces: Int32Array;
  readonly #ends: Int32Array;
  readonly #ringSprings: Int32Array;
  readonly #stiffness: Float64Array;
  readonly #tensionAtRest: Float64Array;
  readonly #inverseMass: Float64Array;
  readonly #gravity: [number, number, number];
  readonly #planes: readonly Plane[];
  readonly #gridStepM: number;
  readonly #substeps: number;
  readonly #damping: number;
  readonly #gasPressure: number;
  readonly #outside: number;
  readonly #gasExponent: number;
  readonly #sixGasVolumes: number;
  // Of the frame under way:
  readonly #inverseLength: Float64Array;
  readonly #length: Float64Array;
  readonly #pulls: Float64Array;
  readonly #start: Float64Array;
  readonly #gradient: Float64Array;
  readonly #steps: Float64Array;
  #positions: Float64Array;
  #next: Float64Array;
  #nearPlanes: PlacedPlane[] = [];
  readonly #volumeSums: [number, number, number] = [0, 0, 0];
  #volumeBase = 0;

  constructor(order: MeshOrder, mesh: Triangles, mechanics: Mechanics, gridStepM: number) {
    const count = order.size;
    this.#order = order;
    this.#gridStepM = gridStepM;
    this.#substeps = mechanics.substeps;
    this.#planes = mechanics.planes;
    const { squareS2, damping, gasPressure, outside, sixGasVolumes, gravity } = unitsOf(mechanics, gridStepM);
    this.#damping = damping;
    this.#gasPressure = gasPressure;
    this.#outside = outside;
    this.#gasExponent = mechanics.gas.exponent65536ths;
    this.#sixGasVolumes = sixGasVolumes;
    const [gx = 0, gy = 0, gz = 0] = gravity;
    this.#gravity = [gx, gy, gz];
    const slots = new Int32Array(count);
    this.#inverseMass = new Float64Array(count);
    for (let slot = 0; slot < count; ++slot) {
      const vertex = order.vertices[slot]!;
      slots[vertex] = slot;
      const massKg = entry(mechanics.massesKg, vertex);
      if (massKg > 0) this.#inverseMass[slot] = 1 / massKg;
    }
    this.#faces = Int32Array.from(mesh.indices, (vertex) => slots[vertex]!);
    const edges = springEdges(order);
    this.#ends = Int32Array.from(edges.flat());
    this.#ringSprings = springsOfRings(order, edges);
    this.#stiffness = Float64Array.from(edges, (_, i) => entry(mechanics.stiffnessesNM, i) * squareS2);
    this.#tensionAtRest = this.#stiffness.map((stiffness, i) => stiffness * (mechanics.restLengthsM[i]! / gridStepM));
    this.#inverseLength = new Float64Array(edges.length);
    this.#length = new Float64Array(edges.length);
    this.#pulls = new Float64Array(edges.length);
    this.#start = new Float64Array(3 * count);
    this.#gradient = new Float64Array(3 * count);
    this.#steps = new Float64Array(3 * count);
    this.#positions = new Float64Array(3 * count);
    this.#next = new Float64Array(3 * count);
  }

  /** Writes how far each slot will move, in 16ths of a step. Three numbers a slot in all lists. */
  predict(points: Float64Array, velocities: Int32Array, drift: Int32Array): void {
    this.#beginFrame(points, velocities);
    this.#placePlanes(points);
    this.#measureEdges();
    for (let i = 0; i < points.length; ++i) this.#positions[i]! += 0.5 * this.#steps[i]!;
    for (let substep = 0; substep < this.#substeps; ++substep) {
      this.#pullEdges(substep === 0 ? 2 * this.#damping : this.#damping);
      if (substep % 2 === 0) this.#findGradient();
      this.#moveVertices(this.#pressureFactor(), substep + 1 < this.#substeps ? 0.5 : 0);
    }
    if (this.#endFrame(drift)) return;
    const share = velocityUnit / this.#substeps;
    for (let i = 0; i < points.length; ++i) {
      drift[i] = velocities[i]! << 1;
      this.#next[i] = velocities[i]! * velocityUnit;
      this.#steps[i] = velocities[i]! * share;
    }
  }

  /** After predict(), when the frame's moves are known: the velocities at its end. */
  correct(moves: Int32Array): Int32Array {
    const velocities = new Int32Array(moves.length);
    for (let i = 0; i < moves.length; ++i) {
      const missed = moves[i]! - this.#next[i]!;
      const velocity = (this.#substeps * this.#steps[i]! + velocityGain * missed) * (1 / velocityUnit);
      velocities[i] = rounded(Math.max(-velocityMax, Math.min(velocityMax, velocity)));
    }
    return velocities;
  }

  #beginFrame(points: Float64Array, velocities: Int32Array): void {
    const share = velocityUnit / this.#substeps;
    for (let i = 0; i < points.length; ++i) {
      this.#start[i] = points[i]! - points[i % 3]!;
      this.#steps[i] = velocities[i]! * share;
    }
    this.#positions.set(this.#start);
  }

  #placePlanes(points: Float64Array): void {
    this.#nearPlanes = [];
    if (this.#planes.length === 0) return;
    const start = this.#start;
    const steps = this.#steps;
    let fastest = 0;
    for (let i = 0; i < steps.length; i += 3) {
      fastest = Math.max(
        fastest,
        steps[i]! * steps[i]! + steps[i + 1]! * steps[i + 1]! + steps[i + 2]! * steps[i + 2]!,
      );
    }
    const [gx, gy, gz] = this.#gravity;
    const falling = Math.sqrt(gx * gx + gy * gy + gz * gz) * this.#substeps;
    const way = reach * this.#substeps * (Math.sqrt(fastest) + falling);
    for (const { normal, offsetM, restitution, friction } of this.#planes) {
      const [x = 0, y = 0, z = 0] = normal;
      const w = x * points[0]! + y * points[1]! + z * points[2]! - offsetM / this.#gridStepM;
      let lowest = way;
      for (let i = 0; i < start.length; i += 3) {
        const distance = x * start[i]! + y * start[i + 1]! + (z * start[i + 2]! + w);
        if (distance < lowest) lowest = distance;
      }
      if (lowest < way) this.#nearPlanes.push({ x, y, z, w, restitution, friction });
    }
  }

  #measureEdges(): void {
    for (let edge = 0; edge < this.#pulls.length; ++edge) {
      const square = this.#squareLength(this.#start, edge);
      const length = Math.sqrt(square);
      this.#length[edge] = length;
      this.#inverseLength[edge] = square >= squareLengthMin ? 1 / length : 0;
    }
  }

  #squareLength(at: Float64Array, edge: number): number {
    const a = 3 * this.#ends[2 * edge]!;
    const b = 3 * this.#ends[2 * edge + 1]!;
    const x = at[a]! - at[b]!;
    const y = at[a + 1]! - at[b + 1]!;
    const z = at[a + 2]! - at[b + 2]!;
    return x * x + y * y + z * z;
  }

  #pullEdges(damping: number): void {
    const at = this.#positions;
    const lengths = this.#length;
    const inverses = this.#inverseLength;
    const pulls = this.#pulls;
    for (let edge = 0; edge < pulls.length; ++edge) {
      const square = this.#squareLength(at, edge);
      const last = inverses[edge]!;
      const product = square * last * last;
      const inverse = last * (1.5 - 0.5 * (product < 2 ? product : 2));
      const length = square * inverse;
      pulls[edge] =
        this.#stiffness[edge]! - this.#tensionAtRest[edge]! * inverse + damping * (length - lengths[edge]!) * inverse;
      inverses[edge] = inverse;
      lengths[edge] = length;
    }
  }

  #findGradient(): void {
    const at = this.#next;
    const positions = this.#positions;
    const gradient = this.#gradient.fill(0);
    for (let i = 0; i < at.length; ++i) at[i] = positions[i]! + 0.5 * this.#steps[i]!;
    for (let face = 0; face < this.#faces.length; face += 3) {
      const a = 3 * this.#faces[face]!;
      const b = 3 * this.#faces[face + 1]!;
      const c = 3 * this.#faces[face + 2]!;
      const bx = at[b]! - at[a]!;
      const by = at[b + 1]! - at[a + 1]!;
      const bz = at[b + 2]! - at[a + 2]!;
      const cx = at[c]! - at[a]!;
      const cy = at[c + 1]! - at[a + 1]!;
      const cz = at[c + 2]! - at[a + 2]!;
      const x = by * cz - bz * cy;
      const y = bz * cx - bx * cz;
      const z = bx * cy - by * cx;
      for (let corner = face; corner < face + 3; ++corner) {
        const to = 3 * this.#faces[corner]!;
        gradient[to]! += x;
        gradient[to + 1]! += y;
        gradient[to + 2]! += z;
      }
    }
    const middle = [0, 0, 0];
    this.#volumeSums.fill(0);
    for (let i = 0; i < at.length; i += 3) {
      for (let axis = 0; axis < 3; ++axis) {
        this.#volumeSums[axis]! += gradient[i + axis]! * positions[i + axis]!;
        middle[axis]! += gradient[i + axis]! * at[i + axis]!;
      }
    }
    this.#volumeBase = (middle[0]! + middle[1]! + middle[2]!) * (2 / 3);
  }

  #pressureFactor(): number {
    const [x, y, z] = this.#volumeSums;
    const sixVolumes = x + y + z - this.#volumeBase;
    const least = this.#sixGasVolumes * volumeShareMin;
    const within = sixVolumes > least ? sixVolumes : least;
    return this.#gasPressure * power(this.#sixGasVolumes / within, this.#gasExponent) - this.#outside;
  }

  #moveVertices(pressure: number, ahead: number): void {
    const { begins, entries } = this.#order.rings;
    const from = this.#positions;
    const to = this.#next;
    const steps = this.#steps;
    const gradient = this.#gradient;
    const [gx, gy, gz] = this.#gravity;
    let volumeX = 0;
    let volumeY = 0;
    let volumeZ = 0;
    for (let slot = 0; slot < this.#inverseMass.length; ++slot) {
      const at = 3 * slot;
      let x = 0;
      let y = 0;
      let z = 0;
      let all = 0;
      for (let i = begins[slot]!; i < begins[slot + 1]!; ++i) {
        const near = 3 * entries[i]!;
        const pull = this.#pulls[this.#ringSprings[i]!]!;
        x += pull * from[near]!;
        y += pull * from[near + 1]!;
        z += pull * from[near + 2]!;
        all += pull;
      }
      const inverse = this.#inverseMass[slot]!;
      const falls = inverse > 0 ? 1 : 0;
      let stepX = steps[at]! + (inverse * (x - all * from[at]! + pressure * gradient[at]!) + falls * gx);
      let stepY = steps[at + 1]! + (inverse * (y - all * from[at + 1]! + pressure * gradient[at + 1]!) + falls * gy);
      let stepZ = steps[at + 2]! + (inverse * (z - all * from[at + 2]! + pressure * gradient[at + 2]!) + falls * gz);
      let endX = from[at]! + 0.5 * stepX;
      let endY = from[at + 1]! + 0.5 * stepY;
      let endZ = from[at + 2]! + 0.5 * stepZ;
      for (const plane of this.#nearPlanes) {
        const distance = plane.x * endX + plane.y * endY + (plane.z * endZ + plane.w);
        if (!(distance < 0)) continue;
        endX -= distance * plane.x;
        endY -= distance * plane.y;
        endZ -= distance * plane.z;
        const inward = plane.x * stepX + plane.y * stepY + plane.z * stepZ;
        if (!(inward < 0)) continue;
        const alongX = stepX - inward * plane.x;
        const alongY = stepY - inward * plane.y;
        const alongZ = stepZ - inward * plane.z;
        const bounce = -(1 + plane.restitution) * inward;
        const speed = Math.sqrt(alongX * alongX + alongY * alongY + alongZ * alongZ);
        const rubbed = plane.friction * bounce;
        const kept = rubbed < speed ? 1 - rubbed / speed : 0;
        stepX = kept * alongX + (inward + bounce) * plane.x;
        stepY = kept * alongY + (inward + bounce) * plane.y;
        stepZ = kept * alongZ + (inward + bounce) * plane.z;
      }
      to[at] = endX + ahead * stepX;
      to[at + 1] = endY + ahead * stepY;
      to[at + 2] = endZ + ahead * stepZ;
      steps[at] = stepX;
      steps[at + 1] = stepY;
      steps[at + 2] = stepZ;
      volumeX += gradient[at]! * to[at]!;
      volumeY += gradient[at + 1]! * to[at + 1]!;
      volumeZ += gradient[at + 2]! * to[at + 2]!;
    }
    this.#volumeSums[0] = volumeX;
    this.#volumeSums[1] = volumeY;
    this.#volumeSums[2] = volumeZ;
    this.#positions = to;
    this.#next = from;
  }

  #endFrame(drift: Int32Array): boolean {
    let isWithin = true;
    for (let i = 0; i < this.#start.length; ++i) {
      const moved = this.#positions[i]! - this.#start[i]!;
      const speed = this.#substeps * this.#steps[i]!;
      isWithin &&= Math.abs(moved) < stepsAFrameMax && Math.abs(speed) < stepsAFrameMax;
      drift[i] = rounded(16 * moved);
      this.#next[i] = moved;
    }
    return isWithin;
  }
}
