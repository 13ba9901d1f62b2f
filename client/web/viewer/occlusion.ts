// Where bodies come close to each other or to the ground, less light gets in between. Each is taken for the ellipsoid in
// its box, and hides the part of the sky that a ball would.
import { type Box3, type Camera, type MeshPhongMaterial, Vector3 } from "three";

// WebGL 2 has room for 224 uniforms of four numbers. Each occluder takes two.
const occludersMax = 64;

// Nothing is divided by 0.
const least = new Vector3(1e-6, 1e-6, 1e-6);

const declarations = `
uniform int occluderCount;
uniform vec3 occluderCentres[${occludersMax}];
uniform vec3 occluderHalves[${occludersMax}];

// The part of the sky over a place that is open, by the cosine to its normal.
float openSky(vec3 place, vec3 up) {
  float open = 1.0;
  for (int i = 0; i < occluderCount; ++i) {
    vec3 way = occluderCentres[i] - place;
    vec3 wayInHalves = way / occluderHalves[i];
    open *= 1.0 - max(dot(up, normalize(way)), 0.0) / max(dot(wayInHalves, wayInHalves), 1.0);
  }
  return open;
}
`;

// vViewPosition is from the place to the eye, as the camera sees it.
function darkening(normal: string): string {
  return `
float openPart = openSky(
  cameraPosition - (vec4(vViewPosition, 0.0) * viewMatrix).xyz,
  (vec4(${normal}, 0.0) * viewMatrix).xyz
);
reflectedLight.indirectDiffuse *= openPart;
reflectedLight.indirectSpecular *= openPart;
`;
}

export class Occlusion {
  isOn = true;
  private readonly uniforms = {
    occluderCount: { value: 0 },
    occluderCentres: { value: Array.from({ length: occludersMax }, () => new Vector3()) },
    occluderHalves: { value: Array.from({ length: occludersMax }, () => new Vector3(1, 1, 1)) },
  };

  /** Has the material darken. A skin with an inside counts as seen from outside, also at its rim. */
  applyTo(material: MeshPhongMaterial, hasInside: boolean): void {
    const before = material.onBeforeCompile.bind(material);
    const text = darkening(hasInside ? "normalize(vNormal)" : "normal");
    const key = material.customProgramCacheKey();
    material.customProgramCacheKey = () => `${key} occluded ${hasInside}`;
    material.onBeforeCompile = (shader, renderer) => {
      before(shader, renderer);
      Object.assign(shader.uniforms, this.uniforms);
      shader.fragmentShader = shader.fragmentShader
        .replace("#include <common>", `#include <common>\n${declarations}`)
        .replace("#include <aomap_fragment>", `#include <aomap_fragment>\n${text}`);
    };
  }

  /** Takes the bodies in these boxes: the ones nearest to the eye, where they are too many. */
  update(boxes: readonly Box3[], { position: eye }: Pick<Camera, "position">): void {
    const { occluderCount, occluderCentres, occluderHalves } = this.uniforms;
    let taken = this.isOn ? boxes : [];
    if (taken.length > occludersMax) {
      const awayM = new Map(taken.map((box) => [box, box.distanceToPoint(eye)]));
      taken = [...taken].sort((a, b) => awayM.get(a)! - awayM.get(b)!).slice(0, occludersMax);
    }
    occluderCount.value = taken.length;
    taken.forEach((box, i) => {
      box.getCenter(occluderCentres.value[i]!);
      box.getSize(occluderHalves.value[i]!).multiplyScalar(0.5).max(least);
    });
  }
}
