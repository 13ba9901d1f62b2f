// What an edit changes, in words: "gas of ball, gravity".
import { type DescMessage, isFieldSet, type Message } from "@bufbuild/protobuf";
import { ColliderChangeSchema, RigidBodyChangeSchema, SoftBodyChangeSchema } from "../proto/pneuma/v1/scene_pb.js";
import type { SceneChange } from "../src/index.js";
import { counted, withoutUnit } from "./words.js";

// Of more bodies their number is told.
const namedMax = 2;

// As the page's controls call them.
const ownWords: Readonly<Record<string, string>> = {
  moles: "gas",
  remove_gas: "gas",
  flow_mol_s: "pump",
};

// Parts whose fields are told in their place.
const parts: ReadonlySet<string> = new Set(["gas", "springs"]);

/** Which of its fields a message sets, in words. */
function fieldWords(type: DescMessage, message: Message): string[] {
  const set = type.fields.filter((field) => field.name !== "name" && isFieldSet(message, field));
  return set.flatMap(({ name, localName, message: part }) => {
    const value = (message as unknown as Record<string, Message>)[localName]!;
    if (part && parts.has(name)) return fieldWords(part, value);
    return [ownWords[name] ?? withoutUnit(name).replaceAll("_", " ")];
  });
}

/** What is told, and of which bodies; "": of none. */
type Told = readonly [what: string, of: string];

function told({ change }: SceneChange): Told[] {
  const of = (type: DescMessage, message: Message & { readonly name: string }) =>
    fieldWords(type, message).map((what): Told => [what, message.name]);
  switch (change.case) {
    case "addSoftBody":
    case "addRigidBody":
    case "addCollider":
    case "addJoint":
      return [[`${change.value.name} added`, ""]];
    case "removeSoftBody":
    case "removeRigidBody":
    case "removeCollider":
    case "removeJoint":
      return [[`${change.value} removed`, ""]];
    case "changeSoftBody":
      return of(SoftBodyChangeSchema, change.value);
    case "changeRigidBody":
      return of(RigidBodyChangeSchema, change.value);
    case "changeCollider":
      return of(ColliderChangeSchema, change.value);
    case "setGravity":
      return [["gravity", ""]];
    case "setAtmosphere":
      return [["air", ""]];
    case "setWind":
      return [["wind", ""]];
    case "setStepping":
      return [["time steps", ""]];
    default:
      return []; // a mesh comes and goes with its body
  }
}

/** "": nothing that is seen. */
export function changeWords(changes: readonly SceneChange[]): string {
  const bodies = new Map<string, string[]>();
  for (const [what, of] of changes.flatMap(told)) {
    const named = bodies.get(what) ?? [];
    if (of !== "" && !named.includes(of)) named.push(of);
    bodies.set(what, named);
  }
  const texts = [...bodies].map(([what, named]) => {
    if (named.length === 0) return what;
    return `${what} of ${named.length > namedMax ? counted(named.length, "body", "bodies") : named.join(" and ")}`;
  });
  return texts.join(", ");
}
