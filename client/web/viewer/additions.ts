// What can be put into a world: soft bodies, rigid ones and obstacles, of a size and softness that the world can step.
import { create } from "@bufbuild/protobuf";
import { Vector3 } from "three";
import { type Frame, PneumaError, type Scene, SoftBodySchema, type Vec3, Vec3Schema } from "../src/index.js";
import type { Change } from "./inverse_edit.js";
import { freePlace, newName, places, radiusOf } from "./surroundings.js";
import { temperatureUnsetK } from "./unset.js";
import type { Wish } from "./world_edits.js";

/** What is to be added. */
export interface Thing {
  /** One of `kinds`, or `copy:` and a soft body's name. */
  readonly kind: string;
  readonly radiusM: number;
  /** Factors of what suits the world. */
  readonly gas: number;
  readonly stiffness: number;
}

export const kinds: Readonly<Record<string, string>> = {
  "soft-ball": "Soft ball",
  ball: "Rigid ball",
  box: "Rigid box",
  floor: "Floor",
  block: "Fixed box",
  bump: "Fixed ball",
};

const gasConstant = 8.314462618; // J/(mol K)
const ballSubdivisions = 2;
const ballVertices = 162;
// Of a skin whose springs are drawn out by a tenth, as in the paper's balls.
const restScale = 0.9;
const surface = { restitution: 0.5, friction: 0.5 };

export interface Skin {
  readonly massKg: number;
  readonly stiffnessNM: number;
  readonly dampingNSM: number;
  readonly restScale: number;
}

/**
 * Springs for a body of that many vertices that a world steps as well as it does the first of its own: what a step can
 * take of stiffness and damping goes by a vertex's mass.
 */
export function skinFor(scene: Scene, frame: Frame | undefined, vertices: number): Skin {
  const sizes = new Map(frame?.layout.softBodies.map(({ name, mesh }) => [name, mesh.vertexCount]));
  const like = scene.softBodies.find(({ name, springs }) => springs?.stiffnessNM && sizes.has(name));
  const massKg = like?.massKg ?? 1;
  const vertexKg = massKg / vertices;
  if (!like) {
    const { rateHz = 60, substeps = 0 } = scene.stepping ?? {};
    const stepS = 1 / (rateHz * (substeps || 8));
    // Well within what explicit steps are stable at, omega dt of 0.8 for 6 k a vertex.
    const stiffnessNM = (0.1 * vertexKg) / stepS ** 2;
    return { massKg, stiffnessNM, dampingNSM: (0.003 * vertexKg) / stepS, restScale };
  }
  const share = vertexKg / (massKg / sizes.get(like.name)!);
  const { stiffnessNM = 0, dampingNSM = 0, restScale: ownScale = 1 } = like.springs!;
  return {
    massKg,
    stiffnessNM: share * stiffnessNM,
    dampingNSM: share * dampingNSM,
    restScale: ownScale < 1 ? ownScale : restScale,
  };
}

/**
 * So many moles that the gas holds the drawn skin about where it is. A net of triangles with the springs' force f on its
 * edges l has the tension sqrt(3) f / l, and a ball's skin holds 2 tension / radius.
 */
export function molesFor(skin: Skin, volumeM3: number, outsidePa: number): number {
  const radiusM = Math.cbrt((3 * volumeM3) / (4 * Math.PI));
  const tension = Math.sqrt(3) * skin.stiffnessNM * (1 - skin.restScale);
  return ((outsidePa + (2 * tension) / radiusM) * volumeM3) / (gasConstant * temperatureUnsetK);
}

/** About the mean radius of what is there, or half a metre. */
export function usualRadiusM(frame: Frame | undefined): number {
  const radii = frame ? places(frame).map(radiusOf) : [];
  const radius = radii.length === 0 ? 0.5 : radii.reduce((sum, each) => sum + each, 0) / radii.length;
  return Number(radius.toPrecision(1)); // so that balls are of few meshes
}

function point({ x, y, z }: Vector3): Pick<Vec3, "x" | "y" | "z"> {
  return { x, y, z };
}

export interface Addition extends Wish {
  readonly name: string;
}

/** @param centre about where it is to be */
export function addition(scene: Scene, frame: Frame, thing: Thing, centre: Vector3): Addition {
  const { kind } = thing;
  const of = kind.startsWith("copy:") ? kind.slice("copy:".length) : undefined;
  const name = newName(scene, of?.replace(/-\d+$/, "") ?? kind);
  const changes = of === undefined ? ofKind(scene, frame, thing, name, centre) : copy(scene, frame, of, name, centre);
  return { name, says: `Add ${name}`, changes };
}

function ofKind(scene: Scene, frame: Frame, thing: Thing, name: string, centre: Vector3): Change[] {
  const { kind, radiusM } = thing;
  if (kind === "soft-ball") return softBall(scene, frame, thing, name, centre);
  if (kind === "floor") {
    const lowest = Math.min(centre.y, ...places(frame).map(({ box }) => box.min.y));
    const value = { name, shape: { shape: { case: "plane", value: {} } }, position: { y: lowest }, surface } as const;
    return [{ change: { case: "addCollider", value } }];
  }
  const ball = { shape: { case: "sphere", value: { radiusM } } } as const;
  const halfExtents = { x: radiusM, y: radiusM, z: radiusM };
  const box = { shape: { case: "box", value: { halfExtents } } } as const;
  const position = point(freePlace(frame, centre, radiusM));
  const shape = kind === "box" || kind === "block" ? box : ball;
  if (kind === "block" || kind === "bump") {
    return [{ change: { case: "addCollider", value: { name, shape, position, surface } } }];
  }
  const massKg = skinFor(scene, frame, ballVertices).massKg;
  return [{ change: { case: "addRigidBody", value: { name, shape, massKg, position, surface } } }];
}

function softBall(scene: Scene, frame: Frame, thing: Thing, name: string, centre: Vector3): Change[] {
  const { radiusM } = thing;
  const like = scene.meshes.find(
    ({ shape }) =>
      shape.case === "icosphere" &&
      shape.value.subdivisions === ballSubdivisions &&
      (shape.value.radiusM ?? 1) === radiusM,
  );
  const mesh = like?.name ?? newName(scene, `${name}-mesh`);
  const skin = skinFor(scene, frame, ballVertices);
  const { massKg, restScale, dampingNSM } = skin;
  const outsidePa = scene.atmosphere?.pressurePa ?? 0;
  const moles = thing.gas * molesFor(skin, (4 / 3) * Math.PI * radiusM ** 3, outsidePa);
  const springs = { stiffnessNM: thing.stiffness * skin.stiffnessNM, dampingNSM, restScale };
  const position = point(freePlace(frame, centre, radiusM));
  const body = { name, mesh, massKg, springs, gas: { moles }, surface, position };
  const icosphere = { subdivisions: ballSubdivisions, radiusM };
  const changes: Change[] = [{ change: { case: "addSoftBody", value: body } }];
  if (!like) {
    changes.unshift({
      change: { case: "addMesh", value: { name: mesh, shape: { case: "icosphere", value: icosphere } } },
    });
  }
  return changes;
}

function copy(scene: Scene, frame: Frame, of: string, name: string, centre: Vector3): Change[] {
  const body = scene.softBodies.find((each) => each.name === of);
  if (!body) throw new PneumaError("NOT_FOUND", "there is no such body any more", of);
  const place = places(frame).find((each) => each.name === of);
  const position = point(freePlace(frame, centre, place ? radiusOf(place) : 0.5));
  const { velocity: _, ...still } = body;
  const value = create(SoftBodySchema, { ...still, name, position: create(Vec3Schema, position) });
  return [{ change: { case: "addSoftBody", value } }];
}
