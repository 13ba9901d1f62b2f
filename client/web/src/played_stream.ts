// Which streams of a recording can be had without a server: its own frames, all of them, as they were recorded. What
// `pneuma play` would encode anew for is refused.
import { Error_Code, type Subscribe } from "../proto/pneuma/v1/session_pb.js";
import type { RecordingFile } from "./recording_reader.js";

/** As the Error that a server replies with. */
export class Refusal extends Error {
  constructor(
    readonly code: Error_Code,
    what: string,
    readonly where: string,
  ) {
    super(what);
  }
}

function refusal(code: keyof typeof Error_Code, what: string, field: string): Refusal {
  return new Refusal(Error_Code[code], what, `subscribe.${field}`);
}

/**
 * Throws Refusal, in the order in which `pneuma play` looks at the fields.
 * @param names of the soft bodies that are there now
 */
export function checkSubscribe(asked: Subscribe, { header, frames }: RecordingFile, names: readonly string[]): void {
  const { maxErrorM, velocityGridStepMS, rateHz } = header.stream!;
  if (asked.maxErrorM !== 0 && asked.maxErrorM < maxErrorM) {
    throw refusal("LIMIT_EXCEEDED", `was recorded within ${maxErrorM} m`, "max_error_m");
  }
  const unknown = asked.bodies.findIndex((body) => !names.includes(body));
  if (unknown >= 0) throw refusal("NOT_FOUND", `no soft body "${asked.bodies[unknown]}"`, `bodies[${unknown}]`);
  const lacks = (what: string) => refusal("FAILED_PRECONDITION", `the recording holds no ${what}`, what);
  if (asked.velocities && !velocityGridStepMS) throw lacks("velocities");
  if (asked.scalars && !frames[0]!.frame.scalars) throw lacks("scalars");
  if (asked.contacts) throw refusal("FAILED_PRECONDITION", "a recording tells no contacts", "contacts");
  const isTime = (value: number) => Number.isFinite(value) && value >= 0;
  if (!isTime(asked.rateHz)) throw refusal("INVALID_ARGUMENT", "must be 0 or more", "rate_hz");
  if (!isTime(asked.maxErrorM)) throw refusal("INVALID_ARGUMENT", "must be 0 or more", "max_error_m");
  if (!isTime(asked.keyIntervalS)) throw refusal("INVALID_ARGUMENT", "must be 0 or more", "key_interval_s");
  const cannot = (what: string, field: string) => refusal("UNSUPPORTED", `without a server ${what}`, field);
  if (asked.bodies.length > 0) throw cannot("all bodies are sent", "bodies");
  if (asked.levelOfDetail > 0) throw cannot("vertices are sent as they were recorded", "level_of_detail");
  // Frames build on each other, so that none can be left out.
  if (asked.rateHz > 0 && Math.round(rateHz / asked.rateHz) > 1) {
    throw cannot(`a recording has its own ${rateHz} frames a second`, "rate_hz");
  }
}
