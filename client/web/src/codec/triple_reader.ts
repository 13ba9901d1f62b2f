// Reads triples of residuals from coded bytes, by three range asymmetric numeral systems that share one text:
// proto/WIRE.md, "Residuals".
import { escapeValue, lowBitsOf, probabilityBits, residualSlots, tableOf } from "./residual_tables.js";

const probabilityMask = (1 << probabilityBits) - 1;
const stepLowBitsMax = 16 - probabilityBits;
const escapeLengthBits = 6;
const stateMin = 1 << 16;
const stateCount = 3;
// What a triple may take past the end before failed() is asked: each value a step, its high bits, an escape of three.
const paddingWords = 3 * 5;

export class TripleReader {
  /** x y z of the last triple taken. */
  readonly triple = new Int32Array(stateCount);
  private readonly words: Uint16Array;
  private readonly end: number;
  private next = 0;
  // Unsigned, kept as the signed words of the same bits.
  private readonly states = new Int32Array(stateCount).fill(stateMin);
  private broken = false;

  constructor(text: Uint8Array) {
    this.end = text.length >> 1;
    this.words = new Uint16Array(this.end + paddingWords);
    for (let i = 0; i < this.end; ++i) this.words[i] = text[2 * i]! | (text[2 * i + 1]! << 8);
    if (text.length === 0) return;
    this.broken = text.length % 2 !== 0 || this.end < 2 * stateCount;
    for (let i = 0; i < stateCount; ++i) {
      this.states[i] = this.words[this.next]! | (this.words[this.next + 1]! << 16);
      this.next += 2;
      this.broken ||= this.states[i]! >>> 16 === 0;
    }
  }

  /** Takes the next triple; failed() tells whether there was one. */
  take(level: number): void {
    const lowBits = lowBitsOf(level);
    const table = tableOf(level - 4 * lowBits);
    const tableOfYZ = tableOf(level - 4 * lowBits - 4);
    if (lowBits !== 0) {
      for (let i = 0; i < stateCount; ++i) this.triple[i] = this.takeInParts(i, i === 0 ? table : tableOfYZ, lowBits);
      return;
    }
    const { words, states, triple } = this;
    for (let i = 0; i < stateCount; ++i) {
      const state = states[i]!;
      const slot = residualSlots[(i === 0 ? table : tableOfYZ) + (state & probabilityMask)]!;
      const value = slot >> 24;
      const after = Math.imul((slot >> 12) & 0xfff, state >>> probabilityBits) + (slot & 0xfff);
      // As step(), without its branch, which is close to chance: all ones where a word is wanted.
      const isLow = ((after >>> 16) - 1) >> 31;
      states[i] = (isLow & ((after << 16) | words[this.next]!)) | (~isLow & after);
      this.next -= isLow;
      triple[i] = value === escapeValue ? this.escaped(i) : value;
    }
  }

  /** The text has ended, or is none. */
  failed(): boolean {
    return this.next > this.end || this.broken;
  }

  /** All was read, and the states are back where the writer began. */
  atEnd(): boolean {
    return !this.broken && this.next === this.end && this.states.every((state) => state === stateMin);
  }

  private step(which: number, state: number): void {
    this.states[which] = state >>> 16 === 0 ? (state << 16) | this.words[this.next++]! : state;
  }

  private takeInParts(which: number, table: number, lowBits: number): number {
    const stepBits = Math.min(lowBits, stepLowBitsMax);
    const high = lowBits === stepBits ? 0 : this.plain(which, lowBits - stepBits) << stepBits;
    const state = this.states[which]!;
    const slot = residualSlots[table + ((state >>> stepBits) & probabilityMask)]!;
    const low = state & ((1 << stepBits) - 1);
    this.step(which, Math.imul((slot >> 12) & 0xfff, state >>> (stepBits + probabilityBits)) + (slot & 0xfff));
    const value = slot >> 24;
    if (value === escapeValue) return this.escaped(which);
    return ((value << lowBits) + (high | low) - (1 << (lowBits - 1))) | 0;
  }

  private plain(which: number, bits: number): number {
    const state = this.states[which]!;
    this.step(which, state >>> bits);
    return state & ((1 << bits) - 1);
  }

  private escaped(which: number): number {
    const length = this.plain(which, escapeLengthBits);
    if (length === 0 || length > 32) {
      this.broken = true;
      return 0;
    }
    const high = length > 16 ? this.plain(which, length - 16) << 16 : 0;
    const code = high | this.plain(which, Math.min(length, 16));
    return (code >>> 1) ^ -(code & 1);
  }
}
