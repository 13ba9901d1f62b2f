// Sends the newest of many values, one at a time and no faster than a server takes them.

// 20 a second, of the requests that a server takes from a client: so that a slider alone does not use them up.
const intervalMs = 50;

export class Latest<Value> {
  private next: { readonly value: Value } | undefined;
  private isSending_ = false;

  constructor(
    private readonly send: (value: Value) => Promise<void>,
    private readonly failed: (error: Error) => void,
    private readonly settled: () => void,
  ) {}

  get isSending(): boolean {
    return this.isSending_;
  }

  put(value: Value): void {
    this.next = { value };
    if (!this.isSending_) void this.run();
  }

  /** What is not sent yet is not wanted any more. */
  drop(): void {
    this.next = undefined;
  }

  private async run(): Promise<void> {
    this.isSending_ = true;
    while (this.next) {
      const { value } = this.next;
      this.next = undefined;
      const pause = new Promise((resolve) => setTimeout(resolve, intervalMs));
      await this.send(value).catch(this.failed);
      await pause;
    }
    this.isSending_ = false;
    this.settled();
  }
}
