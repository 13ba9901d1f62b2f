// The line that says what was done last, or why it was refused.
import type { PneumaError } from "../src/index.js";
import { element } from "./element.js";

const line = element<HTMLOutputElement>("effect");

export function say(text: string): void {
  line.value = text;
  line.classList.remove("refused");
}

export function refuse(error: PneumaError): void {
  line.value = error.message;
  line.classList.add("refused");
}
