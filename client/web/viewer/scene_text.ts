// A scene as text that people read and write: JSON as in server/scenes, with each thing on lines of its own.
import {
  create,
  type DescEnum,
  type DescField,
  type DescMessage,
  type JsonValue,
  ScalarType,
  toJson,
} from "@bufbuild/protobuf";
import { type Scene, SceneSchema } from "../src/index.js";
import { JsonError, type JsonNode, type Member, parseJson, type Path, type Span, spanOf } from "./json_text.js";
import { nearest } from "./nearest.js";
import { withoutUnit } from "./words.js";

type Json = JsonValue;
type Fields = Record<string, unknown>;

/** What fits is on one line. */
const widthMax = 88;
// A list of more numbers or vertices is written as one string that stands for it: nobody reads them, and a text area gets
// slow from long lines.
const entriesMax = 64;
// More would push the text off the screen.
const problemsMax = 20;

/** Something wrong in the text, for people. */
export interface Problem {
  readonly at: Span;
  readonly what: string;
}

export interface Written {
  readonly text: string;
  /** The lists that strings of the text stand for. */
  readonly kept: readonly Json[];
}

const keptName = /^… (\d+) entries, kept as list (\d+)$/;

function isObject(value: Json | undefined): value is Readonly<Record<string, Json>> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

class Writer {
  readonly kept: Json[] = [];

  lines(value: Json, indent = ""): string {
    const line = this.line(value);
    const isList = Array.isArray(value);
    const isNumbers = isList && !value.some(isObject);
    if (typeof value !== "object" || value === null || isNumbers) return line;
    if (indent !== "" && indent.length + line.length <= widthMax) return line;
    const inner = `${indent}  `;
    const parts = isList
      ? value.map((item) => inner + this.lines(item, inner))
      : Object.entries(value).map(([key, part]) => `${inner}${JSON.stringify(key)}: ${this.lines(part, inner)}`);
    if (parts.length === 0) return isList ? "[]" : "{}";
    const [begin, end] = isList ? "[]" : "{}";
    return `${begin}\n${parts.join(",\n")}\n${indent}${end}`;
  }

  /** The value with what is kept in the place of long lists. */
  short(value: Json): Json {
    if (Array.isArray(value)) {
      const isOfNames = value.some((item) => isObject(item) && "name" in item);
      if (value.length <= entriesMax || isOfNames) return value.map((item) => this.short(item));
      this.kept.push(value);
      return `… ${value.length} entries, kept as list ${this.kept.length}`;
    }
    if (!isObject(value)) return value;
    return Object.fromEntries(Object.entries(value).map(([key, part]) => [key, this.short(part)]));
  }

  private line(value: Json): string {
    if (Array.isArray(value)) return `[${value.map((item) => this.line(item)).join(", ")}]`;
    if (!isObject(value)) return JSON.stringify(value);
    const parts = Object.entries(value).map(([key, part]) => `${JSON.stringify(key)}: ${this.line(part)}`);
    return `{${parts.join(", ")}}`;
  }
}

export function sceneText(scene: Scene): Written {
  const writer = new Writer();
  const text = writer.lines(writer.short(jsonOf(scene)));
  return { text, kept: writer.kept };
}

/** With every list written out: a file for the command line. */
export function wholeSceneText(scene: Scene): string {
  return new Writer().lines(jsonOf(scene));
}

function jsonOf(scene: Scene): Json {
  return toJson(SceneSchema, scene, { useProtoFieldName: true });
}

function kindOf(node: JsonNode): string {
  if (node.kind !== "plain") return node.kind === "list" ? "a list" : "an object";
  if (node.value === null) return "null";
  return typeof node.value === "string" ? `"${node.value}"` : String(node.value);
}

/** Reads JSON as the fields of a message, and notes all that cannot be of it. */
class Reader {
  readonly problems: Problem[] = [];

  constructor(private readonly kept: readonly unknown[]) {}

  message(node: JsonNode, type: DescMessage): Fields {
    const out: Fields = {};
    if (node.kind !== "object") {
      this.wrong(node, `${kindOf(node)} stands here; an object is wanted`);
      return out;
    }
    const given: DescField[] = [];
    for (const member of node.members) {
      const field = this.fieldOf(member, type);
      if (!field) continue;
      const beside = given.find(({ oneof }) => field.oneof !== undefined && oneof === field.oneof);
      if (given.includes(field)) this.wrong(member, `${member.key} is given twice`);
      else if (beside) this.wrong(member, `${field.name} stands beside ${beside.name}; only one of them can be meant`);
      const { value: node } = member;
      if (node.kind === "plain" && node.value === null) continue; // as if it were left out
      given.push(field);
      const value = this.field(node, field);
      if (field.oneof) out[field.oneof.localName] = { case: field.localName, value };
      else out[field.localName] = value;
    }
    return out;
  }

  private fieldOf(member: Member, type: DescMessage): DescField | undefined {
    const field = type.fields.find(({ name, jsonName }) => name === member.key || jsonName === member.key);
    if (field) return field;
    const names = type.fields.map(({ name }) => name);
    const meant =
      nearest(member.key, names) ??
      names[names.map(withoutUnit).indexOf(nearest(member.key, names.map(withoutUnit)) ?? "")];
    const hint = meant === undefined ? `there may be ${names.join(", ")}` : `did you mean ${meant}?`;
    const { start, key } = member;
    this.wrong({ start, end: start + key.length + 2 }, `"${key}" is unknown here; ${hint}`);
    return undefined;
  }

  private field(node: JsonNode, field: DescField): unknown {
    if (field.fieldKind !== "list") return this.single(node, field);
    if (node.kind === "list") return node.items.map((item) => this.single(item, field));
    const found = node.kind === "plain" && typeof node.value === "string" ? keptName.exec(node.value) : null;
    if (!found) return this.wrong(node, `${kindOf(node)} stands here; a list is wanted`);
    const kept = this.kept[Number(found[2]) - 1];
    const isIt = Array.isArray(kept) && kept.length === Number(found[1]);
    return isIt ? kept : this.wrong(node, "this stands for a list of another text; write the list itself");
  }

  private single(node: JsonNode, field: DescField): unknown {
    if (field.message) return this.message(node, field.message);
    const value = node.kind === "plain" ? valueOf(node.value, field) : undefined;
    if (value !== undefined) return value;
    return this.wrong(node, `${kindOf(node)} stands here; ${wanted(field, node)} is wanted`);
  }

  private wrong(at: Span, what: string): undefined {
    const { start, end } = at;
    if (this.problems.length < problemsMax) this.problems.push({ at: { start, end }, what });
  }
}

function wanted(field: DescField, node: JsonNode): string {
  if (field.enum) return oneOf(field.enum, node);
  if (field.scalar === ScalarType.BOOL) return "true or false";
  if (field.scalar === ScalarType.STRING) return "a string";
  return field.scalar === ScalarType.UINT32 ? "a whole number from 0 to 4294967295" : "a number";
}

function oneOf({ values }: DescEnum, node: JsonNode): string {
  const names = values.filter(({ number }) => number !== 0).map(({ name }) => name);
  const meant = node.kind === "plain" && typeof node.value === "string" ? nearest(node.value, names) : undefined;
  return `one of ${names.join(", ")}${meant === undefined ? "" : ` (${meant}?)`}`;
}

/** As a message has it; undefined: the field cannot have it. Numbers may stand in quotes, as in protobuf's JSON. */
function valueOf(value: string | number | boolean | null, field: DescField): string | number | boolean | undefined {
  if (field.enum) return field.enum.values.find(({ name, number }) => name === value || number === value)?.number;
  if (field.scalar === ScalarType.BOOL) return typeof value === "boolean" ? value : undefined;
  if (field.scalar === ScalarType.STRING) return typeof value === "string" ? value : undefined;
  const isQuoted = typeof value === "string" && /^-?\d/.test(value);
  const number = typeof value === "number" || isQuoted ? Number(value) : NaN;
  const isWhole = Number.isInteger(number) && number >= 0 && number <= 0xffff_ffff;
  return Number.isFinite(number) && (field.scalar !== ScalarType.UINT32 || isWhole) ? number : undefined;
}

/** A text as it was read: the scene, or what is wrong. */
export type Reading =
  | { readonly scene: Scene; readonly at: (path: Path) => Span }
  | { readonly problems: readonly Problem[] };

/** @param kept what strings of the text may stand for, as `sceneText` gave it */
export function readScene(text: string, kept: readonly Json[]): Reading {
  try {
    const root = parseJson(text);
    const reader = new Reader(kept);
    const fields = reader.message(root, SceneSchema);
    if (reader.problems.length > 0) return { problems: reader.problems };
    return { scene: create(SceneSchema, fields), at: (path) => spanOf(root, path) };
  } catch (error) {
    if (error instanceof JsonError) return { problems: [{ at: error.at, what: error.message }] };
    throw error;
  }
}
