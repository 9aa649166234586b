/** Headways and dwells by station. */

import { el, svg } from "./elements.js";
import { shownRuns } from "./runs.js";
import { pen as penOf } from "./colours.js";
import { number, roundStep } from "./telling.js";
import { stationName, word } from "./words.js";

/**
 * @typedef {import("./model.js").Result} Result
 * @typedef {import("./model.js").Run} Run
 */

/**
 * Values at a share of the way from least to greatest.
 * @param {number[]} rising
 * @param {number} share
 * @returns {number}
 */
export function quantile(rising, share) {
  const place = share * (rising.length - 1);
  const low = Math.floor(place);
  const high = Math.min(low + 1, rising.length - 1);
  return rising[low] + (place - low) * (rising[high] - rising[low]);
}

/**
 * Departure of a train to the arrival of the next one at the same platform track, and dwells.
 * @param {Run} run
 * @returns {Map<string, {intervals_s: number[], dwells_s: number[]}>} by station
 */
export function stationTimes(run) {
  const { calls } = run;
  const [arrival_s, departure_s] = [calls.numbers("arrival_s"), calls.numbers("departure_s")];
  const sequence = calls.numbers("sequence");
  /** @type {Map<string, number[]>} */
  const at = new Map();
  const found = new Map();
  for (let row = 0; row < calls.rows; row++) {
    const station = calls.text("station", row);
    const place = `${station}\n${calls.text("track", row)}`;
    if (!found.has(station)) found.set(station, { intervals_s: [], dwells_s: [] });
    if (!at.has(place)) at.set(place, []);
    at.get(place)?.push(row);
    const dwell_s = departure_s[row] - arrival_s[row];
    if (sequence[row] > 0 && Number.isFinite(dwell_s)) found.get(station).dwells_s.push(dwell_s);
  }
  for (const [place, rows] of at) {
    const known = rows.filter((row) => Number.isFinite(arrival_s[row])).sort((a, b) => arrival_s[a] - arrival_s[b]);
    for (let i = 1; i < known.length; i++) {
      const interval_s = arrival_s[known[i]] - departure_s[known[i - 1]];
      if (Number.isFinite(interval_s)) found.get(place.split("\n")[0]).intervals_s.push(interval_s);
    }
  }
  return found;
}

/** @param {Result} result @returns {HTMLElement} */
export function headways(result) {
  const runs = shownRuns(result).map(({ run, index }) => ({ index, run, times: stationTimes(run) }));
  const panels = /** @type {const} */ (["interval", "dwell"]).map((kind) => {
    const key = kind === "interval" ? "intervals_s" : "dwells_s";
    const bars = runs.map(({ index, run, times }) => ({
      index,
      name: run.controller,
      by: new Map([...times].map(([station, found]) => [station, [...found[key]].sort((a, b) => a - b)])),
    }));
    return bands(result, word(kind), bars);
  });
  return el("div", { class: "panels wide" }, panels);
}

const ruler = /** @type {CanvasRenderingContext2D} */ (document.createElement("canvas").getContext("2d"));

/** A name that ends at a place and is squeezed where it would begin outside. @param {string} name @param {number} x @param {number} y */
function beside(name, x, y) {
  ruler.font = "11.5px system-ui, sans-serif";
  const squeezed = ruler.measureText(name).width > x - 2 ? { textLength: x - 2, lengthAdjust: "spacingAndGlyphs" } : {};
  return svg("text", { x, y, "text-anchor": "end", class: "label", ...squeezed }, name);
}

/** @param {Result} result @param {string} title @param {{index: number, name: string, by: Map<string, number[]>}[]} bars */
function bands(result, title, bars) {
  const { stations } = result;
  const row = Math.max(9 * bars.length + 6, 20);
  const [width, left, top] = window.innerWidth < 700 ? [380, 112, 26] : [560, 132, 26];
  const height = top + row * stations.length + 24;
  const most = Math.max(...bars.flatMap(({ by }) => [...by.values()].map((all) => (all.length ? quantile(all, 0.9) : 0))), 1);
  const x = (/** @type {number} */ value) => left + (Math.max(value, 0) / most) * (width - left - 16);
  const drawn = [svg("text", { x: left, y: 14, class: "title" }, `${title} [s]`)];
  const step = roundStep(most, 6);
  for (let value = 0; value <= most; value += step) {
    drawn.push(svg("line", { x1: x(value), x2: x(value), y1: top - 4, y2: height - 22, class: "grid" }));
    drawn.push(svg("text", { x: x(value), y: height - 8, "text-anchor": "middle", class: "tickmark" }, number(value, 0)));
  }
  stations.forEach((station, at) => {
    const y = top + row * at;
    drawn.push(beside(stationName(station), left - 8, y + row / 2 + 3));
    bars.forEach(({ index, name, by }, place) => {
      const all = by.get(station.id) ?? [];
      if (!all.length) return;
      const [low, middle, high] = [0.1, 0.5, 0.9].map((share) => quantile(all, share));
      const { colour } = penOf(index);
      const line = y + 7 + 9 * place;
      const told = `${name}, ${stationName(station)}: ${number(middle, 0)} s (${number(low, 0)} – ${number(high, 0)} s)`;
      drawn.push(
        svg(
          "g",
          {},
          svg("title", {}, told),
          svg("line", { x1: x(low), x2: x(high), y1: line, y2: line, stroke: colour, "stroke-width": 3, opacity: 0.55 }),
          svg("circle", { cx: x(middle), cy: line, r: 3.4, fill: colour }),
        ),
      );
    });
  });
  return svg("svg", { viewBox: `0 0 ${width} ${height}`, class: "chart tall", role: "img", "aria-label": `${title}. ${word("headways_told")}` }, drawn);
}
