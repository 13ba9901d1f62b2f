// What stands in the way of a picture, in the middle of the page.
import { element } from "./element.js";

const notice = element("notice");

/** "": nothing. */
export function tellNotice(text: string): void {
  notice.textContent = text;
  notice.hidden = text === "";
}
