// The sheets at the bottom of the page, of which one is open at most, and the buttons that open them. Where the page is
// narrow the panel is one of them.
import { element } from "./element.js";

const narrow = "(max-width: 600px)"; // as in style.css

export class Dock {
  private readonly buttons = [...element("dock").querySelectorAll<HTMLButtonElement>("button[aria-controls]")];
  private readonly panel = element<HTMLDetailsElement>("panel");
  private readonly narrow = matchMedia(narrow);
  private readonly listeners = new Map<string, (isOpen: boolean) => void>();

  constructor() {
    for (const button of this.buttons) {
      button.addEventListener("click", () => {
        const isOpen = button.getAttribute("aria-expanded") === "true";
        this.open(isOpen ? "" : button.getAttribute("aria-controls")!);
      });
    }
    for (const button of element("dock").querySelectorAll("[data-closes]")) {
      button.addEventListener("click", () => this.open(""));
    }
    this.narrow.addEventListener("change", () => this.turn());
    this.turn();
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
      if (wasOpen === (id === sheet)) continue;
      if (id === "panel") this.panel.open = id === sheet;
      else element(id).hidden = id !== sheet;
      this.listeners.get(id)?.(id === sheet);
    }
  }

  /** The page got wide or narrow, as a phone that is turned. */
  private turn(): void {
    this.panel.open = !this.narrow.matches;
    document.querySelector('[aria-controls="panel"]')!.setAttribute("aria-expanded", "false");
  }
}
