// Keys, and the controls that they press.
import { element } from "./element.js";
import { isPermitted } from "./permitted.js";
import { sentence } from "./words.js";

const keys: Record<string, string> = {
  "?": "show-keys",
  " ": "pause",
  ".": "step",
  r: "reset",
  "[": "back",
  "]": "ahead",
  b: "now",
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
  m: "film",
  delete: "remove",
  g: "show-gallery",
  i: "show-view",
  p: "show-plots",
  s: "show-plan",
  e: "show-scene",
};

const repeated = new Set(["step", "back", "ahead"]); // while their key is held down

function controlOf({ key, target, ctrlKey, metaKey, shiftKey, altKey }: KeyboardEvent): string | undefined {
  // What fills in a field sends events without a key.
  if (!key || altKey || document.querySelector("dialog[open]")) return undefined;
  const isOn = (controls: string) => target instanceof HTMLElement && target.matches(controls);
  const isText = isOn("#token, textarea, input[type=text], input[type=number]");
  const letter = key.toLowerCase();
  if (ctrlKey || metaKey) return letter === "z" && !isText ? (shiftKey ? "redo" : "undo") : undefined;
  const isTaken = isText || isOn("select") || (key === " " && isOn("button, summary, input"));
  return isTaken ? undefined : keys[letter];
}

// What those of the picture and of the page's own do; the others press a control, and are told with its name.
const others: readonly (readonly [key: string, what: string, control?: string])[] = [
  ["Ctrl+Z", "Undo", "undo"],
  ["Ctrl+Shift+Z", "Redo", "redo"],
  ["Arrow keys", "Turn the view; with Shift, move it"],
  ["+ and −", "Nearer, away"],
  ["Ctrl+Enter", "Apply the scene's text", "scene-apply"],
  ["Enter", "Take hold of what is selected", "tool-pull"],
];

function nameOf(control: HTMLElement): string {
  const named = control instanceof HTMLInputElement ? control.parentElement! : control;
  return sentence(control.getAttribute("aria-label") ?? named.textContent!.trim());
}

/** Lists the keys of the controls that are there. */
function showKeys(): void {
  const pressed = Object.entries(keys).filter(([, id]) => isPermitted(element(id)));
  const possible = others.filter(([, , control]) => !control || isPermitted(element(control)));
  const rows = [
    ...pressed.map(([key, id]) => [key === " " ? "Space" : key, nameOf(element(id))] as const),
    ...possible,
  ];
  element("key-list").replaceChildren(
    ...rows.flatMap(([key, what]) => [
      Object.assign(document.createElement("dt"), { textContent: sentence(key) }),
      Object.assign(document.createElement("dd"), { textContent: what }),
    ]),
  );
  element<HTMLDialogElement>("keys").showModal();
}

export function listenToKeys(): void {
  element("show-keys").addEventListener("click", showKeys);
  element("keys-close").addEventListener("click", () => element<HTMLDialogElement>("keys").close());
  addEventListener("keydown", (event) => {
    const id = controlOf(event);
    if (!id || (event.repeat && !repeated.has(id))) return;
    event.preventDefault();
    if (isPermitted(element(id))) element(id).click();
  });
}
