/** Who delayed whom: a tree from every origin of delay. */

import { el } from "./elements.js";
import { choose } from "./state.js";
import { clock, number } from "./telling.js";
import { stationName, word } from "./words.js";

/**
 * @typedef {import("./model.js").Result} Result
 * @typedef {import("./model.js").Run} Run
 * @typedef {{train: string, lost_s: number, time_s: number, below: Branch[]}} Branch
 * @typedef {{train: string, station: string, kind: string, lost_s: number, trains: number,
 *   below: Branch[]}} Origin
 */

const MOST_ORIGINS = 12;

/**
 * Origins of delay with the trains that each one reached, the most costly first.
 * @param {Run} run
 * @returns {Origin[]}
 */
export function originsOf(run) {
  const { edges } = run;
  const [lost_s, time_s] = [edges.numbers("lost_s"), edges.numbers("time_s")];
  /** @type {Map<string, number[]>} */
  const groups = new Map();
  for (let row = 0; row < edges.rows; row++) {
    const key = ["origin_train", "origin_station", "origin_kind"].map((name) => edges.text(name, row)).join("\n");
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key)?.push(row);
  }
  const origins = [...groups].map(([key, rows]) => {
    const [train, station, kind] = key.split("\n");
    /** @type {Map<string, Branch>} */
    const known = new Map();
    /** @type {Branch[]} */
    const below = [];
    for (const row of [...rows].sort((a, b) => time_s[a] - time_s[b])) {
      const name = edges.text("train", row);
      const found = known.get(name);
      if (found) {
        found.lost_s += lost_s[row];
        continue;
      }
      const branch = { train: name, lost_s: lost_s[row], time_s: time_s[row], below: [] };
      known.set(name, branch);
      const by = edges.text("by", row);
      (by === train ? below : (known.get(by)?.below ?? below)).push(branch);
    }
    const total_s = rows.reduce((sum, row) => sum + lost_s[row], 0);
    return { train, station, kind, lost_s: total_s, trains: known.size, below };
  });
  return origins.sort((a, b) => b.lost_s - a.lost_s);
}

/**
 * @param {Result} result
 * @param {Run} run
 * @returns {HTMLElement}
 */
export function delayTree(result, run) {
  const origins = originsOf(run).filter((origin) => origin.lost_s >= 0.5);
  if (!origins.length) return el("p", {}, word(run.trips.size ? "nobody_delayed" : "no_tree"));
  const items = origins.map((origin) => {
    const { train, station, kind, lost_s, trains, below } = origin;
    const place = result.stationOf.get(station);
    const how = word(kind, { station: place ? stationName(place) : station });
    return el(
      "details",
      { class: "origin" },
      el(
        "summary",
        {},
        el("strong", {}, train || "–"),
        ` ${how}: `,
        word(trains === 1 ? "costs_one" : "costs_others", { seconds: number(lost_s, 0), trains }),
        el("span", { class: "bar", style: { width: `${(100 * lost_s) / origins[0].lost_s}%` } }),
      ),
      branches(run, below),
    );
  });
  const [first, rest] = [items.slice(0, MOST_ORIGINS), items.slice(MOST_ORIGINS)];
  /** @type {HTMLDetailsElement} */ (first[0]).open = true;
  return el(
    "div",
    { id: "delay-tree" },
    first,
    rest.length ? el("details", {}, el("summary", {}, word("more_origins", { count: rest.length })), rest) : null,
  );
}

/** @param {Run} run @param {Branch[]} below @returns {HTMLElement} */
function branches(run, below) {
  return el(
    "ul",
    { class: "branches" },
    below.map(({ train, lost_s, time_s, below: next }) =>
      el(
        "li",
        {},
        el(
          "button",
          { type: "button", class: "link", onclick: () => choose({ train, time_s, focus: run.controller }) },
          train,
        ),
        ` +${number(lost_s, 1)} s, ${clock(time_s)}`,
        next.length ? branches(run, next) : null,
      ),
    ),
  );
}
