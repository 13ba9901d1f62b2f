// What is in a world as things to draw: its soft bodies and solids, where a moment of its stream has them.
import { Box3, type Camera, Color, Group, Vector3 } from "three";
import type { Frame, Layout, Mesh as BodyMesh } from "../src/index.js";
import type { Bounds } from "./bounds_view.js";
import { niceCeiling } from "./colour_map.js";
import { bodyColour } from "./colours.js";
import { ContactsView } from "./contacts_view.js";
import { JointsView } from "./joints_view.js";
import { type Field, type Scale, scaleOf } from "./legend.js";
import type { Moment } from "./playback.js";
import { Occlusion } from "./occlusion.js";
import { type Rest, SoftBodyView } from "./soft_body_view.js";
import { SolidView } from "./solid_view.js";

export const schemes = {
  light: { paper: 0xf4f1ec, ink: 0x1d2430, floor: 0xe6e0d6, solid: 0xb9b3a8, grid: 0xb8b0a2 },
  dark: { paper: 0x14181f, ink: 0xf4f1ec, floor: 0x252c38, solid: 0x6d7788, grid: 0x465063 },
};

export interface Shown {
  readonly wireframe: boolean;
  readonly points: boolean;
  readonly velocities: boolean;
  readonly contacts: boolean;
  readonly bounds: Bounds;
  /** What the bodies' colours say. */
  readonly field: Field;
  readonly dark: boolean;
}

export const plain: Shown = {
  wireframe: false,
  points: false,
  velocities: false,
  contacts: false,
  bounds: "none",
  field: "body",
  dark: false,
};

// Below it, a colour would show what the frames' rounding makes.
const strainLeast = 0.02;

export class WorldView {
  readonly group = new Group();
  bodies: SoftBodyView[] = [];
  solids: (SolidView | undefined)[] = [];
  /** Names of the bodies that are. */
  readonly frozen = new Set<string>();
  readonly occlusion = new Occlusion();
  private layout: Layout | undefined;
  private shown = plain;
  private readonly contacts = new ContactsView();
  private readonly joints = new JointsView();
  private sizeM = 1;
  /** Of the field that is shown: the values that there were, from the first frame of it on. */
  private range = { low: 0, high: 0 };
  private since_ = "";
  private resets = 0;

  /** @param isFine whether bodies are drawn rounder than their faces and dark between: a small picture does not show it */
  constructor(private readonly isFine: boolean) {
    this.group.add(this.contacts.group, this.joints.group);
  }

  /** Of the colours, where they say something. */
  get scale(): Scale | undefined {
    const { field } = this.shown;
    if (field === "body" || this.bodies.length === 0) return undefined;
    return scaleOf(field, this.range.low, this.range.high || 1);
  }

  /** The moment that strains are measured against. */
  get since(): string {
    return this.since_;
  }

  get contactCount(): number {
    return this.contacts.count;
  }

  show(shown: Shown): void {
    if (shown.field !== this.shown.field) this.range = { low: 0, high: 0 };
    this.shown = shown;
    this.contacts.group.visible = shown.contacts;
    const scheme = shown.dark ? schemes.dark : schemes.light;
    for (const body of this.bodies) body.show(shown, scheme.ink);
    for (const solid of this.solids) {
      const isGround = solid && (solid.isRoom || !solid.isBounded);
      solid?.mesh.material.color.set(isGround ? scheme.floor : scheme.solid);
      solid?.outline?.material.color.set(scheme.grid);
    }
  }

  update(moment: Moment): void {
    const { from, to, fraction } = moment;
    if (to.layout !== this.layout) this.build(to.layout, to);
    if (moment.resets !== this.resets) this.rebase(to);
    this.resets = moment.resets;
    const velocities = fraction < 0.5 ? from.velocities : to.velocities;
    this.bodies.forEach((body, i) => {
      body.update(from.positions[i]!, to.positions[i]!, fraction, velocities?.[i]);
    });
    this.paint(to);
    if (this.shown.contacts) this.contacts.update(fraction < 0.5 ? from : to, this.bodies, this.sizeM);
    this.solids.forEach((solid, i) => solid?.update(from.poses[i]!, to.poses[i]!, fraction));
    this.joints.update(to.layout, this.bodies, this.solids);
  }

  get hasRoom(): boolean {
    return this.solids.some((solid) => solid?.isRoom);
  }

  get hasGround(): boolean {
    return this.solids.some((solid) => solid && (solid.isRoom || !solid.isBounded));
  }

  /** Around a soft body or a solid; undefined: there is none of that name. */
  boxOf(name: string): Box3 | undefined {
    const mesh =
      this.bodies.find((body) => body.name === name)?.skin ??
      this.solids.find((solid) => solid?.isBounded && solid.name === name)?.mesh;
    return mesh && new Box3().setFromObject(mesh, true);
  }

  /** Around what there is to see. */
  box(): Box3 {
    const box = new Box3();
    for (const { skin } of this.bodies) {
      skin.geometry.computeBoundingBox();
      box.union(skin.geometry.boundingBox!);
    }
    for (const solid of this.solids) if (solid?.isRoom) box.union(solid.sweptBox());
    box.union(new Box3().setFromArray(this.joints.places())); // with what bodies hang from
    // A rigid body may have flown off; where there is nothing else, it is what there is to see.
    if (box.isEmpty()) for (const solid of this.solids) if (solid?.isBounded) box.expandByObject(solid.mesh);
    if (box.isEmpty()) box.set(new Vector3(-1, -1, -1), new Vector3(1, 1, 1));
    this.sizeM = box.getSize(new Vector3()).length() / 2;
    return box;
  }

  /** Lets go of all that is in it; the next moment may be another world's. */
  clear(): void {
    this.group.clear();
    this.group.add(this.contacts.group, this.joints.group);
    this.range = { low: 0, high: 0 };
    for (const part of [...this.bodies, ...this.solids]) part?.dispose();
    this.bodies = [];
    this.solids = [];
    this.layout = undefined;
  }

  private paint({ scalars }: Frame): void {
    const { field } = this.shown;
    const pressures = scalars?.pressurePa;
    if (field === "strain") {
      const largest = this.bodies.reduce((most, body) => Math.max(most, body.computeStrain()), 0);
      this.widen(0, Math.max(largest, strainLeast));
      for (const body of this.bodies) body.paintStrain(this.scale!);
    } else if (field === "pressure" && pressures && pressures.length > 0) {
      this.widen(Math.min(...pressures), Math.max(...pressures));
      this.bodies.forEach((body, i) => body.paint(pressures[i]!, this.scale!));
    } else {
      const paper = new Color(this.shown.dark ? schemes.dark.paper : schemes.light.paper);
      this.bodies.forEach((body, i) => body.paintPlain(paper, this.restOf(body.name, scalars?.asleep[i] ?? false)));
    }
  }

  private restOf(name: string, isAsleep: boolean): Rest {
    if (this.frozen.has(name)) return "frozen";
    return isAsleep ? "asleep" : "none";
  }

  /** Makes room in the range for these values; it never gets narrower, which would change what colours say. */
  private widen(low: number, high: number): void {
    if (low < this.range.low) this.range.low = -niceCeiling(-low);
    if (high > this.range.high) this.range.high = niceCeiling(high);
  }

  /** Measures strains against what is shown from now on. */
  private rebase({ tick, timeS }: Frame): void {
    for (const body of this.bodies) body.rebase();
    this.range = { low: 0, high: 0 };
    this.since_ = `tick ${tick} (${timeS.toFixed(1)} s)`;
  }

  /** Darkens what bodies are close to, as they were last updated. */
  occlude(camera: Camera): void {
    if (!this.occlusion.isOn) return this.occlusion.update([], camera);
    const skins = this.bodies.filter(({ isClosed }) => isClosed).map(({ skin }) => skin);
    for (const { geometry } of skins) geometry.computeBoundingBox();
    const solids = this.solids.filter((solid) => solid?.isConvex).map((solid) => new Box3().setFromObject(solid!.mesh));
    this.occlusion.update([...skins.map(({ geometry }) => geometry.boundingBox!), ...solids], camera);
  }

  private bodyView(name: string, mesh: BodyMesh, index: number): SoftBodyView {
    const body = new SoftBodyView(name, mesh, new Color(...bodyColour(index)), this.isFine);
    if (this.isFine) this.occlusion.applyTo(body.skin.material, body.isClosed);
    return body;
  }

  private build(layout: Layout, frame: Frame): void {
    const before = this.bodies;
    const isFirst = this.layout === undefined;
    // The same body goes on as it is, with what its strains are measured against.
    const bodies = layout.softBodies.map(({ name, mesh }, i) => {
      const same = before.find((body) => body.name === name && body.mesh === mesh);
      return same ?? this.bodyView(name, mesh, i);
    });
    const { range } = this;
    this.bodies = before.filter((body) => !bodies.includes(body));
    this.clear();
    this.layout = layout;
    this.bodies = bodies;
    if (isFirst) this.rebase(frame);
    else this.range = range;
    this.solids = layout.solids.map((solid) => SolidView.of(solid));
    if (this.isFine) for (const solid of this.solids) if (solid) this.occlusion.applyTo(solid.mesh.material, false);
    for (const body of this.bodies) this.group.add(body.group);
    for (const solid of this.solids) if (solid) this.group.add(solid.mesh);
    this.show(this.shown);
  }
}
