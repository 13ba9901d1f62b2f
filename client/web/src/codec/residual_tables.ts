// How likely each residual is, given the size expected of it: proto/WIRE.md, "Residuals".

export const probabilityBits = 10;
const probabilityTotal = 1 << probabilityBits;
const residualMax = 31;
export const escapeValue = residualMax + 1;
const tableCount = 32;
export const levelMax = 91;

// Part of the format.
const ratios = [
  44, 142, 400, 800, 1200, 1300, 1432, 1500, 1606, 1923, 2258, 2606, 3430, 4968, 6321, 7800, 10263, 13800, 16600, 20417,
  24494, 28503, 31672, 36000, 41444, 45500, 48176, 50800, 52600, 54400, 55400, 55700,
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
 * All tables, one after the other, an entry for each of the 1,024 places that a state can point to: the value (8 bits,
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

/** Low bits that are coded apart at a level. */
export function lowBitsOf(level: number): number {
  return level < tableCount ? 0 : (level >> 2) - (tableCount / 4 - 1);
}

/** Where the table of a level without its low bits begins in residualSlots; a level below 0 counts as 0. */
export function tableOf(level: number): number {
  return Math.max(level, 0) << probabilityBits;
}
