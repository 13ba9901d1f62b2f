// JSON as somebody wrote it: what stands where in the text. JSON.parse tells no places.

/** From the whole value to a part: names of fields, and places in lists. */
export type Path = readonly (string | number)[];

/** From one character of the text to before another. */
export interface Span {
  readonly start: number;
  readonly end: number;
}

export interface Member extends Span {
  readonly key: string;
  readonly value: JsonNode;
}

export type JsonNode = Span &
  (
    | { readonly kind: "object"; readonly members: readonly Member[] }
    | { readonly kind: "list"; readonly items: readonly JsonNode[] }
    | { readonly kind: "plain"; readonly value: string | number | boolean | null }
  );

export class JsonError extends Error {
  constructor(
    what: string,
    readonly at: Span,
  ) {
    super(what);
  }
}

// A scene is nested nine deep; a text that is not one must not take the whole stack.
const depthMax = 100;

const space = /[ \t\n\r]*/y;
const string = /"(?:[^"\\\u0000-\u001f]|\\(?:["\\/bfnrt]|u[0-9a-fA-F]{4}))*"/y;
const number = /-?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][+-]?\d+)?/y;
const word = /true|false|null/y;

class Parser {
  private at = 0;
  private depth = 0;

  constructor(private readonly text: string) {}

  whole(): JsonNode {
    const root = this.value();
    this.skip();
    if (this.at < this.text.length) throw this.error("the scene ends before this");
    return root;
  }

  private value(): JsonNode {
    this.skip();
    if (++this.depth > depthMax) throw this.error(`nested more than ${depthMax} deep`);
    const start = this.at;
    const node = this.take("{") ? this.object(start) : this.take("[") ? this.list(start) : this.plain(start);
    --this.depth;
    return node;
  }

  private object(start: number): JsonNode {
    const members: Member[] = [];
    if (!this.takeNext("}")) {
      do members.push(this.member());
      while (this.goesOn("}"));
    }
    return { kind: "object", members, start, end: this.at };
  }

  private member(): Member {
    this.skip();
    const start = this.at;
    const key = this.match(string);
    if (key === undefined) throw this.error(this.text[start] === '"' ? openString : "a name in quotes is missing here");
    if (!this.takeNext(":")) throw this.error("a colon is missing here");
    const value = this.value();
    return { key: JSON.parse(key) as string, value, start, end: this.at };
  }

  private list(start: number): JsonNode {
    const items: JsonNode[] = [];
    if (!this.takeNext("]")) {
      do items.push(this.value());
      while (this.goesOn("]"));
    }
    return { kind: "list", items, start, end: this.at };
  }

  private plain(start: number): JsonNode {
    const found = this.match(string) ?? this.match(number) ?? this.match(word);
    if (found === undefined) throw this.error(this.text[start] === '"' ? openString : "a value is missing here");
    return { kind: "plain", value: JSON.parse(found) as string | number | boolean | null, start, end: this.at };
  }

  /** Whether another one follows; false: it was the last. */
  private goesOn(end: "}" | "]"): boolean {
    if (this.takeNext(",")) return true;
    if (this.takeNext(end)) return false;
    throw this.error(`a comma or ${end} is missing before this`);
  }

  private takeNext(mark: string): boolean {
    this.skip();
    return this.take(mark);
  }

  private take(mark: string): boolean {
    if (this.text[this.at] !== mark) return false;
    ++this.at;
    return true;
  }

  private skip(): void {
    this.match(space);
  }

  private match(pattern: RegExp): string | undefined {
    pattern.lastIndex = this.at;
    const found = pattern.exec(this.text)?.[0];
    this.at += found?.length ?? 0;
    return found;
  }

  private error(what: string): JsonError {
    const isAtEnd = this.at >= this.text.length;
    return new JsonError(isAtEnd ? `the text ends too early: ${what}` : what, { start: this.at, end: this.at + 1 });
  }
}

const openString = "this string has no closing quote on its line, or holds a character that JSON escapes";

/** Takes what JSON.parse takes, as deep as that is allowed; throws JsonError. */
export function parseJson(text: string): JsonNode {
  return new Parser(text).whole();
}

/** "soft_bodies[0].gas.moles" as a path; of a stretch of a list, "indices[9..11]", its first. */
export function pathOf(text: string): Path {
  const parts = text.matchAll(/\[(\d+)[^\]]*\]|[^.[\]]+/g);
  return [...parts].map(([name, index]) => (index === undefined ? name : Number(index)));
}

function camelCase(name: string): string {
  return name.replace(/_([a-z\d])/g, (_, letter: string) => letter.toUpperCase());
}

/** A step along the path: a field under either spelling, with its name, or an item of a list. */
function step(node: JsonNode, part: string | number): Member | JsonNode | undefined {
  if (node.kind === "list") return node.items[Number(part)];
  if (node.kind !== "object") return undefined;
  const { members } = node;
  return members.find(({ key }) => key === part) ?? members.find(({ key }) => key === camelCase(String(part)));
}

/** Where what the path leads to is, or as much of the path as there is: a field with its name. */
export function spanOf(root: JsonNode, path: Path): Span {
  let found: Member | JsonNode = root;
  for (const part of path) {
    const next: Member | JsonNode | undefined = step("key" in found ? found.value : found, part);
    if (!next) break;
    found = next;
  }
  const { start, end } = found;
  return { start, end };
}

/** Both from 1; characters as JavaScript counts them. */
export interface Place {
  readonly line: number;
  readonly column: number;
}

export function placeOf(text: string, offset: number): Place {
  const before = text.slice(0, offset);
  return { line: before.split("\n").length, column: offset - before.lastIndexOf("\n") };
}
