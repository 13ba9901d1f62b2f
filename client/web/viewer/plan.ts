// The step plan: which stages a world's tick is made of, what each takes, and how the step was chosen.
import type { Stats } from "../src/index.js";
import { element } from "./element.js";
import type { Measured } from "./stats_feed.js";

// Times are means over this many answers, of 4 a second.
const answersMax = 5;

export interface StageCost {
  readonly name: string;
  readonly msATick: number;
  readonly callsATick: number;
  readonly bytes: number;
}

/** What each stage took from one answer to a later one; undefined where no tick was done in between. */
export function costsBetween(earlier: Stats, later: Stats): StageCost[] | undefined {
  const ticks = Number(later.tick - earlier.tick);
  if (ticks <= 0) return undefined;
  const before = new Map(earlier.stages.map((stage) => [stage.name, stage]));
  return later.stages.map(({ name, timeS, calls, bytes }) => {
    const { timeS: timeBeforeS, calls: callsBefore } = before.get(name) ?? { timeS: 0, calls: 0n };
    const msATick = Math.max(0, (1000 * (timeS - timeBeforeS)) / ticks);
    return { name, msATick, callsATick: Math.max(0, Number(calls - callsBefore) / ticks), bytes: Number(bytes) };
  });
}

function counted(count: number, what: string): string {
  return `${count} ${what}${count === 1 ? "" : "s"}`;
}

function bytesText(bytes: number): string {
  if (bytes === 0) return "–";
  return bytes < 1e6 ? `${(bytes / 1000).toFixed(1)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}

function rowOf({ name, msATick, callsATick, bytes }: StageCost, allMs: number): HTMLTableRowElement {
  const row = document.createElement("tr");
  const head = document.createElement("th");
  head.scope = "row";
  head.textContent = name.replaceAll("_", " ");
  const bar = document.createElement("meter");
  bar.max = allMs || 1;
  bar.value = msATick;
  bar.title = `${((100 * msATick) / (allMs || 1)).toFixed(1)} % of the step`;
  const texts = [msATick.toFixed(3), callsATick.toFixed(callsATick % 1 < 0.05 ? 0 : 1), bytesText(bytes)];
  const cells = [bar, ...texts].map((content) => {
    const cell = document.createElement("td");
    cell.append(content);
    return cell;
  });
  row.append(head, ...cells);
  return row;
}

export class Plan {
  private answers: Stats[] = [];

  clear(): void {
    this.answers = [];
  }

  take({ stats }: Measured): void {
    if (stats.world !== this.answers.at(-1)?.world) this.answers = [];
    this.answers.push(stats);
    if (this.answers.length > answersMax) this.answers.shift();
    this.tellStep(stats);
    const costs = costsBetween(this.answers[0]!, stats);
    if (!costs) return;
    const used = costs.filter(({ callsATick, bytes }) => callsATick > 0 || bytes > 0);
    const unused = costs.filter((cost) => !used.includes(cost)).map(({ name }) => name.replaceAll("_", " "));
    const allMs = used.reduce((sum, { msATick }) => sum + msATick, 0);
    element("stages").replaceChildren(...used.map((cost) => rowOf(cost, allMs)));
    element("left-out").textContent = unused.length > 0 ? `Left out, at no cost: ${unused.join(", ")}.` : "";
  }

  private tellStep(stats: Stats): void {
    const budgetMs = 1000 / stats.rateHz;
    const facts: readonly (readonly [string, string])[] = [
      ["Integrator", stats.integrator.replaceAll("_", " ").toLowerCase()],
      ["Substeps a tick", `${stats.substeps}: ${stats.substepsReason}`],
      [
        "Step",
        `${stats.stepTimeMs.toFixed(2)} ms, at most ${stats.stepTimeMaxMs.toFixed(2)}, of ${budgetMs.toFixed(1)} ms`,
      ],
      [
        "Encoding",
        `${stats.encodeTimeMs.toFixed(2)} ms, ${counted(stats.qualityClasses, "stream")}, ${counted(stats.subscribers, "reader")}`,
      ],
      ["Pace", `${stats.timeRatio.toFixed(2)} of real time, ${stats.slippedS.toFixed(1)} s behind in all`],
    ];
    element("step-facts").replaceChildren(
      ...facts.flatMap(([term, text]) => [
        Object.assign(document.createElement("dt"), { textContent: term }),
        Object.assign(document.createElement("dd"), { textContent: text }),
      ]),
    );
  }
}
