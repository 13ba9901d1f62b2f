// The worlds of the server, asked for again and again: they come and go by what others do.
import type { Client, WorldList_World } from "../src/index.js";

const intervalMs = 2000;

export class WorldList {
  worlds: readonly WorldList_World[] = [];
  private client: Client | undefined;

  /** `changed` is called with each list that came. */
  constructor(private readonly changed: (worlds: readonly WorldList_World[]) => void) {
    setInterval(() => {
      if (this.client?.state === "open" && !document.hidden) this.refresh().catch(() => {}); // asked again soon
    }, intervalMs);
  }

  /** Those that are whole, newly asked for. */
  async refresh(client = this.client): Promise<readonly WorldList_World[]> {
    this.client = client;
    if (client) this.worlds = (await client.worlds()).filter(({ damaged, restoring }) => !damaged && !restoring);
    this.changed(this.worlds);
    return this.worlds;
  }
}
