// Writes proto/, the messages of proto/ as TypeScript. PNEUMA_SOURCE names the repository where this is a copy.
import { execFileSync } from "node:child_process";
import { mkdirSync, readdirSync } from "node:fs";
import { join } from "node:path";

const from = join(process.env.PNEUMA_SOURCE ?? "../..", "proto");
const files = readdirSync(join(from, "pneuma/v1")).filter((name) => name.endsWith(".proto"));
mkdirSync("proto", { recursive: true });
execFileSync("protoc", [
  `--proto_path=${from}`,
  "--plugin=protoc-gen-es=node_modules/.bin/protoc-gen-es",
  "--es_out=proto",
  "--es_opt=target=ts,import_extension=js",
  ...files.map((name) => `pneuma/v1/${name}`),
]);
