// When to try again.
import type { ErrorCode, PneumaError } from "./errors.js";

const lastingErrors: ReadonlySet<ErrorCode> = new Set(["UNAUTHENTICATED", "UNSUPPORTED", "INVALID_ARGUMENT"]);

/** Whether trying to connect again does not help. */
export function isLasting({ code }: PneumaError): boolean {
  return lastingErrors.has(code);
}

// About a server's restart; the first try after a short break of the network is not waited for.
const retryMsMin = 250;
// A server that was away for long is back on the screen within it.
const retryMsMax = 10_000;
/** A connection that lasted so long was a sound one: the waits after it begin from the shortest. */
export const steadyMs = retryMsMax;

/**
 * How long to wait before the try after `failures`: twice as long each time, less up to a half so that many clients spread,
 * but not less than the server asked for.
 */
export function retryDelayMs(failures: number, retryAfterS = 0, random = Math.random()): number {
  return Math.max(Math.min(retryMsMin * 2 ** failures, retryMsMax) * (1 - random / 2), 1000 * retryAfterS);
}
