// Joints: a dot at each end, and a line between the two where they are apart.
import {
  BufferAttribute,
  BufferGeometry,
  Group,
  LineBasicMaterial,
  LineSegments,
  Points,
  PointsMaterial,
  Vector3,
} from "three";
import type { Layout } from "../src/index.js";
import type { SoftBodyView } from "./soft_body_view.js";
import type { SolidView } from "./solid_view.js";

type End = Layout["joints"][number]["first"];

const dotPixels = 7;
const colour = 0x1c7ed6;

export class JointsView {
  readonly group = new Group();
  private readonly ends = new BufferGeometry();
  private readonly dots = new Points(
    this.ends,
    new PointsMaterial({ color: colour, size: dotPixels, sizeAttenuation: false, depthTest: false, transparent: true }),
  );
  private readonly lines = new LineSegments(
    this.ends,
    new LineBasicMaterial({ color: colour, depthTest: false, transparent: true }),
  );

  constructor() {
    for (const part of [this.lines, this.dots]) {
      part.frustumCulled = false;
      part.renderOrder = 1;
      this.group.add(part);
    }
  }

  get count(): number {
    return this.group.visible ? this.ends.drawRange.count / 2 : 0;
  }

  /** x y z of each end. */
  places(): number[] {
    const held = this.ends.attributes["position"];
    return held ? [...held.array.slice(0, 3 * this.ends.drawRange.count)] : [];
  }

  /** Where the bodies and solids are drawn; a joint to a vertex that a coarser mesh leaves out is not. */
  update(
    { joints, softBodies }: Layout,
    bodies: readonly SoftBodyView[],
    solids: readonly (SolidView | undefined)[],
  ): void {
    this.group.visible = joints.length > 0;
    if (joints.length === 0) {
      this.ends.setDrawRange(0, 0);
      return;
    }
    const held = this.ends.attributes["position"] as BufferAttribute | undefined;
    const places =
      held && held.count >= 2 * joints.length ? held : new BufferAttribute(new Float32Array(6 * joints.length), 3);
    if (places !== held) this.ends.setAttribute("position", places);
    const placeOf = ({ soft, solid, vertices, weights, point }: End): Vector3 | undefined => {
      const place = new Vector3();
      if (soft === undefined) {
        place.copy(point);
        if (solid === undefined) return place;
        const mesh = solids[solid]?.mesh;
        return mesh && place.applyQuaternion(mesh.quaternion).add(mesh.position);
      }
      const body = bodies[soft];
      const kept = softBodies[soft]?.keptVertices ?? [];
      for (const [i, vertex] of vertices.entries()) {
        const shown = kept.length === 0 ? vertex : kept.indexOf(vertex);
        if (!body || shown < 0 || shown >= body.vertexCount) return undefined;
        place.addScaledVector(new Vector3(...body.vertex(shown)), weights[i] ?? 0);
      }
      return place;
    };
    let count = 0;
    for (const { first, second } of joints) {
      const from = placeOf(first);
      const to = placeOf(second);
      if (!from || !to) continue;
      places.setXYZ(count++, from.x, from.y, from.z);
      places.setXYZ(count++, to.x, to.y, to.z);
    }
    places.needsUpdate = true;
    this.ends.setDrawRange(0, count);
  }
}
