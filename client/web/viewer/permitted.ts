// What the token allows on this server. The controls of what it does not allow are absent; the server would refuse it.
import { Welcome_Role } from "../src/index.js";

const marks = [
  [Welcome_Role.EDIT, "may-edit"],
  [Welcome_Role.ADMIN, "may-admin"],
] as const;

/** Of a server that tells no role everything is tried. */
export function permit(role: Welcome_Role): void {
  const least = role === Welcome_Role.ROLE_UNSPECIFIED ? Welcome_Role.ADMIN : role;
  for (const [needed, mark] of marks) document.body.classList.toggle(mark, least >= needed);
}

export function mayEdit(): boolean {
  return document.body.classList.contains("may-edit");
}

/**
 * Turns off the controls that have nobody to ask: without a connection all that change or ask for something, without a
 * world those that are about it.
 */
export function turnOffWithout({ isConnected, hasWorld }: { isConnected: boolean; hasWorld: boolean }): void {
  const isOff = (control: HTMLElement) => !isConnected || (!hasWorld && control.dataset["needs"] !== "admin");
  for (const control of document.querySelectorAll<HTMLElement>("[data-needs], [data-live]"))
    control.inert = isOff(control);
}

/** Whether the control is there for this token, and has somebody to ask. */
export function isPermitted(control: Element): boolean {
  if (control.closest("[inert]")) return false;
  const needs = control.closest<HTMLElement>("[data-needs]")?.dataset["needs"];
  return needs === undefined || document.body.classList.contains(`may-${needs}`);
}
