// What leaves the page: a link to what is seen, the scene, a picture, a recording.
import { toJsonString } from "@bufbuild/protobuf";
import { PneumaError, Recorder, SceneSchema } from "../src/index.js";
import { refuse, say } from "./effect.js";
import { element } from "./element.js";
import { copy, save } from "./files.js";
import { maxErrorM } from "./looks.js";
import type { WorldEdits } from "./world_edits.js";

const progressIntervalMs = 500;

export interface Shared {
  readonly url: string;
  readonly token: string;
  readonly world: string;
}

export class Share {
  private readonly recordButton = element<HTMLButtonElement>("record");
  private recorder: Recorder | undefined;
  private recorded = "";
  private isStarting = false;

  /** @param shared what is shown at the moment */
  constructor(
    private readonly edits: WorldEdits,
    private readonly shared: () => Shared,
    snapshot: () => Promise<Blob>,
  ) {
    const onClick = (id: string, action: () => Promise<void>) =>
      element(id).addEventListener("click", () => void action().catch(refuse));
    onClick("copy-link", async () => {
      if (await copy(location.href)) say("The link is copied: it opens this world with this view");
      else say(`This browser has no clipboard here; the link is ${location.href}`);
    });
    onClick("copy-scene", async () => {
      const text = await this.sceneText();
      if (await copy(text)) say("The scene is copied as JSON: pneuma create takes it as a file");
      else this.saveScene(text);
    });
    onClick("save-scene", async () => this.saveScene(await this.sceneText()));
    onClick("save-picture", async () => {
      save(`${this.shared().world}.png`, [await snapshot()], "image/png");
      say("The picture is saved");
    });
    onClick("record", () => (this.recorder ? this.stop() : this.start()));
    setInterval(() => this.tell(), progressIntervalMs);
    addEventListener("beforeunload", (event) => {
      if (this.recorder) event.preventDefault(); // it would be lost
    });
  }

  private async sceneText(): Promise<string> {
    return toJsonString(SceneSchema, await this.edits.fresh(), { prettySpaces: 2 });
  }

  private saveScene(text: string): void {
    save(`${this.shared().world}.json`, [text], "application/json");
    say("The scene is saved: pneuma create takes the file");
  }

  private async start(): Promise<void> {
    if (this.isStarting) return;
    this.isStarting = true;
    const { url, token, world } = this.shared();
    try {
      this.recorder = await Recorder.start(url, world, {
        token,
        maxErrorM,
        ended: (why: PneumaError) => {
          refuse(new PneumaError(why.code, `The recording of ${world} ended: ${why.message}`));
          void this.stop();
        },
      });
      this.recorded = world;
    } finally {
      this.isStarting = false;
    }
    this.tell();
  }

  private async stop(): Promise<void> {
    const { recorder, recorded } = this;
    if (!recorder) return;
    this.recorder = undefined;
    const { frames, durationS } = recorder.progress;
    save(`${recorded}.pneuma`, recorder.stop() as readonly BlobPart[], "application/octet-stream");
    say(`The recording is saved: ${frames} frames, ${durationS.toFixed(1)} s. pneuma play shows it`);
    this.tell();
  }

  private tell(): void {
    const progress = this.recorder?.progress;
    this.recordButton.classList.toggle("recording", progress !== undefined);
    this.recordButton.textContent = progress
      ? `Stop · ${progress.durationS.toFixed(1)} s · ${(progress.bytes / 1e6).toFixed(1)} MB`
      : "Record";
  }
}
