// The bounding volumes of a body (Matyka and Ollila, Fig. 5), as the server fits them to its vertices.
import {
  BoxGeometry,
  type BufferGeometry,
  EdgesGeometry,
  LineBasicMaterial,
  LineSegments,
  SphereGeometry,
  WireframeGeometry,
} from "three";

export type Bounds = "none" | "box" | "ball" | "ellipsoid";

export interface Fit {
  readonly centre: readonly [number, number, number];
  /** Half of what it measures along x, y and z, in m. */
  readonly half: readonly [number, number, number];
}

/**
 * Box: along the axes. Ellipsoid: inscribed in that box. Ball: about the mean of the points, to the furthest.
 * @param points x y z of each vertex
 */
export function fit(bounds: Exclude<Bounds, "none">, points: Float32Array): Fit {
  const low: [number, number, number] = [Infinity, Infinity, Infinity];
  const high: [number, number, number] = [-Infinity, -Infinity, -Infinity];
  const mean: [number, number, number] = [0, 0, 0];
  for (let i = 0; i < points.length; ++i) {
    const axis = i % 3;
    low[axis] = Math.min(low[axis]!, points[i]!);
    high[axis] = Math.max(high[axis]!, points[i]!);
    mean[axis]! += (3 * points[i]!) / points.length;
  }
  if (bounds === "ball") {
    let radius = 0;
    for (let i = 0; i < points.length; i += 3) {
      radius = Math.max(radius, Math.hypot(points[i]! - mean[0], points[i + 1]! - mean[1], points[i + 2]! - mean[2]));
    }
    return { centre: mean, half: [radius, radius, radius] };
  }
  const middle = (axis: 0 | 1 | 2) => (low[axis] + high[axis]) / 2;
  const half = (axis: 0 | 1 | 2) => (high[axis] - low[axis]) / 2;
  return { centre: [middle(0), middle(1), middle(2)], half: [half(0), half(1), half(2)] };
}

export class BoundsView {
  readonly lines = new LineSegments<BufferGeometry, LineBasicMaterial>(
    undefined,
    new LineBasicMaterial({ transparent: true, opacity: 0.4, depthTest: false }),
  );
  private bounds: Bounds = "none";

  constructor() {
    this.lines.visible = false;
    this.lines.frustumCulled = false;
  }

  show(bounds: Bounds, ink: number): void {
    this.lines.visible = bounds !== "none";
    this.lines.material.color.set(ink);
    if (bounds === this.bounds) return;
    this.bounds = bounds;
    this.lines.geometry.dispose();
    this.lines.geometry =
      bounds === "box"
        ? new EdgesGeometry(new BoxGeometry(2, 2, 2))
        : new WireframeGeometry(new SphereGeometry(1, 16, 8));
  }

  update(points: Float32Array): void {
    if (this.bounds === "none") return;
    const { centre, half } = fit(this.bounds, points);
    this.lines.position.set(...centre);
    this.lines.scale.set(...half);
  }

  dispose(): void {
    this.lines.geometry.dispose();
    this.lines.material.dispose();
  }
}
