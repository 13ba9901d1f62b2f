// What is in a world as things to draw: its soft bodies and solids, where a moment of its stream has them.
import { Box3, Color, Group, Vector3 } from "three";
import type { Layout } from "../src/index.js";
import { bodyColour } from "./colours.js";
import type { Moment } from "./playback.js";
import { SoftBodyView } from "./soft_body_view.js";
import { SolidView } from "./solid_view.js";

export const schemes = {
  light: { paper: 0xf4f1ec, ink: 0x1d2430, floor: 0xe6e0d6, solid: 0xb9b3a8, grid: 0xb8b0a2 },
  dark: { paper: 0x14181f, ink: 0xf4f1ec, floor: 0x252c38, solid: 0x6d7788, grid: 0x465063 },
};

export interface Shown {
  readonly wireframe: boolean;
  readonly velocities: boolean;
  readonly dark: boolean;
}

export const plain: Shown = { wireframe: false, velocities: false, dark: false };

export class WorldView {
  readonly group = new Group();
  bodies: SoftBodyView[] = [];
  solids: (SolidView | undefined)[] = [];
  private layout: Layout | undefined;
  private shown = plain;

  show(shown: Shown): void {
    this.shown = shown;
    const scheme = shown.dark ? schemes.dark : schemes.light;
    for (const body of this.bodies) body.show(shown.wireframe, shown.velocities, scheme.ink);
    for (const solid of this.solids) {
      const isGround = solid && (solid.isRoom || !solid.isBounded);
      solid?.mesh.material.color.set(isGround ? scheme.floor : scheme.solid);
      solid?.outline?.material.color.set(scheme.grid);
    }
  }

  update(moment: Moment): void {
    const { from, to, fraction } = moment;
    if (to.layout !== this.layout) this.build(to.layout);
    this.bodies.forEach((body, i) => {
      body.update(from.positions[i]!, to.positions[i]!, fraction, to.timeS - from.timeS);
    });
    this.solids.forEach((solid, i) => solid?.update(from.poses[i]!, to.poses[i]!, fraction));
  }

  get hasGround(): boolean {
    return this.solids.some((solid) => solid && (solid.isRoom || !solid.isBounded));
  }

  /** Around what there is to see. */
  box(): Box3 {
    const box = new Box3();
    for (const { skin } of this.bodies) {
      skin.geometry.computeBoundingBox();
      box.union(skin.geometry.boundingBox!);
    }
    for (const solid of this.solids) if (solid?.isRoom) box.expandByObject(solid.mesh);
    // A rigid body may have flown off; where there is nothing else, it is what there is to see.
    if (box.isEmpty()) for (const solid of this.solids) if (solid?.isBounded) box.expandByObject(solid.mesh);
    if (box.isEmpty()) box.set(new Vector3(-1, -1, -1), new Vector3(1, 1, 1));
    return box;
  }

  /** Lets go of all that is in it; the next moment may be another world's. */
  clear(): void {
    this.group.clear();
    for (const part of [...this.bodies, ...this.solids]) part?.dispose();
    this.bodies = [];
    this.solids = [];
    this.layout = undefined;
  }

  private build(layout: Layout): void {
    this.clear();
    this.layout = layout;
    this.bodies = layout.softBodies.map(
      ({ name, mesh }, i) => new SoftBodyView(name, mesh, new Color(...bodyColour(i))),
    );
    this.solids = layout.solids.map((solid) => SolidView.of(solid));
    for (const body of this.bodies) this.group.add(body.group);
    for (const solid of this.solids) if (solid) this.group.add(solid.mesh);
    this.show(this.shown);
  }
}
