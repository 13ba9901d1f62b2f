// The line that says how the page and its stream are doing.
import { element } from "./element.js";
import type { Gauge } from "./gauge.js";

export interface State {
  readonly asleep: number;
  readonly frozen: number;
  readonly hasShadows: boolean;
  /** Streams of the world that are not this page's. */
  readonly others: number;
}

const explanation = "“ms a frame”: to decode it in a worker, and to bring the scene up to date, before it is drawn";

/** No world is shown yet. */
export function clearStatus(): void {
  const { dataset } = element("status");
  for (const name of ["tick", "time", "shown"]) delete dataset[name];
}

/** Also as numbers in its data, over the page's life: for those who measure the page. */
export function tellStatus(gauge: Gauge, { asleep, frozen, hasShadows, others }: State): void {
  const status = element("status");
  const { frames, bytes, pictures, updateMs, decodeMs, passedS } = gauge.since();
  const aFrame = frames > 0 && pictures > 0 ? decodeMs / frames + updateMs / pictures : 0;
  // What matters less comes last: it is cut off where there is no room. Details do not fit a phone.
  const texts = [
    { text: `tick ${status.dataset["tick"] ?? "–"}` },
    { text: `${status.dataset["time"] ?? "–"} s` },
    ...(others > 0 ? [{ text: others === 1 ? "1 other watches" : `${others} others watch` }] : []),
    ...(asleep > 0 ? [{ text: `${asleep} asleep` }] : []),
    ...(frozen > 0 ? [{ text: `${frozen} frozen` }] : []),
    { text: `${Math.round(frames / passedS)} frames/s` },
    { text: `${Math.round(bytes / 1000 / passedS)} kB/s`, isDetail: true },
    { text: `${Math.round(pictures / passedS)} drawn/s` },
    ...(aFrame > 0 ? [{ text: `${aFrame.toFixed(1)} ms a frame`, isDetail: true }] : []),
    ...(hasShadows ? [] : [{ text: "no shadows: they are slow here", isDetail: true }]),
  ];
  status.replaceChildren(
    ...texts.map(({ text, isDetail = false }, i) => {
      const part = document.createElement("span");
      part.className = isDetail ? "detail" : "";
      part.textContent = i === 0 ? text : ` · ${text}`;
      return part;
    }),
  );
  status.title = `${status.textContent}\n${explanation}`;
  for (const [name, value] of Object.entries(gauge.all)) status.dataset[name] = String(value);
}
