// Light or dark: as the system has it, until it is chosen here; the choice is remembered.
import { recall, remember } from "./storage.js";

const key = "pneuma-theme";

/** Sets the box, whose `change` tells each change, also the system's. */
export function beginTheme(isDark: HTMLInputElement): void {
  const system = matchMedia("(prefers-color-scheme: dark)");
  let chosen = recall("localStorage", key);
  isDark.checked = chosen === null ? system.matches : chosen === "dark";
  isDark.addEventListener("click", () => {
    chosen = isDark.checked ? "dark" : "light";
    remember("localStorage", key, chosen);
  });
  system.addEventListener("change", () => {
    if (chosen !== null) return;
    isDark.checked = system.matches;
    isDark.dispatchEvent(new Event("change"));
  });
}
