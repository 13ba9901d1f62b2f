// What shiny skins mirror: a photographer's studio, bright above, dark below, with two boxes of soft light.
import {
  AddOperation,
  CubeTexture,
  DataTexture,
  LinearFilter,
  type MeshPhongMaterial,
  ShaderChunk,
  Vector3,
} from "three";

const edge = 32; // texels

/** A rectangle of light, by the way to its middle, and its half width and height at a distance of 1. */
interface SoftBox {
  readonly towards: Vector3;
  readonly half: readonly [number, number];
  readonly brightness: number;
}

const softBoxes: readonly SoftBox[] = [
  { towards: new Vector3(0.5, 0.75, 0.55).normalize(), half: [0.45, 0.3], brightness: 0.9 },
  { towards: new Vector3(-0.85, 0.35, -0.25).normalize(), half: [0.18, 0.6], brightness: 0.6 },
];
const blur = 0.12; // of its border
// Head on, of what is mirrored at a glance.
const headOn = 0.25;

/** Where each side of a cube's picture looks, by its texel's place from -1 to 1: as WebGL has them. */
const sides: readonly ((s: number, t: number) => Vector3)[] = [
  (s, t) => new Vector3(1, -t, -s),
  (s, t) => new Vector3(-1, -t, s),
  (s, t) => new Vector3(s, 1, t),
  (s, t) => new Vector3(s, -1, -t),
  (s, t) => new Vector3(s, -t, 1),
  (s, t) => new Vector3(-s, -t, -1),
];

function smooth(from: number, to: number, value: number): number {
  const part = Math.min(1, Math.max(0, (value - from) / (to - from)));
  return part * part * (3 - 2 * part);
}

/** How bright the studio is, from 0 to 1. */
function light(way: Vector3): number {
  let sum = 0.04 + 0.22 * smooth(-0.25, 1, way.y);
  for (const { towards, half, brightness } of softBoxes) {
    const ahead = way.dot(towards);
    if (ahead <= 0) continue;
    const across = new Vector3(0, 1, 0).cross(towards).normalize();
    const along = towards.clone().cross(across);
    const inside = [across, along].map((axis, i) => {
      const off = Math.abs(way.dot(axis)) / ahead;
      return 1 - smooth(half[i]! - blur, half[i]! + blur, off);
    });
    sum += brightness * inside[0]! * inside[1]!;
  }
  return Math.min(1, sum);
}

function picture(side: (s: number, t: number) => Vector3): DataTexture {
  const texels = new Uint8Array(4 * edge * edge);
  const place = (i: number) => (2 * (i + 0.5)) / edge - 1;
  for (let i = 0; i < edge * edge; ++i) {
    const value = Math.round(255 * light(side(place(i % edge), place(Math.floor(i / edge))).normalize()));
    texels.set([value, value, value, 255], 4 * i);
  }
  const texture = new DataTexture(texels, edge, edge);
  texture.needsUpdate = true;
  return texture;
}

let studio: CubeTexture | undefined;

function studioPicture(): CubeTexture {
  if (studio) return studio;
  studio = new CubeTexture(sides.map(picture));
  studio.magFilter = studio.minFilter = LinearFilter;
  studio.needsUpdate = true;
  return studio;
}

/** Makes a material mirror the studio, more the flatter it is looked at. */
export function mirrorStudio(material: MeshPhongMaterial, reflectivity: number): void {
  material.envMap = studioPicture();
  material.combine = AddOperation;
  material.reflectivity = reflectivity;
  material.onBeforeCompile = (shader) => {
    const mirrored = ShaderChunk.envmap_fragment.replaceAll(
      "specularStrength * reflectivity",
      `reflectivity * mix(${headOn}, 1.0, pow(1.0 - saturate(dot(normal, normalize(vViewPosition))), 3.0))`,
    );
    shader.fragmentShader = shader.fragmentShader.replace("#include <envmap_fragment>", mirrored);
  };
}
