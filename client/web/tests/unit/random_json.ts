// Random JSON, and the same value in another writing: for tests that show something of all texts. A seed gives the same.
export type Value = string | number | boolean | null | Value[] | { [key: string]: Value };

export class Chance {
  constructor(private seed: number) {}

  /** A whole number from 0 to below `count` (mulberry32). */
  below(count: number): number {
    this.seed = (this.seed + 0x6d2b79f5) | 0;
    let mixed = Math.imul(this.seed ^ (this.seed >>> 15), 1 | this.seed);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return Math.floor((((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32) * count);
  }

  of<Item>(items: readonly Item[]): Item {
    return items[this.below(items.length)]!;
  }
}

const names = ["name", "soft_bodies", "x", "", "gas moles", 'a "quoted" one', "ü\n", "0", "massKg"];
const plain = ["", "a", '\u2028 \\ " \t', "}{][,:", 0, -0.5, 1e-7, 12345.678, 1e21, true, false, null];

export function randomValue(chance: Chance, depth = 4): Value {
  const kind = depth === 0 ? 0 : chance.below(4);
  if (kind < 2) return chance.of(plain);
  const items = Array.from({ length: chance.below(4) }, () => randomValue(chance, depth - 1));
  if (kind === 2) return items;
  return Object.fromEntries(items.map((item) => [chance.of(names), item]));
}

/** As JSON, with space wherever it may be. */
export function written(value: Value, chance: Chance): string {
  const gap = () => chance.of(["", "", " ", "\n", "\r\n  ", "\t"]);
  const list = (parts: readonly string[]) => parts.map((part) => gap() + part + gap()).join(",") || gap();
  if (typeof value !== "object" || value === null) return JSON.stringify(value);
  if (Array.isArray(value)) return `[${list(value.map((item) => written(item, chance)))}]`;
  const members = Object.entries(value);
  return `{${list(members.map(([key, part]) => `${JSON.stringify(key)}${gap()}:${gap()}${written(part, chance)}`))}}`;
}
