// What the address says: `#world=five-balls&camera=1.2,0.8,3.1,0,0,0`.
import { Vector3 } from "three";

export interface View {
  readonly position: Vector3;
  /** What the camera looks at, and turns about. */
  readonly target: Vector3;
}

function fields(): URLSearchParams {
  return new URLSearchParams(location.hash.slice(1));
}

export function wantedWorld(): string | null {
  return fields().get("world") || null;
}

export function wantedView(): View | undefined {
  const numbers = (fields().get("camera") ?? "").split(",").map(Number);
  if (numbers.length !== 6 || !numbers.every(Number.isFinite)) return undefined;
  return { position: new Vector3().fromArray(numbers, 0), target: new Vector3().fromArray(numbers, 3) };
}

/** Without leaving a step in the browser's history: a camera is turned often. */
export function noteView(world: string, { position, target }: View): void {
  if (world === "") return; // none is shown
  const camera = [...position.toArray(), ...target.toArray()].map((length) => Number(length.toPrecision(4)));
  const next = new URLSearchParams({ world }).toString();
  history.replaceState(null, "", `#${next}&camera=${camera.join(",")}`);
}
