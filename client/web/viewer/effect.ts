// The messages that say what was done, or why it was refused: below each other, the newest last, each gone after a while.
import type { PneumaError } from "../src/index.js";
import { element } from "./element.js";
import { inWords } from "./words.js";

// More would reach down into the picture.
const messagesMax = 3;
// To notice it, and to read it: about 200 words a minute.
const noticeMs = 3000;
const letterMs = 60;
// Why something was refused is read twice.
const refusalFactor = 2;

const place = element("effect");

interface Message {
  readonly topic: string;
  readonly line: HTMLElement;
  readonly lasts: boolean;
}

let messages: Message[] = [];

function remove(gone: (message: Message) => boolean): void {
  for (const message of messages) if (gone(message)) message.line.remove();
  messages = messages.filter((message) => !gone(message));
}

function put(text: string, topic: string, isRefusal: boolean, lasts: boolean): void {
  if (topic !== "") unsay(topic);
  const line = document.createElement("p");
  line.textContent = text;
  line.classList.toggle("refused", isRefusal);
  const message = { topic, line, lasts };
  messages.push(message);
  place.append(line);
  const passing = messages.filter((each) => !each.lasts);
  remove((each) => passing.slice(0, -messagesMax).includes(each));
  if (lasts) return;
  const shownMs = (noticeMs + letterMs * text.length) * (isRefusal ? refusalFactor : 1);
  setTimeout(() => remove((each) => each === message), shownMs);
}

/** Says it for a while. Of a topic only what was said last is shown. */
export function say(text: string, topic = ""): void {
  put(text, topic, false, false);
}

/** Says it until it is taken back. */
export function hold(text: string, topic: string): void {
  put(text, topic, false, true);
}

export function refuse(error: PneumaError, topic = ""): void {
  // What was under way when the connection was lost is not told of one by one: the page says that it is lost.
  if (error.code === "UNAVAILABLE" && document.body.classList.contains("lost")) return;
  put(inWords(error), topic, true, false);
}

/** Takes back what was said of a topic; "": all that was said. */
export function unsay(topic: string): void {
  remove((message) => topic === "" || message.topic === topic);
}
