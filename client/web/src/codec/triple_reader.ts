// Reads triples of residuals from coded bytes, by three range asymmetric numeral systems that share one text:
// proto/WIRE.md, "Residuals".
import { escapeBit, lastPlainLevel, lowBitsOf, probabilityBits, residualSlots, tableOf } from "./residual_tables.js";

const probabilityMask = (1 << probabilityBits) - 1;
const stepLowBitsMax = 16 - probabilityBits;
const escapeLengthBits = 6;
const stateMin = 1 << 16;
const stateCount = 3;
// What a triple may take past the end before that is asked for: each value a step, its high bits, an escape of three.
const paddingWords = 3 * 5;

// Then words lie in memory as in the text.
const isLittleEndian = new Uint8Array(Uint16Array.of(1).buffer)[0] === 1;

export class TripleReader {
  private readonly words: Uint16Array;
  private readonly end: number;
  private next = 0;
  // Unsigned, kept as the signed words of the same bits.
  private readonly states = new Int32Array(stateCount).fill(stateMin);
  private broken = false;

  constructor(text: Uint8Array) {
    this.end = text.length >> 1;
    this.words = new Uint16Array(this.end + paddingWords);
    if (isLittleEndian) new Uint8Array(this.words.buffer).set(text.subarray(0, 2 * this.end));
    else for (let i = 0; i < this.end; ++i) this.words[i] = text[2 * i]! | (text[2 * i + 1]! << 8);
    if (text.length === 0) return;
    this.broken = text.length % 2 !== 0 || this.end < 2 * stateCount;
    for (let i = 0; i < stateCount; ++i) {
      this.states[i] = this.words[this.next]! | (this.words[this.next + 1]! << 16);
      this.next += 2;
      this.broken ||= this.states[i]! >>> 16 === 0;
    }
  }

  /** Takes a triple at each of the levels `begin` up to `end`, to where they are in `triples`; none once it has failed. */
  take(levels: Uint8Array, begin: number, end: number, triples: Int32Array): void {
    // Of its own while nothing is out of the ordinary.
    const { words, states } = this;
    let { next } = this;
    let x = states[0]!;
    let y = states[1]!;
    let z = states[2]!;
    for (let i = begin, at = 3 * begin; i < end && next <= this.end && !this.broken; ++i, at += 3) {
      const level = levels[i]!;
      const table = tableOf(Math.min(level, lastPlainLevel));
      const tableOfYZ = tableOf(Math.min(level, lastPlainLevel) - 4);
      const ofX = residualSlots[table + (x & probabilityMask)]!;
      const ofY = residualSlots[tableOfYZ + (y & probabilityMask)]!;
      const ofZ = residualSlots[tableOfYZ + (z & probabilityMask)]!;
      if (level > lastPlainLevel || ((ofX | ofY | ofZ) & escapeBit) !== 0) {
        states[0] = x;
        states[1] = y;
        states[2] = z;
        this.next = next;
        this.takeInParts(level, at, triples);
        x = states[0]!;
        y = states[1]!;
        z = states[2]!;
        next = this.next;
        continue;
      }
      triples[at] = ofX >> 24;
      triples[at + 1] = ofY >> 24;
      triples[at + 2] = ofZ >> 24;
      // As step(), without its branch, which is close to chance: all ones where a word is wanted.
      x = Math.imul((ofX >> 12) & 0x7ff, x >>> probabilityBits) + (ofX & 0xfff);
      const lowX = ((x >>> 16) - 1) >> 31;
      x = (x << (lowX & 16)) | (lowX & words[next]!);
      next -= lowX;
      y = Math.imul((ofY >> 12) & 0x7ff, y >>> probabilityBits) + (ofY & 0xfff);
      const lowY = ((y >>> 16) - 1) >> 31;
      y = (y << (lowY & 16)) | (lowY & words[next]!);
      next -= lowY;
      z = Math.imul((ofZ >> 12) & 0x7ff, z >>> probabilityBits) + (ofZ & 0xfff);
      const lowZ = ((z >>> 16) - 1) >> 31;
      z = (z << (lowZ & 16)) | (lowZ & words[next]!);
      next -= lowZ;
    }
    states[0] = x;
    states[1] = y;
    states[2] = z;
    this.next = next;
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

  private takeInParts(level: number, at: number, triples: Int32Array): void {
    const lowBits = lowBitsOf(level);
    const rest = level - 4 * lowBits;
    for (let i = 0; i < stateCount; ++i) {
      triples[at + i] = this.takeOne(i, tableOf(i === 0 ? rest : rest - 4), lowBits);
    }
  }

  private takeOne(which: number, table: number, lowBits: number): number {
    const stepBits = Math.min(lowBits, stepLowBitsMax);
    const high = lowBits === stepBits ? 0 : this.plain(which, lowBits - stepBits) << stepBits;
    const state = this.states[which]!;
    const slot = residualSlots[table + ((state >>> stepBits) & probabilityMask)]!;
    const low = state & ((1 << stepBits) - 1);
    this.step(which, Math.imul((slot >> 12) & 0x7ff, state >>> (stepBits + probabilityBits)) + (slot & 0xfff));
    if ((slot & escapeBit) !== 0) return this.escaped(which);
    return (((slot >> 24) << lowBits) + (high | low) - ((1 << lowBits) >> 1)) | 0;
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
