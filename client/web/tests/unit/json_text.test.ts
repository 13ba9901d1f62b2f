// What is where in a text: shown of random JSON in random writings, against JSON.parse.
import assert from "node:assert/strict";
import { test } from "node:test";
import { JsonError, parseJson, type Path, pathOf, placeOf, spanOf } from "../../viewer/json_text.js";
import { Chance, randomValue, type Value, written } from "./random_json.js";

const texts = 500;

function pathsOf(value: Value, path: Path = []): Path[] {
  if (typeof value !== "object" || value === null) return [path];
  const parts = Array.isArray(value) ? value.entries() : Object.entries(value);
  return [path, ...[...parts].flatMap(([part, inner]) => pathsOf(inner, [...path, part]))];
}

function at(value: Value, path: Path): Value {
  return path.reduce((inner, part) => (inner as Record<string, Value>)[part]!, value);
}

/** The value of a span: a field's is behind its name. */
function valueIn(text: string, isField: boolean): Value {
  return isField ? Object.values(JSON.parse(`{${text}}`) as Record<string, Value>)[0]! : (JSON.parse(text) as Value);
}

test("the span of each path holds what the path leads to", () => {
  const chance = new Chance(1);
  for (let i = 0; i < texts; ++i) {
    const value = randomValue(chance);
    const text = written(value, chance);
    const root = parseJson(text);
    for (const path of pathsOf(value)) {
      const { start, end } = spanOf(root, path);
      assert.deepEqual(valueIn(text.slice(start, end), typeof path.at(-1) === "string"), at(value, path), text);
    }
  }
});

test("a line and a column lead back to the character", () => {
  const chance = new Chance(2);
  for (let i = 0; i < texts; ++i) {
    const text = written(randomValue(chance), chance);
    const offset = chance.below(text.length + 1);
    const { line, column } = placeOf(text, offset);
    const before = text.split("\n").slice(0, line - 1);
    assert.equal(before.reduce((sum, each) => sum + each.length + 1, 0) + column - 1, offset);
  }
});

test("what JSON.parse takes is taken, and nothing else, whatever letter is changed", () => {
  const chance = new Chance(3);
  const isTaken = (parse: (text: string) => unknown, text: string) => {
    try {
      parse(text);
      return true;
    } catch (error) {
      assert.ok(error instanceof JsonError || error instanceof SyntaxError);
      return false;
    }
  };
  let taken = 0;
  for (let i = 0; i < 20 * texts; ++i) {
    const text = written(randomValue(chance), chance);
    const place = chance.below(text.length + 1);
    const letter = chance.of([
      "",
      "",
      '"',
      ",",
      ":",
      "{",
      "}",
      "[",
      "]",
      "\\",
      "0",
      "-",
      ".",
      "e",
      "\n",
      "t",
      " ",
      "/",
    ]);
    const changed = text.slice(0, place) + letter + text.slice(place + chance.below(2));
    const isJson = isTaken(JSON.parse, changed);
    assert.equal(isTaken(parseJson, changed), isJson, JSON.stringify(changed));
    taken += Number(isJson);
  }
  assert.ok(taken > texts && taken < 19 * texts, `${taken}`);
});

test("an error says what is missing, and where", () => {
  const error = (text: string) => {
    try {
      parseJson(text);
    } catch (error) {
      const { message, at } = error as JsonError;
      const { line, column } = placeOf(text, at.start);
      return `${line}:${column} ${message}`;
    }
    return "";
  };
  assert.equal(error('{\n  "a": 1\n  "b": 2\n}'), "3:3 a comma or } is missing before this");
  assert.equal(error('{"a": 1,}'), "1:9 a name in quotes is missing here");
  assert.equal(error('{"a" 1}'), "1:6 a colon is missing here");
  assert.equal(error("[1, ]"), "1:5 a value is missing here");
  assert.match(error('["a\n"]'), /^1:2 this string has no closing quote/);
  assert.match(error('{"a": ['), /^1:8 the text ends too early/);
  assert.equal(error("{} {}"), "1:4 the scene ends before this");
  assert.match(error("[".repeat(100_000)), /nested more than 100 deep/);
});

test("a path of the server's leads as far as the text goes, under either spelling", () => {
  const text = '{"softBodies": [{"mass_kg": 1, "gas": {}}]}';
  const found = (path: string) => {
    const { start, end } = spanOf(parseJson(text), pathOf(path));
    return text.slice(start, end);
  };
  assert.deepEqual(pathOf("soft_bodies[0].gas.moles"), ["soft_bodies", 0, "gas", "moles"]);
  assert.deepEqual(pathOf("meshes[12].triangles.indices[9..11]"), ["meshes", 12, "triangles", "indices", 9]);
  assert.equal(found("soft_bodies[0].mass_kg"), '"mass_kg": 1');
  assert.equal(found("soft_bodies[0].gas.moles"), '"gas": {}');
  assert.equal(found("soft_bodies[7]"), '"softBodies": [{"mass_kg": 1, "gas": {}}]');
  assert.equal(found(""), text);
});
