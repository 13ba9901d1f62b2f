// A pneuma-server on free ports for the tests and the benchmark.
import { type ChildProcess, spawn } from "node:child_process";
import { once } from "node:events";
import { dirname, join } from "node:path";
import { createInterface } from "node:readline";

export const serverProgram =
  process.env["PNEUMA_SERVER_PROGRAM"] ??
  join(process.env["PNEUMA_SOURCE"] ?? "../..", "build/release/bin/pneuma-server");
/** `pneuma`, which is beside the server. */
export const clientProgram = join(dirname(serverProgram), "pneuma");

export class Server {
  private constructor(
    private readonly process: ChildProcess,
    /** HOST:PORT */
    readonly tcp: string,
    readonly http: string,
  ) {}

  /** Starts one with these flags, asking for a token if there is one, and waits for its ready line. PNEUMA_SERVER_PROGRAM names it. */
  static start(flags: readonly string[], token = ""): Promise<Server> {
    // All who come from here are one client.
    return Server.run(serverProgram, ["--commands-per-s", "1e6", "--commands-burst", "1e6", ...flags], token);
  }

  /** Serves a recording. */
  static play(file: string, flags: readonly string[]): Promise<Server> {
    return Server.run(clientProgram, ["play", file, ...flags]);
  }

  private static async run(program: string, flags: readonly string[], token = ""): Promise<Server> {
    const free = ["--listen", "127.0.0.1:0"];
    if (!flags.includes("--http")) free.push("--http", "127.0.0.1:0");
    const env = token === "" ? process.env : { ...process.env, PNEUMA_TOKEN: token };
    const child = spawn(program, [...flags, ...free], { stdio: ["ignore", "pipe", "ignore"], env });
    for await (const line of createInterface(child.stdout)) {
      const [, tcp, http] = /^ready tcp=(\S+) http=(\S+)/.exec(line) ?? [];
      if (tcp && http) return new Server(child, tcp, http);
    }
    throw new Error(`${program} ended before it was ready`);
  }

  get url(): string {
    return `ws://${this.http}/ws`;
  }

  /** Ends it as a crash would. */
  async kill(): Promise<void> {
    if (this.process.exitCode !== null || this.process.signalCode !== null) return;
    const exit = once(this.process, "exit");
    this.process.kill("SIGKILL");
    await exit;
  }
}
