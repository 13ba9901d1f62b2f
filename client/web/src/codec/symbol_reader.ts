// Reads residuals from coded bytes, by two interleaved range asymmetric numeral systems: proto/WIRE.md, "Residuals".
import { escapeValue, probabilityBits, residualSlots } from "./residual_tables.js";

const probabilityMask = (1 << probabilityBits) - 1;
const stepLowBitsMax = 16 - probabilityBits;
const escapeLengthBits = 6;
const stateMin = 1 << 16;
// What three residuals may take past the end before failed() is asked: each a step, its high bits, an escape of three.
const paddingWords = 3 * 5;

/** A state is an unsigned word, kept as the signed one of the same bits. */
export class SymbolReader {
  private readonly words: Uint16Array;
  private readonly end: number;
  private next = 0;
  private state = stateMin;
  private other = stateMin;
  private broken = false;

  constructor(text: Uint8Array) {
    const count = text.length >> 1;
    this.words = new Uint16Array(count + paddingWords);
    for (let i = 0; i < count; ++i) this.words[i] = text[2 * i]! | (text[2 * i + 1]! << 8);
    this.end = count;
    if (text.length === 0) return;
    this.broken = text.length % 2 !== 0 || count < 4;
    this.state = this.words[0]! | (this.words[1]! << 16);
    this.other = this.words[2]! | (this.words[3]! << 16);
    this.next = 4;
    this.broken ||= this.state >>> 16 === 0 || this.other >>> 16 === 0;
  }

  /** A residual of one of `models`. At most three may be taken before failed() is asked. */
  take(model: number): number {
    const lowBits = model & 255;
    if (lowBits !== 0) return this.takeInParts(model >> 8, lowBits);
    const slot = residualSlots[(model >> 8) + (this.state & probabilityMask)]!;
    this.step(Math.imul((slot >> 12) & 0xfff, this.state >>> probabilityBits) + (slot & 0xfff));
    const value = slot >> 24;
    return value === escapeValue ? this.takeEscaped() : value;
  }

  /** The text has ended, or is none. */
  failed(): boolean {
    return this.next > this.end || this.broken;
  }

  /** All was read, and the states are back where the writer began. */
  atEnd(): boolean {
    return !this.broken && this.next === this.end && this.state === stateMin && this.other === stateMin;
  }

  private step(state: number): void {
    const refilled = state >>> 16 === 0 ? (state << 16) | this.words[this.next++]! : state | 0;
    this.state = this.other;
    this.other = refilled;
  }

  private takePlain(bits: number): number {
    const value = this.state & ((1 << bits) - 1);
    this.step(this.state >>> bits);
    return value;
  }

  private takeInParts(table: number, lowBits: number): number {
    const stepBits = Math.min(lowBits, stepLowBitsMax);
    const high = lowBits === stepBits ? 0 : this.takePlain(lowBits - stepBits) << stepBits;
    const slot = residualSlots[table + ((this.state >>> stepBits) & probabilityMask)]!;
    const low = this.state & ((1 << stepBits) - 1);
    this.step(Math.imul((slot >> 12) & 0xfff, this.state >>> (stepBits + probabilityBits)) + (slot & 0xfff));
    const value = slot >> 24;
    if (value === escapeValue) return this.takeEscaped();
    return ((value << lowBits) + (high | low) - (1 << (lowBits - 1))) | 0;
  }

  private takeEscaped(): number {
    const length = this.takePlain(escapeLengthBits);
    if (length === 0 || length > 32) {
      this.broken = true;
      return 0;
    }
    const high = length > 16 ? this.takePlain(length - 16) << 16 : 0;
    const code = high | this.takePlain(Math.min(length, 16));
    return (code >>> 1) ^ -(code & 1);
  }
}
