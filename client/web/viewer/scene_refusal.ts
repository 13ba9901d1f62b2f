// What the server says of an edit or of a new world, in the page's words, and where the scene's text has what it is about.
import { type PneumaError, SceneSchema } from "../src/index.js";
import { type Path, pathOf } from "./json_text.js";
import type { Placed } from "./scene_difference.js";
import { inWords } from "./words.js";

export interface Refusal {
  /** From the scene on; empty: the refusal is about nothing in it. */
  readonly at: Path;
  readonly what: string;
}

type Said = Pick<PneumaError, "what" | "where">;

const fields = SceneSchema.fields.map(({ name }) => name);
const ofScene = new RegExp(`^((?:${fields.join("|")})\\b[\\w.[\\]]*): (.*)$`, "s");

// What a change of a soft body calls otherwise than the body does.
const renamed: readonly (readonly [RegExp, string])[] = [
  [/^pins\.vertices/, "pins"],
  [/^pins\.boundary/, "pin_boundary"],
  [/^vertex_mass_scale\.scale/, "vertex_mass_scale"],
  [/^remove_gas/, "gas"],
];

function pathInScene(where: string): Path {
  const path = pathOf(where);
  return fields.includes(String(path[0])) ? path : [];
}

/** Of an edit that cannot be because of something that it does not change, `what` begins with the path of that. */
function withPath({ what, where }: Said): Said {
  const [, path, rest] = where === "edit.edit" ? (ofScene.exec(what) ?? []) : [];
  return path === undefined || rest === undefined ? { what, where } : { where: `${where}.${path}`, what: rest };
}

/** @param changes those of the edit */
export function refusalOfEdit(changes: readonly Placed[], error: Said): Refusal {
  const said = withPath(error);
  const what = inWords(said);
  const [, index, kind = "", rest = ""] = /^edit\.edit\.changes\[(\d+)\]\.?(\w*)\.?(.*)$/.exec(said.where) ?? [];
  const placed = index === undefined ? undefined : changes[Number(index)];
  if (!placed) {
    // The scene of the server has its lists in another order.
    const path = pathInScene(said.where.replace("edit.edit.", ""));
    const item = path.findIndex((part) => typeof part === "number");
    return { at: item < 0 ? path : path.slice(0, item), what };
  }
  const { change } = placed.change;
  if (kind.startsWith("remove_")) return { at: placed.at, what: `"${String(change?.value)}": ${what}` };
  const isBody = kind === "change_soft_body";
  const name = renamed.reduce((path, [from, to]) => (isBody ? path.replace(from, to) : path), rest);
  return { at: [...placed.at, ...pathOf(name)], what };
}

export function refusalOfWorld(error: Said): Refusal {
  return { at: pathInScene(error.where.replace(/^create_world\.(scene\.)?/, "")), what: inWords(error) };
}
