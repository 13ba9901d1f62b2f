// What leaves the page: a link to what is seen, the scene, a picture, a recording.
import { toJsonString } from "@bufbuild/protobuf";
import { PneumaError, Recorder, SceneSchema } from "../src/index.js";
import { noteView } from "./address.js";
import { refuse, say } from "./effect.js";
import { element } from "./element.js";
import { copy, save } from "./files.js";
import { maxErrorM } from "./looks.js";
import type { Picture } from "./picture.js";
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
    picture: Picture,
  ) {
    const onClick = (id: string, action: () => Promise<void>) =>
      element(id).addEventListener("click", () => void action().catch(refuse));
    onClick("copy-link", async () => {
      noteView(this.shared().world, picture.view);
      if (await copy(location.href)) say("The link is copied: it opens this world with this view");
      else say(`This browser has no clipboard here; the link is ${location.href}`);
    });
    onClick("copy-scene", async () => {
      const { world } = this.shared();
      const text = await this.sceneText();
      if (await copy(text)) say("The scene is copied as JSON: pneuma create takes it as a file");
      else this.saveScene(world, text);
    });
    onClick("save-scene", async () => this.saveScene(this.shared().world, await this.sceneText()));
    onClick("save-picture", async () => {
      const { world } = this.shared();
      save(`${world}.png`, [await picture.snapshot()], "image/png");
      say("The picture is saved");
    });
    onClick("record", async () => (this.recorder ? this.stop() : this.start()));
    setInterval(() => this.tell(), progressIntervalMs);
    addEventListener("beforeunload", (event) => {
      if (this.recorder) event.preventDefault(); // it would be lost
    });
  }

  private async sceneText(): Promise<string> {
    return toJsonString(SceneSchema, await this.edits.fresh(), { prettySpaces: 2 });
  }

  private saveScene(world: string, text: string): void {
    save(`${world}.json`, [text], "application/json");
    say("The scene is saved: pneuma create takes the file");
  }

  private async start(): Promise<void> {
    if (this.isStarting) return;
    this.isStarting = true;
    const { url, token, world } = this.shared();
    let end: PneumaError | undefined;
    try {
      this.recorder = await Recorder.start(url, world, {
        token,
        maxErrorM,
        ended: (why) => {
          end = why; // maybe with what came before it was begun
          this.stop(why);
        },
      });
      this.recorded = world;
    } finally {
      this.isStarting = false;
    }
    if (end) this.stop(end);
    this.tell();
  }

  /** @param why it ended by itself */
  private stop(why?: PneumaError): void {
    const { recorder, recorded } = this;
    if (!recorder) return;
    this.recorder = undefined;
    const { frames, durationS } = recorder.progress;
    save(`${recorded}.pneuma`, recorder.stop() as readonly BlobPart[], "application/octet-stream");
    const saved = `is saved: ${frames} frames, ${durationS.toFixed(1)} s. pneuma play shows it`;
    if (why)
      refuse(new PneumaError(why.code, `The recording of ${recorded} ended: ${why.message}. What came ${saved}`));
    else say(`The recording ${saved}`);
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
