/** Distributions over seeds: a dot for each run, mean and interval. */

import { choice, el, fill, svg } from "./elements.js";
import { pen } from "./colours.js";
import { mean, number, roundStep } from "./telling.js";
import { indicatorName, word } from "./words.js";

/**
 * @typedef {import("./model.js").Result} Result
 * @typedef {import("./overview.js").Indicator} Indicator
 */

const ROW = 30;
const MOST_DOTS = 400;

/**
 * @param {Result} result
 * @param {Indicator[]} indicators
 * @returns {HTMLElement}
 */
export function seedBySeed(result, indicators) {
  const shown = indicators.filter(({ label, name }) => label && result.summary.has(name));
  const drawing = el("div", {});
  const draw = (/** @type {string} */ name) => {
    const indicator = shown.find((one) => one.name === name) ?? shown[0];
    fill(drawing, chart(result, indicator));
  };
  draw(shown[0].name);
  return el(
    "div",
    {},
    el("h3", {}, word("over_seeds")),
    el("p", { class: "quiet" }, word("over_seeds_told")),
    choice({
      id: "seed-indicator",
      label: word("indicator"),
      options: shown.map((one) => [one.name, indicatorName(one)]),
      value: shown[0].name,
      onchange: draw,
    }),
    drawing,
  );
}

/** @param {Result} result @param {Indicator} indicator */
function chart(result, indicator) {
  const { codes, texts } = result.summary.texts("controller");
  const values = result.summary.numbers(indicator.name);
  /** @type {Map<string, number[]>} */
  const of = new Map(result.controllers.map(({ name }) => [name, []]));
  values.forEach((value, row) => {
    if (Number.isFinite(value)) of.get(texts[codes[row]])?.push(value);
  });
  const all = [...of.values()].flat();
  const low = Math.min(...all, 0);
  const high = Math.max(...all, low + 1e-9);
  const [width, left, right] = window.innerWidth < 700 ? [420, 150, 80] : [900, 230, 90];
  const height = ROW * of.size + 40;
  const x = (/** @type {number} */ value) => left + ((value - low) / (high - low)) * (width - left - right);
  const drawn = [];
  const step = roundStep(high - low, 8);
  for (let value = Math.ceil(low / step) * step; value <= high; value += step) {
    drawn.push(svg("line", { x1: x(value), x2: x(value), y1: 8, y2: height - 26, class: "grid" }));
    drawn.push(svg("text", { x: x(value), y: height - 10, "text-anchor": "middle", class: "tickmark" }, number(value, step < 1 ? 2 : 0)));
  }
  let index = 0;
  for (const [name, own] of of) {
    drawn.push(...strip(name, own, index, x, [left, width - right]));
    index += 1;
  }
  return svg(
    "svg",
    { viewBox: `0 0 ${width} ${height}`, class: "chart wide", role: "img", "aria-label": `${indicatorName(indicator)}. ${word("over_seeds_told")}` },
    drawn,
  );
}

/** @param {string} name @param {number[]} own @param {number} index @param {(value: number) => number} x @param {[number, number]} edges */
function strip(name, own, index, x, [left, right]) {
  const y = 22 + ROW * index;
  const { colour } = pen(index);
  const drawn = [
    svg("text", { x: left - 8, y: y + 4, "text-anchor": "end", class: "label" }, name.replaceAll("_", " ")),
  ];
  const every = Math.max(Math.ceil(own.length / MOST_DOTS), 1);
  own.forEach((value, at) => {
    if (at % every) return;
    const beside = 7 * Math.sin(2.4 * at);
    drawn.push(svg("circle", { cx: x(value), cy: y + beside, r: 2.6, fill: colour, opacity: 0.45 }));
  });
  if (!own.length) return drawn;
  const { middle, half } = meanOf(own);
  drawn.push(svg("line", { x1: x(middle - half), x2: x(middle + half), y1: y, y2: y, stroke: "var(--ink)", "stroke-width": 3 }));
  drawn.push(svg("line", { x1: x(middle), x2: x(middle), y1: y - 9, y2: y + 9, stroke: "var(--ink)", "stroke-width": 2 }));
  drawn.push(svg("text", { x: right + 8, y: y + 4, class: "tickmark" }, `${mean(middle)} ± ${mean(half)}`));
  return drawn;
}

/**
 * Mean of values, and half the width of its 95 % interval (Student).
 * @param {number[]} values
 * @returns {{middle: number, half: number}}
 */
export function meanOf(values) {
  const count = values.length;
  const middle = values.reduce((sum, value) => sum + value, 0) / count;
  if (count < 2) return { middle, half: 0 };
  const squares = values.reduce((sum, value) => sum + (value - middle) ** 2, 0);
  return { middle, half: (student(count - 1) * Math.sqrt(squares / (count - 1))) / Math.sqrt(count) };
}

/**
 * Student's quantile of 97.5 % (Cornish and Fisher: Abramowitz and Stegun 26.7.5).
 * @param {number} freedom
 * @returns {number}
 */
export function student(freedom) {
  const exact = [12.7062047, 4.3026527, 3.1824463, 2.7764451, 2.5705818];
  if (freedom <= exact.length) return exact[freedom - 1];
  const z = 1.959963984540054;
  const g1 = (z ** 3 + z) / 4;
  const g2 = (5 * z ** 5 + 16 * z ** 3 + 3 * z) / 96;
  const g3 = (3 * z ** 7 + 19 * z ** 5 + 17 * z ** 3 - 15 * z) / 384;
  const g4 = (79 * z ** 9 + 776 * z ** 7 + 1482 * z ** 5 - 1920 * z ** 3 - 945 * z) / 92160;
  return z + g1 / freedom + g2 / freedom ** 2 + g3 / freedom ** 3 + g4 / freedom ** 4;
}
