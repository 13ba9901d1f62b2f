// Where soft bodies are held off something: a small disc on each such vertex, across the normal, and the normal itself.
import {
  BufferAttribute,
  BufferGeometry,
  CircleGeometry,
  DoubleSide,
  Group,
  InstancedMesh,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  MeshBasicMaterial,
  Quaternion,
  Vector3,
} from "three";
import type { Frame } from "../src/index.js";
import type { SoftBodyView } from "./soft_body_view.js";

const contactsMax = 256; // of Frame.contacts
// Of the size of what is looked at.
const radiusPart = 0.012;
const normalPart = 0.06;
const colour = 0xd6336c;

export class ContactsView {
  readonly group = new Group();
  readonly discs = new InstancedMesh(
    new CircleGeometry(1, 16),
    new MeshBasicMaterial({ color: colour, side: DoubleSide, depthTest: false, transparent: true }),
    contactsMax,
  );
  private readonly normals = new LineSegments(
    new BufferGeometry(),
    new LineBasicMaterial({ color: colour, depthTest: false, transparent: true }),
  );

  constructor() {
    const ends = new BufferAttribute(new Float32Array(6 * contactsMax), 3);
    this.normals.geometry.setAttribute("position", ends);
    for (const part of [this.discs, this.normals]) {
      part.frustumCulled = false;
      part.renderOrder = 1;
      this.group.add(part);
    }
  }

  get count(): number {
    return this.discs.count;
  }

  /** @param sizeM of what is looked at */
  update({ contacts, layout }: Frame, bodies: readonly SoftBodyView[], sizeM: number): void {
    const ends = this.normals.geometry.attributes["position"] as BufferAttribute;
    const outwards = new Vector3(0, 0, 1);
    const [normal, turn, matrix] = [new Vector3(), new Quaternion(), new Matrix4()];
    const size = new Vector3().setScalar(radiusPart * sizeM);
    let count = 0;
    for (const contact of contacts.slice(0, contactsMax)) {
      const kept = layout.softBodies[contact.soft]?.keptVertices ?? [];
      const vertex = kept.length === 0 ? contact.vertex : kept.indexOf(contact.vertex);
      const body = bodies[contact.soft];
      if (!body || vertex < 0 || vertex >= body.vertexCount) continue;
      const at = new Vector3(...body.vertex(vertex));
      normal.copy(contact.normal);
      this.discs.setMatrixAt(count, matrix.compose(at, turn.setFromUnitVectors(outwards, normal), size));
      ends.setXYZ(2 * count, at.x, at.y, at.z);
      at.addScaledVector(normal, normalPart * sizeM);
      ends.setXYZ(2 * count + 1, at.x, at.y, at.z);
      ++count;
    }
    this.discs.count = count;
    this.discs.instanceMatrix.needsUpdate = true;
    this.normals.geometry.setDrawRange(0, 2 * count);
    ends.needsUpdate = true;
  }
}
