// What the server tells of a world unasked, in words.
import { type Event, Event_Kind } from "../src/index.js";

/** "": nothing that has to be said. */
export function happeningText({ kind, body, joint, detail }: Event): string {
  if (kind === Event_Kind.BODY_BURST) return `${body} has burst: ${detail}`;
  if (kind === Event_Kind.BODY_INVERTED) return `${body} is turned inside out: ${detail}`;
  if (kind === Event_Kind.BODY_FROZEN) return `${body} is frozen: ${detail}`;
  if (kind === Event_Kind.JOINT_BROKEN) return `${joint} has broken: ${detail}`;
  if (kind === Event_Kind.WORLD_RESET) return "The world began again";
  return "";
}
