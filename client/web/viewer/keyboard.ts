// Keys, and the controls that they press.
import { element } from "./element.js";
import { isPermitted } from "./permitted.js";

const keys: Record<string, string> = {
  " ": "pause",
  ".": "step",
  r: "reset",
  w: "wireframe",
  v: "velocities",
  l: "dark",
  f: "frame-all",
  1: "tool-pull",
  2: "tool-poke",
  3: "tool-throw",
  t: "throw",
  a: "add",
  u: "upload-open",
  n: "new-world-open",
  c: "record",
  delete: "remove",
  g: "show-gallery",
  i: "show-view",
  p: "show-plots",
  s: "show-plan",
};

function controlOf({ key, target, ctrlKey, metaKey, shiftKey, altKey }: KeyboardEvent): string | undefined {
  // What fills in a field sends events without a key.
  if (!key || altKey || document.querySelector("dialog[open]")) return undefined;
  const isOn = (controls: string) => target instanceof HTMLElement && target.matches(controls);
  const isText = isOn("#token, input[type=text], input[type=number]");
  const letter = key.toLowerCase();
  if (ctrlKey || metaKey) return letter === "z" && !isText ? (shiftKey ? "redo" : "undo") : undefined;
  const isTaken = isText || isOn("select") || (key === " " && isOn("button, summary, input"));
  return isTaken ? undefined : keys[letter];
}

export function listenToKeys(): void {
  addEventListener("keydown", (event) => {
    const id = controlOf(event);
    if (!id || (event.repeat && id !== "step")) return;
    event.preventDefault();
    if (isPermitted(element(id))) element(id).click();
  });
}
