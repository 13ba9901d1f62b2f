// What leaves the page: a link to what is seen, the scene, a picture, a film, a recording, or that as a page of its own.
import { PneumaError, readRecording, Recorder } from "../src/index.js";
import { noteView } from "./address.js";
import { refuse, say } from "./effect.js";
import { element } from "./element.js";
import { copy, save } from "./files.js";
import type { Film } from "./film.js";
import { maxErrorM } from "./looks.js";
import { oneFile } from "./one_file.js";
import type { Picture } from "./picture.js";
import { wholeSceneText } from "./scene_text.js";
import type { WorldEdits } from "./world_edits.js";

const progressIntervalMs = 500;
// A seek decodes no more than this, in the world's time.
const keyIntervalS = 1;

export interface Shared {
  readonly url: string;
  readonly token: string;
  readonly world: string;
}

function saveRecording(name: string, recording: readonly BlobPart[]): void {
  save(`${name}.pneuma`, recording, "application/octet-stream");
}

export class Share {
  private readonly recordButton = element<HTMLButtonElement>("record");
  private readonly filmButton = element<HTMLButtonElement>("film");
  private film: Film | undefined;
  private recorder: Recorder | undefined;
  private recorded = "";
  private isStarting = false;
  private isMakingPage = false;

  /** @param shared what is shown at the moment */
  constructor(
    private readonly edits: WorldEdits,
    private readonly shared: () => Shared,
    private readonly picture: Picture,
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
    onClick("film", async () => (this.film ? this.film.stop() : this.shoot()));
    onClick("record", async () => (this.recorder ? this.stop() : this.start()));
    const file = element<HTMLInputElement>("one-file");
    onClick("one-file-open", async () => file.click());
    file.addEventListener("change", () => {
      const [recording] = file.files ?? [];
      file.value = "";
      if (recording) void this.convert(recording).catch(refuse);
    });
    setInterval(() => this.tell(), progressIntervalMs);
    addEventListener("beforeunload", (event) => {
      if (this.recorder || this.isMakingPage) event.preventDefault(); // it would be lost
    });
  }

  get isRecording(): boolean {
    return this.recorder !== undefined;
  }

  private async sceneText(): Promise<string> {
    return wholeSceneText(await this.edits.fresh());
  }

  private saveScene(world: string, text: string): void {
    save(`${world}.json`, [text], "application/json");
    say("The scene is saved: pneuma create takes the file");
  }

  private async shoot(): Promise<void> {
    const { world } = this.shared();
    this.film = this.picture.film();
    this.tell();
    try {
      const { parts, ending, type } = await this.film.file;
      save(`${world}.${ending}`, parts, type);
      say("The film is saved");
    } finally {
      this.film = undefined;
      this.tell();
    }
  }

  /** The page with a recording in it. */
  private async convert(recording: File): Promise<void> {
    const bytes = new Uint8Array(await recording.arrayBuffer());
    try {
      readRecording(bytes);
    } catch (error) {
      const { code, what } = error as PneumaError;
      throw new PneumaError(code, what, recording.name);
    }
    await this.savePage(recording.name.replace(/\.pneuma$/, ""), [bytes]);
  }

  /** The recording itself, where the page that it was to become cannot be made. */
  private async savePageOrRecording(name: string, recording: readonly BlobPart[]): Promise<void> {
    this.isMakingPage = true;
    try {
      await this.savePage(name, recording);
    } catch (error) {
      saveRecording(name, recording);
      const why = (error as PneumaError).message;
      // Whether or not the connection is lost: what was saved is not what was chosen.
      const told = `The page cannot be made: ${why}. The recording itself is saved instead`;
      refuse(new PneumaError("FAILED_PRECONDITION", told));
    } finally {
      this.isMakingPage = false;
    }
  }

  private async savePage(name: string, recording: readonly BlobPart[]): Promise<void> {
    const page = await oneFile(recording).catch((error: Error) => {
      throw error instanceof PneumaError ? error : new PneumaError("LIMIT_EXCEEDED", error.message); // of a text's length
    });
    save(`${name}.html`, [page], "text/html");
    say("The page is saved: it opens without a server", "page");
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
        keyIntervalS,
        scalars: true,
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
    const file = recorder.stop() as readonly BlobPart[];
    const came = `${frames} frames, ${durationS.toFixed(1)} s`;
    if (element<HTMLSelectElement>("record-as").value === "html" && frames > 0) {
      void this.savePageOrRecording(recorded, file);
      if (why) this.broke(why, came);
    } else {
      saveRecording(recorded, file);
      const saved = `is saved: ${came}. pneuma play shows it`;
      if (why) this.broke(why, saved);
      else say(`The recording ${saved}`);
    }
    this.tell();
  }

  private broke({ code, message }: PneumaError, came: string): void {
    refuse(new PneumaError(code, `The recording of ${this.recorded} ended: ${message}. What came: ${came}`));
  }

  private tell(): void {
    this.filmButton.classList.toggle("recording", this.film !== undefined);
    this.filmButton.textContent = this.film ? `Filming · ${Math.ceil(this.film.leftS)} s` : "Film 6 s";
    const progress = this.recorder?.progress;
    this.recordButton.classList.toggle("recording", progress !== undefined);
    this.recordButton.textContent = progress
      ? `Stop · ${progress.durationS.toFixed(1)} s · ${(progress.bytes / 1e6).toFixed(1)} MB`
      : "Record";
  }
}
