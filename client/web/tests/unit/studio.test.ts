// The studio that shiny skins mirror: bright above, dark below, and more of it at a glance than head on.
import assert from "node:assert/strict";
import { test } from "node:test";
import { type CubeTexture, type DataTexture, MeshPhongMaterial, type WebGLProgramParametersWithUniforms } from "three";
import { mirrorStudio } from "../../viewer/studio.js";

function brightness(texture: DataTexture): number {
  const texels = texture.image.data as Uint8Array;
  return texels.reduce((sum, value, i) => (i % 4 === 0 ? sum + value : sum), 0) / (texels.length / 4);
}

test("a material mirrors light from above, none that would hide its colour from below", () => {
  const material = new MeshPhongMaterial();
  mirrorStudio(material, 0.5);
  const [, , above, below] = (material.envMap as CubeTexture).images as DataTexture[];
  assert.ok(brightness(above!) > 3 * brightness(below!), `${brightness(above!)}, ${brightness(below!)}`);
  assert.ok(brightness(below!) < 20);
  assert.equal(material.reflectivity, 0.5);
});

test("what is mirrored depends on the angle, in the shader that this version of three has", () => {
  const material = new MeshPhongMaterial();
  mirrorStudio(material, 0.5);
  const shader = { fragmentShader: "#include <envmap_fragment>" } as WebGLProgramParametersWithUniforms;
  material.onBeforeCompile(shader, undefined as never);
  assert.match(shader.fragmentShader, /reflectivity \* mix\(.*dot\(normal/);
  assert.doesNotMatch(shader.fragmentShader, /specularStrength/);
});

test("materials share one picture", () => {
  const [first, second] = [new MeshPhongMaterial(), new MeshPhongMaterial()];
  for (const material of [first, second]) mirrorStudio(material, 0.5);
  assert.equal(first.envMap, second.envMap);
});
