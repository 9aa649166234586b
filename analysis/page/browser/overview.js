/** The head of the page: verdict, safety, comparison, what is gained and given up, seed by seed. */

import { el } from "./elements.js";
import { gains } from "./gains.js";
import { choose, state } from "./state.js";
import { pen } from "./colours.js";
import { indicatorName, word } from "./words.js";
import { seedBySeed } from "./seeds.js";

/**
 * @typedef {import("./model.js").Result} Result
 * @typedef {{controller: string, indicator: string, unit: string, pairs: number, mean: number | null,
 *   difference: number | null, confidence_95: number | null, change_pct: number | null,
 *   mark: "" | "better" | "worse" | "alike", best: boolean, mean_told: string,
 *   change_told: string}} Cell
 * @typedef {{name: string, label: string, unit: string, meaning: string, topic: string,
 *   sense: number}} Indicator
 */

const SIGNS = { better: "✓", worse: "✗", alike: "≈", "": "" };

/**
 * @param {Result} result
 * @param {Indicator[]} indicators
 * @param {Result[]} all
 * @returns {HTMLElement}
 */
export function overview(result, indicators, all) {
  const told = result.told;
  return el(
    "section",
    { id: "findings", "aria-labelledby": "findings-title" },
    el("h2", { id: "findings-title" }, word("verdict")),
    el("p", { class: "verdict" }, told.verdict[state.language]),
    el(
      "p",
      { class: told.safe ? "safety safe" : "safety unsafe", role: told.safe ? false : "alert" },
      el("span", { class: "sign", "aria-hidden": "true" }, told.safe ? "✓" : "✗"),
      el("strong", {}, `${word("safety")}: `),
      told.safety[state.language],
    ),
    notes(told.notes),
    troubles(result),
    all.length > 1 ? several(all) : null,
    el("h3", {}, word("comparison")),
    comparison(result, indicators),
    result.controllers.length > 1 ? gains(result, indicators) : null,
    told.seeds.length > 1 ? seedBySeed(result, indicators) : null,
  );
}

/**
 * @param {{en: string, ja: string}[]} told
 * @returns {HTMLElement | null}
 */
function notes(told) {
  if (!told.length) return null;
  return el(
    "aside",
    { class: "notes", "aria-label": word("notes") },
    el("strong", {}, word("notes")),
    el("ul", {}, told.map((note) => el("li", {}, note[state.language] ?? note.en))),
  );
}

/**
 * Broken safety rules and trains under way, by run.
 * @param {Result} result
 * @returns {HTMLElement | null}
 */
function troubles(result) {
  /** @type {HTMLElement[]} */
  const lines = [];
  for (const run of result.runs) {
    for (const table of [run.violations, run.unfinished]) {
      for (let row = 0; row < Math.min(table.rows, 20); row++) {
        lines.push(el("li", {}, `${run.controller}, ${word("seed")} ${run.seed}: ${table.text("message", row)}`));
      }
    }
  }
  return lines.length ? el("ul", { class: "troubles" }, lines.slice(0, 60)) : null;
}

/**
 * The table of all indicators and controllers.
 * @param {Result} result
 * @param {Indicator[]} indicators
 * @returns {HTMLElement}
 */
function comparison(result, indicators) {
  /** @type {Cell[]} */
  const cells = result.told.comparison;
  const of = new Map(cells.map((cell) => [`${cell.indicator}\n${cell.controller}`, cell]));
  const names = result.controllers.map(({ name }) => name);
  const rows = indicators.filter(({ name }) => of.has(`${name}\n${names[0]}`));
  const order = [...new Set(cells.map((cell) => cell.indicator))];
  rows.sort((a, b) => order.indexOf(a.name) - order.indexOf(b.name));
  const runs = result.told.seeds.length * Math.max(result.told.delays_s.length, 1);
  const several = cells.some((cell) => cell.confidence_95 !== null && cell.difference);
  const head = result.controllers.map((controller, index) => header(controller, index));
  const body = rows.map((indicator) =>
    el(
      "tr",
      { "data-indicator": indicator.name },
      el("th", { scope: "row", title: indicator.meaning }, indicatorName(indicator)),
      names.map((name) => valueCell(/** @type {Cell} */ (of.get(`${indicator.name}\n${name}`)), name === names[0])),
    ),
  );
  const caption = word(runs === 1 ? "comparison_one" : "comparison_told", { runs, baseline: names[0] }) + (several ? ` ${word("interval_told")}` : "");
  return el(
    "div",
    {},
    el("p", { class: "quiet" }, caption),
    el(
      "div",
      { class: "scroll", tabindex: "0", role: "region", "aria-label": word("comparison") },
      el(
        "table",
        { class: "numbers comparison", id: "comparison" },
        el("caption", { class: "hidden" }, caption),
        el("thead", {}, el("tr", {}, el("th", { scope: "col" }, word("indicator")), head)),
        el("tbody", {}, body),
      ),
    ),
  );
}

/** @param {Result["controllers"][number]} controller @param {number} index */
function header(controller, index) {
  const shown = state.shown.includes(controller.name);
  return el(
    "th",
    { scope: "col", "data-controller": controller.name },
    el("span", { class: "swatch", style: { background: pen(index).colour }, "aria-hidden": "true" }),
    controller.name.replaceAll("_", " "),
    index === 0 ? el("small", {}, word("baseline")) : null,
    controller.knows_future ? el("small", { title: word("knows_future") }, `☆ ${word("only_compared")}`) : null,
    controller.peer ? el("small", { title: word("peer_drives") }, `☆ ${word("only_compared")}`) : null,
    !controller.competes && !controller.knows_future && !controller.peer ? el("small", { class: "bad" }, word("not_competing")) : null,
    shown ? null : el("span", { class: "hidden" }, ""),
  );
}

/** @param {Cell} cell @param {boolean} isBaseline */
function valueCell(cell, isBaseline) {
  const mark = cell.mark;
  return el(
    "td",
    { class: `${mark} ${cell.best ? "best" : ""}`, "data-value": cell.mean, "data-difference": cell.difference },
    el(
      "span",
      { class: "value" },
      cell.best ? el("span", { class: "sign", title: word("best") }, "★") : null,
      cell.best ? el("span", { class: "hidden" }, `${word("best")} `) : null,
      cell.mean_told,
    ),
    isBaseline || cell.difference === null
      ? null
      : el(
          "span",
          { class: "change" },
          SIGNS[mark] ? el("span", { class: "sign", title: word(mark) }, SIGNS[mark]) : null,
          mark ? el("span", { class: "hidden" }, `${word(mark)} `) : null,
          cell.change_told,
        ),
  );
}

/**
 * All results side by side.
 * @param {Result[]} all
 * @returns {HTMLElement}
 */
function several(all) {
  const names = ["interstation_stop_time_s", "mean_arrival_delay_s", "energy_net_kwh"];
  const rows = all.flatMap((result, at) =>
    result.controllers.map(({ name }) => {
      const cells = names.map((indicator) =>
        result.told.comparison.find((/** @type {Cell} */ cell) => cell.controller === name && cell.indicator === indicator),
      );
      return el(
        "tr",
        {},
        el(
          "th",
          { scope: "row" },
          el("button", { type: "button", class: "link", onclick: () => choose({ result: at }) }, `${result.name}: ${name}`),
        ),
        cells.map((cell) => (cell ? valueCell(cell, name === result.controllers[0].name) : el("td", {}, "–"))),
      );
    }),
  );
  const head = names.map((name) => all[0].told.comparison.find((/** @type {Cell} */ cell) => cell.indicator === name));
  return el(
    "div",
    {},
    el("h3", {}, word("several")),
    el(
      "div",
      { class: "scroll", tabindex: "0", role: "region", "aria-label": word("several") },
      el(
        "table",
        { class: "numbers comparison" },
        el(
          "thead",
          {},
          el(
            "tr",
            {},
            el("th", { scope: "col" }, word("controller")),
            head.map((cell) => el("th", { scope: "col" }, cell ? indicatorName({ name: cell.indicator, label: "", unit: cell.unit }) : "")),
          ),
        ),
        el("tbody", {}, rows),
      ),
    ),
  );
}

/**
 * What every indicator means.
 * @param {Indicator[]} indicators
 * @returns {HTMLElement}
 */
export function meanings(indicators) {
  return el(
    "dl",
    {},
    indicators.filter(({ label }) => label).flatMap((one) => [el("dt", {}, indicatorName(one)), el("dd", {}, one.meaning)]),
  );
}
