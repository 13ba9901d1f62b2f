// How likely each residual is, given the size expected of it: proto/WIRE.md, "Residuals".

export const probabilityBits = 11;
const probabilityTotal = 1 << probabilityBits;
const residualMax = 31;
export const escapeValue = residualMax + 1;
const tableCount = 32;
export const levelMax = 91;

// Part of the format.
const ratios = [
  44, 142, 243, 346, 501, 723, 955, 1199, 1575, 2137, 2754, 3429, 4514, 6210, 8104, 10130, 13158, 17226, 20965, 24307,
  28482, 33144, 36829, 39792, 43171, 46621, 49160, 51103, 53225, 55305, 56785, 57891,
];

/** Fills one table; doubles hold all numbers here exactly, quotients to well below the distance to a whole one. */
function fillTable(ratio: number, slots: Int32Array): void {
  const one = 65536;
  const weights: number[] = [];
  let power = one;
  let sum = 0;
  for (let size = 0; size <= escapeValue; ++size) {
    const weight = Math.floor((power * 2 ** 32) / (one + power) ** 2);
    weights.push(weight);
    sum += size === 0 ? weight : 2 * weight;
    power = Math.floor((power * ratio) / one);
  }
  const frequencies = new Map<number, number>();
  let left = probabilityTotal;
  for (let value = -residualMax; value <= escapeValue; ++value) {
    if (value === 0) continue;
    const share = weights[Math.abs(value)]! * probabilityTotal;
    const frequency = value === escapeValue ? 1 + Math.floor((2 * share) / sum) : Math.floor(share / sum);
    frequencies.set(value, frequency);
    left -= frequency;
  }
  frequencies.set(0, left);
  let slot = 0;
  for (let value = -residualMax; value <= escapeValue; ++value) {
    const frequency = frequencies.get(value)!;
    for (let i = 0; i < frequency; ++i) slots[slot++] = (value << 24) | (frequency << 12) | i;
  }
}

/**
 * All tables, one after the other, an entry for each of the 2,048 places that a state can point to: the value (8 bits,
 * signed), the length of its range (12) and how far into it the place is (12).
 */
export const residualSlots: Int32Array = (() => {
  const slots = new Int32Array(tableCount * probabilityTotal);
  ratios.forEach((ratio, table) => fillTable(ratio, slots.subarray(table * probabilityTotal)));
  return slots;
})();

/** The level of a whole size up to 2^30. */
export function levelOf(size: number): number {
  const raised = size + 4;
  const octave = 29 - Math.clz32(raised);
  return 4 * octave + ((raised >> octave) & 3);
}

/** The least size of a level. */
export function sizeOf(level: number): number {
  return ((4 + (level & 3)) << (level >> 2)) - 4;
}

/** How residuals of a level are coded: where its table begins in residualSlots << 8, or'd with the low bits apart. */
export const models: Int32Array = (() => {
  const all = new Int32Array(levelMax + 1);
  for (let level = 0; level <= levelMax; ++level) {
    const octaves = level < tableCount ? 0 : (level >> 2) - (tableCount / 4 - 1);
    all[level] = (((level - 4 * octaves) * probabilityTotal) << 8) | octaves;
  }
  return all;
})();
