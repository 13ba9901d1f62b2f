// The controls that choose what the picture shows, beside those of the panel.
import type { SubscribeOptions } from "../src/index.js";
import type { Bounds } from "./bounds_view.js";
import { element } from "./element.js";
import type { Field } from "./legend.js";
import type { Shown } from "./world_view.js";

/** Of the streams of what is looked at, and recorded: less than a pixel, where a body fills the picture. */
export const maxErrorM = 0.0005;

const marks = ["wireframe", "points", "velocities", "contacts", "dark"] as const;

function isOn(id: string): boolean {
  return element<HTMLInputElement>(id).checked;
}

export function shownNow(): Shown {
  return {
    wireframe: isOn("wireframe"),
    points: isOn("points"),
    velocities: isOn("velocities"),
    contacts: isOn("contacts"),
    bounds: element<HTMLSelectElement>("bounds").value as Bounds,
    field: document.querySelector<HTMLInputElement>("input[name=field]:checked")!.value as Field,
    dark: isOn("dark"),
  };
}

/** Calls `changed` with each choice. */
export function listenToLooks(changed: () => void): void {
  const fields = document.querySelectorAll("input[name=field]");
  for (const control of [...marks.map((id) => element(id)), element("bounds"), ...fields]) {
    control.addEventListener("change", changed);
  }
}

/** What a stream must bring along for what is shown. */
export function neededFor({ velocities, contacts }: Shown): SubscribeOptions {
  return { velocities, contacts, scalars: true };
}
