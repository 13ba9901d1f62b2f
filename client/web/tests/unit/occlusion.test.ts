// What darkens the picture where bodies come close: which of them count, and that the shader of three.js has a place for it.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Box3, MeshPhongMaterial, PerspectiveCamera, ShaderLib, Vector3 } from "three";
import { Occlusion } from "../../viewer/occlusion.js";

function boxAt(x: number): Box3 {
  return new Box3().setFromCenterAndSize(new Vector3(x, 0, 0), new Vector3(0.5, 1, 2));
}

function shaderOf(occlusion: Occlusion, hasInside: boolean) {
  const material = new MeshPhongMaterial();
  occlusion.applyTo(material, hasInside);
  const uniforms: Record<string, { value: unknown }> = {};
  const shader = { uniforms, fragmentShader: ShaderLib.phong.fragmentShader };
  material.onBeforeCompile(shader as never, undefined as never);
  return { ...shader, key: material.customProgramCacheKey() };
}

test("the nearest bodies darken what is beside them", () => {
  const occlusion = new Occlusion();
  const { uniforms, fragmentShader } = shaderOf(occlusion, true);
  assert.match(fragmentShader, /float openSky\(/);
  assert.match(fragmentShader, /indirectDiffuse \*= openPart/);
  const camera = new PerspectiveCamera();
  camera.position.set(200, 0, 0);
  const boxes = Array.from({ length: 100 }, (_, i) => boxAt(i));
  occlusion.update(boxes, camera);
  assert.equal(uniforms["occluderCount"]!.value, 64);
  const centres = uniforms["occluderCentres"]!.value as Vector3[];
  assert.deepEqual(
    centres.map(({ x }) => x).sort((a, b) => a - b),
    boxes.slice(36).map((_, i) => i + 36),
  );
  occlusion.update([boxAt(3)], camera);
  assert.equal(uniforms["occluderCount"]!.value, 1);
  assert.deepEqual((uniforms["occluderHalves"]!.value as Vector3[])[0], new Vector3(0.25, 0.5, 1));
  occlusion.isOn = false;
  occlusion.update(boxes, camera);
  assert.equal(uniforms["occluderCount"]!.value, 0);
});

test("a flat body is not divided by 0, and skins with an inside have a shader of their own", () => {
  const occlusion = new Occlusion();
  const { uniforms, key } = shaderOf(occlusion, true);
  occlusion.update([new Box3(new Vector3(0, 1, 0), new Vector3(1, 1, 1))], new PerspectiveCamera());
  assert.ok((uniforms["occluderHalves"]!.value as Vector3[])[0]!.y > 0);
  assert.notEqual(key, shaderOf(occlusion, false).key);
});
