// What the token allows on this server, and what a recording allows of that. The controls of what is not allowed are
// absent; the server would refuse it.
import { Welcome_Role } from "../src/index.js";

const marks = [
  [Welcome_Role.EDIT, "may-edit"],
  [Welcome_Role.ADMIN, "may-admin"],
] as const;

// By what a control needs (`data-needs`), the marks of the page that it takes. style.css has the same.
const needed: Readonly<Record<string, readonly string[]>> = {
  time: ["may-edit"],
  edit: ["may-edit", "is-live"],
  admin: ["may-admin", "is-live"],
  live: ["is-live"],
  recording: ["may-edit", "is-recording"],
  server: ["has-server"],
};

function has(mark: string): boolean {
  return document.body.classList.contains(mark);
}

/** Of a server that tells no role everything is tried. */
export function permit(role: Welcome_Role): void {
  const least = role === Welcome_Role.ROLE_UNSPECIFIED ? Welcome_Role.ADMIN : role;
  for (const [lowest, mark] of marks) document.body.classList.toggle(mark, least >= lowest);
}

/** A recording that is played has a time to go to, and cannot be changed. */
export function permitRecording(isRecording: boolean): void {
  document.body.classList.toggle("is-recording", isRecording);
  document.body.classList.toggle("is-live", !isRecording);
}

/** A page of one file has none. */
export function permitServer(hasServer: boolean): void {
  document.body.classList.toggle("has-server", hasServer);
}

export function mayEdit(): boolean {
  return needed["edit"]!.every(has);
}

/** Why the world that is shown cannot be changed here, for people; "": it can. */
export function whyNotEdit(): string {
  if (mayEdit()) return "";
  return has("is-live") ? "Your token may look at this world, not change it." : "A recording cannot be changed.";
}

/**
 * Turns off the controls that have nobody to ask: without a connection all that change or ask for something, without a
 * world those that are about it.
 */
export function turnOffWithout({ isConnected, hasWorld }: { isConnected: boolean; hasWorld: boolean }): void {
  const isOff = (control: HTMLElement) => !isConnected || (!hasWorld && control.dataset["needs"] !== "admin");
  for (const control of document.querySelectorAll<HTMLElement>(
    '[data-needs]:not([data-needs="live"], [data-needs="server"]), [data-live]',
  ))
    control.inert = isOff(control);
}

/** Whether the control is there for this token and this world, and has somebody to ask. */
export function isPermitted(control: Element): boolean {
  if (control.closest("[inert]")) return false;
  const needs = control.closest<HTMLElement>("[data-needs]")?.dataset["needs"];
  return needs === undefined || needed[needs]!.every(has);
}
