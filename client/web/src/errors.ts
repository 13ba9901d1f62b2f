// What can go wrong, as the server says it and as this library does: proto/WIRE.md, "Errors".

export type ErrorCode =
  | "INVALID_ARGUMENT"
  | "NOT_FOUND"
  | "ALREADY_EXISTS"
  | "LIMIT_EXCEEDED"
  | "UNAUTHENTICATED"
  | "PERMISSION_DENIED"
  | "FAILED_PRECONDITION"
  | "UNSUPPORTED"
  | "MALFORMED"
  | "UNAVAILABLE"
  | "INTERNAL"
  /** Of this library alone: a stream's vertices are not the server's. It goes on with a key frame. */
  | "WRONG_STATE";

export class PneumaError extends Error {
  /**
   * @param code  what kind of error, for programs
   * @param what  what is wrong, for people
   * @param where the path of the field at fault, from the request on; empty where there is none
   * @param retryAfterS when to try again, where that makes sense
   */
  constructor(
    readonly code: ErrorCode,
    readonly what: string,
    readonly where = "",
    readonly retryAfterS?: number,
  ) {
    super(where === "" ? what : `${where}: ${what}`);
    this.name = "PneumaError";
  }
}

/** Calls back into the program that uses the library. What that throws is uncaught there, and leaves the library whole. */
export function callUser(callback: () => void): void {
  try {
    callback();
  } catch (error) {
    queueMicrotask(() => {
      throw error;
    });
  }
}
