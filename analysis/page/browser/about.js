/** Published figures, provenance, and how to cite. */

import { el, fill, opening, svg, table } from "./elements.js";
import { meanings } from "./overview.js";
import { pen } from "./colours.js";
import { mean, number, roundStep, signed } from "./telling.js";
import { word } from "./words.js";

/**
 * @typedef {import("./model.js").Result} Result
 * @typedef {{controller: string, indicator: string, unit: string, value: number | null, published: number | null}} Swept
 */

/**
 * @param {Result} result
 * @returns {HTMLElement}
 */
export function papers(result) {
  const told = result.told.published;
  if (!told) return el("div", {}, el("p", { class: "quiet" }, word("no_papers")));
  const rows = /** @type {Swept[]} */ (told.rows);
  return el(
    "div",
    {},
    told.source ? el("p", {}, told.source) : null,
    table({
      caption: word("papers"),
      head: [word("controller"), word("indicator"), word("ours"), word("published"), word("deviation")],
      rows: rows.map((row) => [
        row.controller.replaceAll("_", " "),
        `${row.indicator.replaceAll("_", " ")}${row.unit ? ` [${row.unit}]` : ""}`,
        row.value === null ? "–" : mean(row.value),
        row.published === null ? "–" : mean(row.published),
        row.value === null || row.published === null ? "–" : signed(row.value - row.published, 2),
      ]),
    }),
    intervals(result, told.intervals),
  );
}

/** @param {Result} result @param {{controller: string, initial_delay_s: number, interval_s: number | null}[]} rows */
function intervals(result, rows) {
  const known = rows.filter((row) => row.interval_s !== null);
  if (known.length < 2) return null;
  const [width, height, left, bottom] = [620, 320, 56, 40];
  const xs = known.map((row) => row.initial_delay_s);
  const ys = known.map((row) => /** @type {number} */ (row.interval_s));
  const [x1, y0, y1] = [Math.max(...xs, 1), Math.min(...ys) * 0.97, Math.max(...ys) * 1.02];
  const x = (/** @type {number} */ value) => left + (value / x1) * (width - left - 16);
  const y = (/** @type {number} */ value) => height - bottom - ((value - y0) / (y1 - y0)) * (height - bottom - 26);
  const drawn = [];
  for (let value = 0, step = roundStep(x1, 7); value <= x1; value += step) {
    drawn.push(svg("line", { x1: x(value), x2: x(value), y1: 26, y2: height - bottom, class: "grid" }));
    drawn.push(svg("text", { x: x(value), y: height - bottom + 16, "text-anchor": "middle", class: "tickmark" }, number(value, 0)));
  }
  for (let step = roundStep(y1 - y0, 6), value = Math.ceil(y0 / step) * step; value <= y1; value += step) {
    drawn.push(svg("line", { x1: left, x2: width - 16, y1: y(value), y2: y(value), class: "grid" }));
    drawn.push(svg("text", { x: left - 6, y: y(value) + 4, "text-anchor": "end", class: "tickmark" }, number(value, step < 1 ? 1 : 0)));
  }
  result.controllers.forEach(({ name }, index) => {
    const own = known.filter((row) => row.controller === name);
    const path = own.map((row, at) => `${at ? "L" : "M"}${x(row.initial_delay_s)},${y(/** @type {number} */ (row.interval_s))}`).join("");
    drawn.push(svg("path", { d: path, fill: "none", stroke: pen(index).colour, "stroke-width": 2, "stroke-dasharray": pen(index).dash.join(" ") || null }, svg("title", {}, name)));
  });
  drawn.push(svg("text", { x: left, y: 14, class: "title" }, `${word("interval")} [s]`));
  drawn.push(svg("text", { x: width - 16, y: height - 6, class: "title", "text-anchor": "end" }, `${word("initial_delay")} [s]`));
  return el(
    "div",
    {},
    el("h3", {}, word("intervals_by_delay")),
    svg("svg", { viewBox: `0 0 ${width} ${height}`, class: "chart", role: "img", "aria-label": word("intervals_by_delay") }, drawn),
    el("ul", { class: "legend" }, result.controllers.map(({ name }, index) => el("li", {}, el("span", { class: "swatch", style: { background: pen(index).colour } }), name.replaceAll("_", " ")))),
  );
}

/**
 * @param {Result} result
 * @param {import("./overview.js").Indicator[]} indicators
 * @param {{text: string, bibtex: string, papers: string[]}} cite
 * @returns {HTMLElement}
 */
export function about(result, indicators, cite) {
  const facts = flat(result.told.provenance);
  return el(
    "div",
    {},
    el("h3", {}, word("cite")),
    el("p", {}, cite.text),
    quoted(cite.bibtex),
    cite.papers.length ? [el("p", {}, word("cite_papers")), el("ul", {}, cite.papers.map((paper) => el("li", {}, paper)))] : null,
    opening(word("provenance"), () =>
      table({ caption: word("provenance"), head: [word("key"), word("value")], rows: facts, numbers: false }),
    ),
    opening(word("meanings"), () => meanings(indicators)),
  );
}

/** @param {string} text @returns {HTMLElement} */
function quoted(text) {
  const button = el("button", { type: "button" }, word("copy"));
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(text);
      fill(button, word("copied"));
    } catch {
      getSelection()?.selectAllChildren(code);
    }
  });
  const code = el("pre", { tabindex: "0" }, text);
  return el("div", { class: "quoted" }, code, button);
}

/**
 * Keys of nested values, joined; long lists are counted.
 * @param {any} value
 * @param {string} [key]
 * @returns {[string, string][]}
 */
export function flat(value, key = "") {
  if (Array.isArray(value) && value.some((item) => typeof item === "object" && item !== null)) {
    return [[key, `${value.length}`]];
  }
  if (Array.isArray(value)) return [[key, value.join(", ")]];
  if (typeof value === "object" && value !== null) {
    return Object.entries(value).flatMap(([name, item]) => flat(item, key ? `${key}.${name}` : name));
  }
  return [[key, String(value)]];
}
