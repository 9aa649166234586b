/** What each controller gains in stops and gives up in delay, energy and crawl. */

import { el, svg } from "./elements.js";
import { pen } from "./colours.js";
import { roundStep, signed } from "./telling.js";
import { indicatorName, word } from "./words.js";

/**
 * @typedef {import("./model.js").Result} Result
 * @typedef {import("./overview.js").Indicator} Indicator
 * @typedef {{name: string, index: number, x: number, y: number, half_x: number, half_y: number,
 *   good: boolean, future: boolean, safe: boolean}} Point
 */

const ACROSS = "interstation_stop_time_s";
const UP = ["mean_arrival_delay_s", "energy_net_kwh", "interstation_crawl_time_s"];
const SIZE = { width: 390, height: 330, left: 60, right: 16, top: 30, bottom: 44 };

/**
 * @param {Result} result
 * @param {Indicator[]} indicators
 * @returns {HTMLElement}
 */
export function gains(result, indicators) {
  const baseline = result.controllers[0].name;
  const panels = UP.map((up) => panel(result, indicators, up)).filter(Boolean);
  const legend = result.controllers.map(({ name, knows_future }, index) =>
    el(
      "li",
      {},
      el("span", { class: "swatch", style: { background: pen(index).colour } }),
      `${index + 1} ${name.replaceAll("_", " ")}${knows_future ? ` ☆ ${word("knows_future")}` : ""}`,
    ),
  );
  return el(
    "div",
    {},
    el("h3", {}, word("gains")),
    el("p", { class: "quiet" }, word("gains_told", { baseline })),
    el("div", { class: "panels" }, panels),
    el("ul", { class: "legend" }, legend),
  );
}

/** A change in per cent where that means something, else in the unit. @param {any} row @param {string} indicator @param {boolean} inPercent */
function changeOf(row, indicator, inPercent) {
  const cut = indicator.lastIndexOf("_");
  const [stem, unit] = [indicator.slice(0, cut), indicator.slice(cut + 1)];
  const names = inPercent
    ? [`${stem}_change_pct`, `${stem}_change_confidence_95_pct`]
    : [`${stem}_difference_${unit}`, `${stem}_confidence_95_${unit}`];
  return names.map((name) => (row[name] === null || row[name] === undefined ? NaN : row[name]));
}

/** @param {Result} result @param {Indicator[]} indicators @param {string} up */
function panel(result, indicators, up) {
  const rows = result.told.across;
  const percent = (/** @type {string} */ name) =>
    rows.every((/** @type {any} */ row) => !Number.isFinite(row[name] ?? NaN) || Number.isFinite(changeOf(row, name, true)[0]));
  const [percentX, percentY] = [percent(ACROSS), percent(up)];
  /** @type {Point[]} */
  const points = rows
    .map((/** @type {any} */ row, /** @type {number} */ index) => {
      const [x, half_x] = changeOf(row, ACROSS, percentX);
      const [y, half_y] = changeOf(row, up, percentY);
      const good = result.told.undominated.includes(row.controller);
      return { name: row.controller, index, x, y, half_x, half_y, good, future: row.knows_future, safe: row.violations === 0 };
    })
    .filter((/** @type {Point} */ point) => point.safe && Number.isFinite(point.x) && Number.isFinite(point.y));
  if (points.length < 2) return null;
  const unit = (/** @type {string} */ name, /** @type {boolean} */ isPercent) =>
    isPercent ? "%" : (indicators.find((one) => one.name === name)?.unit ?? "");
  return chart(points, {
    x: axisOf(indicators, ACROSS, percentX ? "%" : unit(ACROSS, false)),
    y: axisOf(indicators, up, percentY ? "%" : unit(up, false)),
  });
}

/** @param {Indicator[]} indicators @param {string} name @param {string} unit */
function axisOf(indicators, name, unit) {
  const found = indicators.find((one) => one.name === name);
  return indicatorName({ name, label: found?.label ?? name, unit });
}

/** @param {Point[]} points @param {"x" | "y"} axis @returns {[number, number]} */
function rangeOf(points, axis) {
  const half = axis === "x" ? "half_x" : "half_y";
  const values = points.flatMap((point) => {
    const around = Number.isFinite(point[half]) ? point[half] : 0;
    return [point[axis] - around, point[axis] + around];
  });
  values.push(0);
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const edge = 0.08 * (high - low || 1);
  return [low - edge, high + edge];
}

/** @param {Point[]} points @param {{x: string, y: string}} titles */
function chart(points, titles) {
  const { width, height, left, right, top, bottom } = SIZE;
  const [x0, x1] = rangeOf(points, "x");
  const [y0, y1] = rangeOf(points, "y");
  const x = (/** @type {number} */ value) => left + ((value - x0) / (x1 - x0)) * (width - left - right);
  const y = (/** @type {number} */ value) => height - bottom - ((value - y0) / (y1 - y0)) * (height - top - bottom);
  const drawn = [...grid(x0, x1, y0, y1, x, y), ...front(points, x, y)];
  drawn.push(...labels(points, x, y));
  for (const point of points) drawn.push(...mark(point, x, y));
  drawn.push(
    svg("text", { x: left, y: 14, class: "title" }, titles.y),
    svg("text", { x: width - right, y: height - 8, class: "title", "text-anchor": "end" }, titles.x),
  );
  const told = points.map((p) => `${p.name} ${signed(p.x)} / ${signed(p.y)}`).join("; ");
  return svg(
    "svg",
    { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${titles.y} / ${titles.x}: ${told}`, class: "chart" },
    drawn,
  );
}

/** @typedef {(value: number) => number} Scale */

/** @param {number} x0 @param {number} x1 @param {number} y0 @param {number} y1 @param {Scale} x @param {Scale} y */
function grid(x0, x1, y0, y1, x, y) {
  const { width, height, left, right, top, bottom } = SIZE;
  const drawn = [];
  const [dx, dy] = [roundStep(x1 - x0, 5), roundStep(y1 - y0, 6)];
  const decimals = (/** @type {number} */ step) => (step < 1 ? 1 : 0);
  for (let value = Math.ceil(x0 / dx) * dx; value <= x1; value += dx) {
    const strong = Math.abs(value) < dx / 1000 ? "zero" : "grid";
    drawn.push(svg("line", { x1: x(value), x2: x(value), y1: top, y2: height - bottom, class: strong }));
    drawn.push(svg("text", { x: x(value), y: height - bottom + 15, "text-anchor": "middle", class: "tickmark" }, signed(value, decimals(dx))));
  }
  for (let value = Math.ceil(y0 / dy) * dy; value <= y1; value += dy) {
    const strong = Math.abs(value) < dy / 1000 ? "zero" : "grid";
    drawn.push(svg("line", { x1: left, x2: width - right, y1: y(value), y2: y(value), class: strong }));
    drawn.push(svg("text", { x: left - 6, y: y(value) + 4, "text-anchor": "end", class: "tickmark" }, signed(value, decimals(dy))));
  }
  return drawn;
}

/** The line of those that nobody beats in both. @param {Point[]} points @param {Scale} x @param {Scale} y */
function front(points, x, y) {
  const competing = points.filter((point) => !point.future);
  const best = competing
    .filter((one) => !competing.some((other) => other.x <= one.x && other.y <= one.y && (other.x < one.x || other.y < one.y)))
    .sort((a, b) => a.x - b.x);
  const path = best.map((point, index) => `${index ? "L" : "M"}${x(point.x)},${y(point.y)}`).join("");
  return best.length > 1 ? [svg("path", { d: path, class: "front" })] : [];
}

/** @param {Point} point @param {Scale} x @param {Scale} y */
function mark(point, x, y) {
  const { colour } = pen(point.index);
  const drawn = [];
  if (Number.isFinite(point.half_x) && point.half_x > 0) {
    drawn.push(svg("line", { x1: x(point.x - point.half_x), x2: x(point.x + point.half_x), y1: y(point.y), y2: y(point.y), stroke: colour, "stroke-width": 1.2 }));
  }
  if (Number.isFinite(point.half_y) && point.half_y > 0) {
    drawn.push(svg("line", { x1: x(point.x), x2: x(point.x), y1: y(point.y - point.half_y), y2: y(point.y + point.half_y), stroke: colour, "stroke-width": 1.2 }));
  }
  const fillOf = point.good && !point.future ? colour : "var(--paper)";
  const title = svg("title", {}, `${point.name}: ${signed(point.x)}, ${signed(point.y)}`);
  const shape = point.future
    ? svg("text", { x: x(point.x), y: y(point.y) + 5, "text-anchor": "middle", fill: colour, "font-size": 16 }, "☆", title)
    : svg("circle", { cx: x(point.x), cy: y(point.y), r: 5.5, fill: fillOf, stroke: colour, "stroke-width": 2 }, title);
  return [...drawn, shape];
}

/** Where a label may stand beside its mark, nearest first. */
const PLACES = [14, 24, 36, 50].flatMap((far) =>
  [0, 1, 7, 2, 6, 4, 3, 5].map((turn) => [far * Math.cos((turn * Math.PI) / 4), -far * Math.sin((turn * Math.PI) / 4)]),
);

/** The number of each controller beside its mark, where there is room. @param {Point[]} points @param {Scale} x @param {Scale} y */
function labels(points, x, y) {
  const marks = points.map((point) => ({ x: x(point.x), y: y(point.y), half: 7 }));
  /** @type {{x: number, y: number, half: number}[]} */
  const taken = [...marks];
  return points.flatMap((point, index) => {
    const { x: x0, y: y0 } = marks[index];
    const half = point.index > 8 ? 8 : 5;
    const inside = (/** @type {number} */ u, /** @type {number} */ v) =>
      u > SIZE.left && u < SIZE.width - 8 && v > SIZE.top - 6 && v < SIZE.height - SIZE.bottom;
    const free = PLACES.map(([dx, dy]) => [x0 + dx, y0 + dy]).find(
      ([u, v]) => inside(u, v) && !taken.some((other) => Math.abs(other.x - u) < other.half + half && Math.abs(other.y - v) < 12),
    );
    const [u, v] = free ?? [x0 + 14, y0];
    taken.push({ x: u, y: v, half });
    const far = Math.hypot(u - x0, v - y0) > 18;
    return [
      far ? svg("line", { x1: x0, y1: y0, x2: u, y2: v, class: "zero", "stroke-width": 0.6 }) : null,
      svg("text", { x: u, y: v + 4, "text-anchor": "middle", class: "label" }, String(point.index + 1)),
    ].filter((one) => one !== null);
  });
}
