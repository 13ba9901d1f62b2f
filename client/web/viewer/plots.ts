// A world's quantities over its time.
import uPlot from "uplot";
import type { Frame, Stats } from "../src/index.js";
import { css, oklch } from "./colours.js";
import { element } from "./element.js";
import { History } from "./history.js";
import type { Measured } from "./stats_feed.js";

const spanS = 60;
const frameIntervalS = 1 / 30;
const statsIntervalS = 0.1;
const heightPx = 120;

interface Chart {
  readonly title: string;
  readonly unit: string;
  readonly series: readonly string[];
}

const ofFrames: readonly Chart[] = [
  { title: "Volume", unit: "m³", series: ["volume"] },
  { title: "Pressure over the outside", unit: "Pa", series: ["pressure"] },
];
const ofStats: readonly Chart[] = [
  { title: "Energy", unit: "J", series: ["kinetic", "elastic", "gas", "gravity"] },
  { title: "Momentum", unit: "kg m/s", series: ["x", "y", "z"] },
  { title: "Time of a step", unit: "ms", series: ["median", "largest", "budget"] },
  { title: "Size of a frame", unit: "bits a vertex", series: ["mean of the stream"] },
  { title: "Delay", unit: "ms", series: ["round trip", "oldest unsent frame"] },
];

function sum(values: Iterable<number>): number {
  let total = 0;
  for (const value of values) total += value;
  return total;
}

/** Of the body at `index`; of all together, where there is none: their sum. */
function total(values: readonly number[], index: number | undefined): number {
  return index === undefined ? sum(values) : (values[index] ?? NaN);
}

function rowOf({ stats, roundTripMs }: Measured, body: string): number[] {
  const bodies = stats.softBodies.filter(({ name }) => body === "" || name === body);
  const of = (value: (each: Stats["softBodies"][number]) => number) => sum(bodies.map(value));
  const stream = stats.streams.at(-1);
  return [
    of(({ kineticJ }) => kineticJ),
    of(({ elasticJ }) => elasticJ),
    of(({ gasJ }) => gasJ),
    of(({ gravityJ }) => gravityJ),
    of(({ momentum }) => momentum?.x ?? 0),
    of(({ momentum }) => momentum?.y ?? 0),
    of(({ momentum }) => momentum?.z ?? 0),
    stats.stepTimeMs,
    stats.stepTimeMaxMs,
    1000 / stats.rateHz,
    stream?.bitsPerVertex ?? NaN,
    roundTripMs ?? NaN,
    stream?.queueAgeMs ?? NaN,
  ];
}

function width(charts: readonly Chart[]): number {
  return sum(charts.map(({ series }) => series.length));
}

export class Plots {
  private readonly frames = new History(width(ofFrames), spanS, frameIntervalS);
  private readonly stats = new History(width(ofStats), spanS, statsIntervalS);
  private readonly body = element<HTMLSelectElement>("plotted-body");
  private plots: { readonly plot: uPlot; readonly rows: () => Float64Array[] }[] = [];
  private isOpen = false;
  private names = "";

  constructor() {
    this.body.addEventListener("change", () => this.clear());
    new ResizeObserver(() => this.resize()).observe(element("charts"));
  }

  open(isOpen: boolean): void {
    this.isOpen = isOpen;
    this.clear();
    for (const { plot } of this.plots) plot.destroy();
    this.plots = [];
    if (!isOpen) return;
    for (const [charts, history] of [
      [ofFrames, this.frames],
      [ofStats, this.stats],
    ] as const) {
      let first = 1;
      for (const chart of charts) {
        const at = first;
        const rows = () => [history.rows()[0]!, ...history.rows().slice(at, at + chart.series.length)];
        this.plots.push({ plot: this.make(chart), rows });
        first += chart.series.length;
      }
    }
  }

  /** Of another world, or another body: nothing goes on. */
  clear(): void {
    this.frames.clear();
    this.stats.clear();
  }

  /** After a change of the theme, whose colours the axes have. */
  redraw(): void {
    for (const { plot } of this.plots) plot.redraw(false, true);
  }

  takeFrame({ timeS, scalars, layout }: Frame): void {
    if (!this.isOpen || !scalars) return;
    this.tellBodies(layout.softBodies.map(({ name }) => name));
    const body = this.body.value;
    const found = layout.softBodies.findIndex(({ name }) => name === body);
    const pressures = scalars.pressurePa;
    const pressure = body === "" ? sum(pressures) / Math.max(pressures.length, 1) : (pressures[found] ?? NaN);
    this.frames.push(timeS, [total(scalars.volumeM3, body === "" ? undefined : found), pressure]);
  }

  takeStats(measured: Measured): void {
    this.stats.push(measured.stats.timeS, rowOf(measured, this.body.value));
    for (const { plot, rows } of this.plots) {
      const [times, ...values] = rows().map((column) => Array.from(column));
      if (!times) continue;
      // Of what was not measured, a gap.
      plot.setData([times, ...values.map((column) => column.map((value) => (Number.isNaN(value) ? null : value)))]);
      if (plot.cursor.idx === null || plot.cursor.idx === undefined) plot.setLegend({ idx: times.length - 1 });
    }
  }

  private tellBodies(names: readonly string[]): void {
    const key = JSON.stringify(names);
    if (key === this.names) return;
    this.names = key;
    const { value } = this.body;
    const all = new Option("all: sums, and the mean of the pressures", "");
    this.body.replaceChildren(all, ...names.map((name) => new Option(name, name)));
    this.body.value = names.includes(value) ? value : "";
    if (this.body.value !== value) this.clear(); // of a body that is gone: the sum is no sequel
  }

  private make({ title, unit, series }: Chart): uPlot {
    const ink = () => getComputedStyle(document.documentElement).getPropertyValue("--ink");
    const line = () => getComputedStyle(document.documentElement).getPropertyValue("--line");
    const axis: uPlot.Axis = {
      stroke: ink,
      grid: { stroke: line, width: 1 },
      ticks: { stroke: line, width: 1, size: 4 },
      font: "11px system-ui, sans-serif",
      gap: 3,
    };
    const figure = document.createElement("figure");
    const caption = document.createElement("figcaption");
    caption.textContent = `${title}, ${unit}`;
    figure.append(caption);
    element("charts").append(figure);
    const value = (_: uPlot, shown: number | null) =>
      shown === null || Number.isNaN(shown) ? "–" : shown.toPrecision(3);
    const options: uPlot.Options = {
      width: Math.max(figure.clientWidth, 100),
      height: heightPx,
      padding: [6, 8, 0, 0],
      scales: { x: { time: false } },
      axes: [
        { ...axis, size: 24, values: (_, splits) => splits.map((each) => `${each} s`) },
        { ...axis, size: 46 },
      ],
      series: [
        { label: "at", value: (_, shown) => (shown === null ? "–" : `${shown.toFixed(1)} s`) },
        // The same on light and on dark: lightness in the middle.
        ...series.map((label, i) => ({
          label,
          value,
          stroke: css(oklch(0.64, 0.15, [35, 250, 145, 300][i]!)),
          width: 1.5,
          points: { show: false },
        })),
      ],
      cursor: { y: false, drag: { x: false, y: false } },
      hooks: { destroy: [() => figure.remove()] },
    };
    return new uPlot(options, [[], ...series.map(() => [])], figure);
  }

  private resize(): void {
    for (const { plot } of this.plots) {
      const widthPx = plot.root.parentElement!.clientWidth;
      if (widthPx > 0 && widthPx !== plot.width) plot.setSize({ width: widthPx, height: heightPx });
    }
  }
}
