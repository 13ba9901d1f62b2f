// How likely each residual is, given the size expected of it: proto/WIRE.md, "Residuals".

export const probabilityBits = 10;
const probabilityTotal = 1 << probabilityBits;
const residualMax = 31;
const escapeValue = residualMax + 1;
/** Of an entry of residualSlots. */
export const escapeBit = 1 << 23;
const tableCount = 16;
const levelsATable = 2;
export const levelMax = 91;

// Part of the format.
const ratios = [
  150, 3730, 4310, 4910, 7080, 8360, 12860, 18390, 23380, 28000, 34570, 41690, 48820, 52960, 56420, 58420,
];

/** Fills one table; doubles hold all numbers here exactly, quotients to well below the distance to a whole one. */
function fillTable(ratio: number, slots: Int32Array): void {
  const weights: number[] = [];
  let weight = 2 ** 32;
  let sum = 0;
  for (let size = 0; size <= escapeValue; ++size) {
    weights.push(weight);
    sum += size === 0 ? weight : 2 * weight;
    weight = Math.floor((weight * ratio) / 65536);
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
    const same = (value << 24) | (value === escapeValue ? escapeBit : 0) | (frequency << 12);
    for (let i = 0; i < frequency; ++i) slots[slot++] = same | i;
  }
}

/**
 * All tables, one after the other, an entry for each of the 1,024 places that a state can point to: the value (8 bits,
 * signed), escapeBit, the length of its range (11) and how far into it the place is (12).
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

/** Of those whose residuals have no low bits that are coded apart. */
export const lastPlainLevel = levelsATable * tableCount - 1;

/** Low bits that are coded apart at a level. */
export function lowBitsOf(level: number): number {
  return level <= lastPlainLevel ? 0 : (level >> 2) - (tableCount / 2 - 1);
}

/** Where the table of a level without low bits begins in residualSlots; a level below 0 counts as 0. */
export function tableOf(level: number): number {
  return (Math.max(level, 0) >> 1) << probabilityBits;
}
