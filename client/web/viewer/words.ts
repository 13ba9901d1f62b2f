// What went wrong, in the page's words: an error's path is of the wire's messages, which a reader has never seen.
import { ClientMessageSchema } from "../proto/pneuma/v1/session_pb.js";
import type { PneumaError } from "../src/index.js";

const requests = new Set(ClientMessageSchema.fields.map(({ name }) => name));

// Of a scene that somebody wrote, the path is one of their own file.
const ownFile = /^create_world\.scene_json\./;
const unit = /_(n_m|n_s_m|n_m_rad|kg|kg_m3|m|m_s|k|pa|mol_s|mol_s_pa|hz|s|n|m_n)$/;
// "is -1; must be greater than 0", "1 are too few": what, the path alone says.
const withoutSubject = /^(is|are|may|must|has|holds|\d+)\b/;

/** "mass" of "mass_kg". */
export function withoutUnit(field: string): string {
  return field.replace(unit, "");
}

/** The last field of a path: "mass" of "edit.changes[0].change_soft_body.mass_kg". */
function fieldOf(path: string): string {
  const fields = path.split(".").map((part) => part.replace(/\[\d+\]$/, ""));
  const last = fields.at(-1)!;
  const isAxis = last.length === 1 && fields.length > 1;
  const words = withoutUnit(isAxis ? fields.at(-2)! : last).replaceAll("_", " ");
  return isAxis ? `${words} ${last}` : words;
}

/** "1 face", "12,000 faces". */
export function counted(number: number, one: string, many: string): string {
  return `${number.toLocaleString("en")} ${number === 1 ? one : many}`;
}

export function sentence(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

export function inWords({ what, where }: Pick<PneumaError, "what" | "where">): string {
  if (where === "") return sentence(what);
  if (ownFile.test(where)) return `${where.replace(ownFile, "")}: ${what}`;
  if (requests.has(where.split(".")[0]!))
    return sentence(withoutSubject.test(what) ? `${fieldOf(where)}: ${what}` : what);
  return what.startsWith(where) ? what : `${where}: ${what}`; // a file's name
}
