// Runs the test files of the suites that are named: `node dist/tests/run.js unit page`. What failed is named once more at
// the very end, where it is seen in a log that is cut.
import { readdirSync } from "node:fs";
import { basename, join } from "node:path";
import { run } from "node:test";
import { fileURLToPath } from "node:url";

// Of an error's message: its first lines say what happened, the rest is what a browser was doing.
const messageLinesMax = 4;

/** As node reports it; its own types leave out what differs between its versions. */
interface Report {
  readonly name: string;
  readonly file?: string;
  readonly message?: string;
  readonly skip?: string | boolean;
  readonly details?: { readonly duration_ms: number; readonly error?: Failure };
}

interface Failure extends Error {
  readonly failureType?: string;
  readonly cause?: Error | string;
}

const folder = fileURLToPath(new URL(".", import.meta.url));

function filesOf(suite: string): string[] {
  const names = readdirSync(join(folder, suite)).filter((name) => name.endsWith(".test.js"));
  return names.sort().map((name) => join(folder, suite, name));
}

function told({ name, file, details }: Report): string {
  const error = details?.error;
  const cause = error?.cause instanceof Error ? error.cause : (error ?? new Error("unknown"));
  const lines = cause.message.split("\n").filter((line) => line.trim() !== "");
  const at = cause.stack?.split("\n").find((line) => line.includes("/dist/tests/"));
  const why = [...lines.slice(0, messageLinesMax), ...(at ? [at.trim()] : [])];
  const place = file?.endsWith(".test.js") ? `${basename(file)}: ` : "";
  return [`FAILED ${place}${name}`, ...why.map((line) => `    ${line}`)].join("\n");
}

const suites = process.argv.slice(2);
const failures: string[] = [];
let passed = 0;

// The page's files one after the other: each has a browser of its own, which draws on every core.
const reports: AsyncIterable<unknown> = run({ files: suites.flatMap(filesOf), concurrency: !suites.includes("page") });
for await (const event of reports) {
  const { type, data: report } = event as { type: string; data: Report };
  const { name, message = "", skip, details } = report;
  if (type === "test:stdout" || type === "test:stderr") process.stderr.write(message);
  const isFile = name?.endsWith(".test.js") ?? false; // as node 18 sums its tests up
  if (type === "test:pass" && !isFile) {
    ++passed;
    console.log(`${skip ? "skipped" : "ok"} ${name} (${Math.round(details?.duration_ms ?? 0)} ms)`);
  }
  if (type === "test:fail" && details?.error?.failureType !== "subtestsFailed") {
    failures.push(told(report));
    console.log(`not ok ${name} (${Math.round(details?.duration_ms ?? 0)} ms)`);
    console.log(details?.error?.cause ?? details?.error);
  }
}
console.log(`${passed} passed, ${failures.length} failed`);
for (const failure of failures) console.log(failure);
if (failures.length > 0 || passed === 0) process.exitCode = 1;
