// A mesh of a file becomes a soft body: chosen or dropped on the page, looked at, and sent to the server, which checks it.
import { Box3, Vector3 } from "three";
import { type Done, type Frame, PneumaError, type Scene } from "../src/index.js";
import { molesFor, skinFor, usualRadiusM } from "./additions.js";
import { refuse, say, unsay } from "./effect.js";
import { element } from "./element.js";
import type { Change } from "./inverse_edit.js";
import type { Triangles } from "./mesh_file.js";
import { mayEdit } from "./permitted.js";
import { freePlace, newName } from "./surroundings.js";
import { counted, inWords } from "./words.js";
import type { WorldEdits } from "./world_edits.js";

const topic = "file";
// What the server says of a scene that is written by hand. Here a button offers it.
const mendHint = / \(a mend of the mesh [^)]*\)/;
const meshFiles = /\.(obj|stl|ply|glb|gltf)$/i;

interface Chosen {
  readonly name: string;
  readonly triangles: Triangles;
  readonly volumeM3: number;
  readonly box: Box3;
}

export interface Around {
  readonly frame: Frame | undefined;
  /** What the camera looks at. */
  readonly centre: Vector3;
}

/** Of a file, with room for a number behind it: the server takes names of 128 bytes. */
function baseName(file: string): string {
  const bytes = new TextEncoder().encode(file.replace(/\.\w+$/, "")).subarray(0, 100);
  return new TextDecoder().decode(bytes, { stream: true }) || "mesh"; // without a letter that is cut in two
}

export class Upload {
  private readonly dialog = element<HTMLDialogElement>("upload");
  private readonly picker = element<HTMLInputElement>("mesh-file");
  private readonly size = element<HTMLInputElement>("upload-size");
  private readonly hasGas = element<HTMLInputElement>("upload-gas");
  private readonly refusal = element("upload-refusal");
  private readonly addButton = element<HTMLButtonElement>("upload-add");
  private readonly mendButton = element<HTMLButtonElement>("upload-mend");
  private chosen: Chosen | undefined;

  constructor(
    private readonly edits: WorldEdits,
    private readonly around: () => Around,
    private readonly made: (name: string) => void,
  ) {
    element("upload-open").addEventListener("click", () => this.picker.click());
    this.picker.addEventListener("change", () => {
      void this.read([...this.picker.files!]);
      this.picker.value = ""; // so that the same file can be chosen again
    });
    element("upload-form").addEventListener("submit", (event) => {
      event.preventDefault();
      void this.add(event.submitter === this.mendButton);
    });
    element("upload-cancel").addEventListener("click", () => this.dialog.close());
    this.dialog.addEventListener("close", () => {
      if (!this.dialog.open) this.chosen = undefined;
    });
    const isFile = ({ dataTransfer }: DragEvent) => dataTransfer?.types.includes("Files") ?? false;
    addEventListener("dragover", (event) => {
      if (!isFile(event)) return;
      event.preventDefault();
      document.body.classList.toggle("dropping", mayEdit());
    });
    addEventListener("dragleave", ({ relatedTarget }) => {
      if (!relatedTarget) document.body.classList.remove("dropping");
    });
    addEventListener("drop", (event) => {
      document.body.classList.remove("dropping");
      if (!isFile(event)) return;
      event.preventDefault(); // the browser would leave the page for it
      if (!mayEdit()) return;
      void this.read([...event.dataTransfer!.files]);
    });
  }

  private async read(files: readonly File[]): Promise<void> {
    const first = files.find(({ name }) => meshFiles.test(name)) ?? files[0];
    if (!first) return;
    say(`Reading ${first.name}…`, topic);
    try {
      const { readMesh, volumeOf } = await import("./mesh_file.js");
      const triangles = await readMesh([first, ...files.filter((file) => file !== first)]);
      const box = new Box3().setFromArray(triangles.positions);
      this.show({ name: first.name, triangles, volumeM3: volumeOf(triangles), box });
      unsay(topic);
    } catch (error) {
      const { message } = error as Error;
      refuse(error instanceof PneumaError ? error : new PneumaError("INVALID_ARGUMENT", message, first.name), topic);
    }
  }

  private show(chosen: Chosen): void {
    this.chosen = chosen;
    const { name, triangles, box } = chosen;
    const lengths = box.getSize(new Vector3()).toArray();
    element("upload-name").textContent = name;
    element("upload-facts").textContent = [
      counted(triangles.positions.length / 3, "vertex", "vertices"),
      counted(triangles.indices.length / 3, "face", "faces"),
      `${lengths.map((length) => Number(length.toPrecision(3))).join(" × ")} in the file's unit`,
    ].join(" · ");
    this.size.value = String(2 * usualRadiusM(this.around().frame));
    element<HTMLInputElement>("upload-scale").checked = true;
    this.hasGas.checked = true;
    this.tellRefusal("");
    this.work(false);
    if (!this.dialog.open) this.dialog.showModal();
  }

  private tellRefusal(why: string): void {
    this.refusal.textContent = why.replace(mendHint, "");
    this.mendButton.hidden = why === "";
  }

  private work(isBusy: boolean): void {
    this.dialog.classList.toggle("busy", isBusy);
    this.addButton.disabled = this.mendButton.disabled = isBusy;
  }

  private async add(isToMend: boolean): Promise<void> {
    const { chosen } = this;
    const { frame, centre } = this.around();
    if (!chosen || !frame || this.addButton.disabled) return;
    const isCurrent = () => this.chosen === chosen;
    this.work(true);
    try {
      const made = await this.edits.make((scene) => {
        if (!isCurrent()) return undefined; // cancelled
        const name = newName(scene, baseName(chosen.name));
        return { name, says: `Add ${name}`, changes: this.changes(chosen, scene, frame, centre, name, isToMend) };
      });
      if (!made) return;
      if (isCurrent()) this.dialog.close();
      this.report(made.name, made.reply);
      this.made(made.name);
    } catch (error) {
      if (isCurrent()) this.tellRefusal(inWords(error as PneumaError));
      else refuse(error as PneumaError);
    } finally {
      if (isCurrent()) this.work(false);
    }
  }

  private report(name: string, { tick, mended }: Done): void {
    const deeds = mended.map(({ detail }) => detail).filter((detail) => detail !== "");
    say(`${name} is there from tick ${tick} on${deeds.length > 0 ? `. Mended: ${deeds.join("; ")}` : ""}`);
  }

  /** The mesh about its own middle, at the size that is wished for, and a body of it at a free place. */
  private changes(
    { triangles, volumeM3, box }: Chosen,
    scene: Scene,
    frame: Frame,
    centre: Vector3,
    name: string,
    isToMend: boolean,
  ): Change[] {
    const lengths = box.getSize(new Vector3());
    const longest = Math.max(lengths.x, lengths.y, lengths.z);
    const isScaled = element<HTMLInputElement>("upload-scale").checked;
    const scale = isScaled && longest > 0 ? this.size.valueAsNumber / longest : 1;
    const middle = box.getCenter(new Vector3());
    const positions: { x: number; y: number; z: number }[] = [];
    for (let i = 0; i < triangles.positions.length; i += 3) {
      const { x, y, z } = new Vector3().fromArray(triangles.positions, i).sub(middle).multiplyScalar(scale);
      positions.push({ x, y, z });
    }
    const shape = { case: "triangles" as const, value: { positions, indices: [...triangles.indices] } };
    const mesh = { name, shape, ...(isToMend ? { mend: {} } : {}) };
    const { massKg, ...springs } = skinFor(scene, frame, positions.length);
    const { x, y, z } = freePlace(frame, centre, (scale * longest) / 2);
    const outsidePa = scene.atmosphere?.pressurePa ?? 0;
    // Of one that is yet to be closed or turned, next to nothing may be inside: a guess, then.
    const isHollow = Math.abs(volumeM3) > 1e-3 * longest ** 3;
    const insideM3 = (isHollow ? Math.abs(volumeM3) : 0.05 * longest ** 3) * scale ** 3;
    const gas = this.hasGas.checked ? { gas: { moles: molesFor({ massKg, ...springs }, insideM3, outsidePa) } } : {};
    const body = { name, mesh: name, massKg, springs, ...gas, position: { x, y, z } };
    const surface = { restitution: 0.5, friction: 0.5 };
    return [
      { change: { case: "addMesh", value: mesh } },
      { change: { case: "addSoftBody", value: { ...body, surface } } },
    ];
  }
}
