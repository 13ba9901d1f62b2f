// What the server tells of a world unasked, in words.
import { type Applied, type Event, Event_Kind } from "../src/index.js";
import { changeWords } from "./change_words.js";

/** "": nothing that has to be said. */
export function happeningText({ kind, body, joint, detail }: Event): string {
  if (kind === Event_Kind.BODY_BURST) return `${body} has burst: ${detail}`;
  if (kind === Event_Kind.BODY_INVERTED) return `${body} is turned inside out: ${detail}`;
  if (kind === Event_Kind.BODY_FROZEN) return `${body} is frozen: ${detail}`;
  if (kind === Event_Kind.JOINT_BROKEN) return `${joint} has broken: ${detail}`;
  if (kind === Event_Kind.WORLD_RESET) return "The world began again";
  return "";
}

/** What was done. A hand is told of once, when it takes hold: it moves many times a second. */
function whatText({ command }: Pick<Applied, "command">): string {
  const request = command?.request;
  if (request?.case === "impulse") return `${request.value.body || "a body"} was hit`;
  if (request?.case === "grab") return `${request.value.body || "a body"} was taken hold of`;
  if (request?.case === "pause") return "paused";
  if (request?.case === "resume") {
    const { timeScale } = request.value;
    return timeScale === undefined ? "time goes on" : `time goes at ${timeScale} ×`;
  }
  if (request?.case !== "edit") return "";
  const { source } = request.value;
  return source.case === "edit" ? changeWords(source.value.changes) : "the scene";
}

/** What was done to a world, and who did it: `own` is this page's session. "": nothing that has to be told. */
export function deedText(applied: Pick<Applied, "command" | "sessionId">, own?: bigint): string {
  const what = whatText(applied);
  const { sessionId } = applied;
  if (what === "" || sessionId === 0n) return what;
  return `${what}, by ${sessionId === own ? "you" : `visitor ${sessionId}`}`;
}

// What takes somebody by surprise who looks on. What hands do is seen.
const surprising: ReadonlySet<string | undefined> = new Set(["edit", "pause", "resume"]);

/** What others did that is said aloud; "": nothing. */
export function surpriseText(applied: Applied, own: bigint): string {
  const { command, sessionId } = applied;
  if (sessionId === 0n || sessionId === own || !surprising.has(command?.request.case)) return "";
  return `Visitor ${sessionId}: ${whatText(applied)}`;
}

const repeatMs = 5000;

/** Keeps what is done many times a second, as by a slider, from being said each time. */
export class Surprises {
  private text = "";
  private lastMs = -Infinity;

  /** Whether it was not done within the last seconds. */
  isNew(text: string, nowMs: number): boolean {
    const isNew = text !== this.text || nowMs - this.lastMs > repeatMs;
    this.text = text;
    this.lastMs = nowMs;
    return isNew;
  }
}
