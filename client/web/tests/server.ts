// A pneuma-server on free ports for the tests and the benchmark.
import { type ChildProcess, spawn } from "node:child_process";
import { once } from "node:events";
import { join } from "node:path";
import { createInterface } from "node:readline";

export class Server {
  private constructor(
    private readonly process: ChildProcess,
    /** HOST:PORT */
    readonly http: string,
  ) {}

  /** Starts one with these flags, asking for a token if there is one, and waits for its ready line. PNEUMA_SERVER names the program. */
  static async start(flags: readonly string[], token = ""): Promise<Server> {
    const program =
      process.env["PNEUMA_SERVER"] ?? join(process.env["PNEUMA_SOURCE"] ?? "../..", "build/release/bin/pneuma-server");
    const free = ["--listen", "127.0.0.1:0"];
    if (!flags.includes("--http")) free.push("--http", "127.0.0.1:0");
    const env = token === "" ? process.env : { ...process.env, PNEUMA_TOKEN: token };
    const child = spawn(program, [...free, ...flags], { stdio: ["ignore", "pipe", "ignore"], env });
    for await (const line of createInterface(child.stdout)) {
      const http = /^ready .*http=(\S+)/.exec(line)?.[1];
      if (http) return new Server(child, http);
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
