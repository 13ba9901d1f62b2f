// Light or dark: as the system has it, until it is chosen here; the choice is remembered.
const key = "pneuma-theme";

/** Sets the box, whose `change` tells each change, also the system's. */
export function beginTheme(isDark: HTMLInputElement): void {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const chosen = () => localStorage.getItem(key);
  isDark.checked = chosen() === null ? system.matches : chosen() === "dark";
  isDark.addEventListener("click", () => localStorage.setItem(key, isDark.checked ? "dark" : "light"));
  system.addEventListener("change", () => {
    if (chosen() !== null) return;
    isDark.checked = system.matches;
    isDark.dispatchEvent(new Event("change"));
  });
}
