// The sheets at the bottom of the page, of which one is open at most, and the buttons that open them.
import { element } from "./element.js";

export class Dock {
  private readonly buttons = [...element("dock").querySelectorAll<HTMLButtonElement>("button[aria-controls]")];
  private readonly listeners = new Map<string, (isOpen: boolean) => void>();

  constructor() {
    for (const button of this.buttons) {
      button.addEventListener("click", () => {
        const isOpen = button.getAttribute("aria-expanded") === "true";
        this.open(isOpen ? "" : button.getAttribute("aria-controls")!);
      });
    }
  }

  /** Has `changed` called when this sheet opens, and when it closes. */
  on(sheet: string, changed: (isOpen: boolean) => void): void {
    this.listeners.set(sheet, changed);
  }

  /** Opens a sheet in the place of the one that is open; "": none. */
  open(sheet: string): void {
    for (const button of this.buttons) {
      const id = button.getAttribute("aria-controls")!;
      const wasOpen = button.getAttribute("aria-expanded") === "true";
      button.setAttribute("aria-expanded", String(id === sheet));
      element(id).hidden = id !== sheet;
      if (wasOpen !== (id === sheet)) this.listeners.get(id)?.(id === sheet);
    }
  }
}
