/** Why a train was slow at a moment, from train to train, and whence its delay comes. */

import { el } from "./elements.js";
import { choose, state } from "./state.js";
import { clock, kilometres, kmh, number, signed } from "./telling.js";
import { reasonWord, stationName, word } from "./words.js";

/**
 * @typedef {import("./model.js").Result} Result
 * @typedef {import("./model.js").Run} Run
 * @typedef {import("./model.js").Trip} Trip
 * @typedef {{train: string, trip: Trip, index: number, since_s: number, cause: string}} Link
 * @typedef {{train: string, station: string, kind: string, lost_s: number}} Share
 */

const MOST_LINKS = 8;
const MOST_SHARES = 3;

/**
 * The chosen time, else when the train stood longest, else when it began. [s]
 * @param {Trip} trip
 * @returns {number}
 */
export function momentOf(trip) {
  if (trip.at(state.time_s) >= 0) return state.time_s;
  const { stops } = trip.run;
  const [start_s, duration_s] = [stops.numbers("start_s"), stops.numbers("duration_s")];
  let most = -1;
  duration_s.forEach((lasted_s, row) => {
    if (stops.text("train", row) === trip.train && (most < 0 || lasted_s > duration_s[most])) most = row;
  });
  return most < 0 ? trip.time_s[0] : start_s[most] + duration_s[most] / 2;
}

/**
 * When a train was slowest within a minute, but for its dwells. [s]
 * @param {Trip | undefined} trip
 * @param {number} minute_s when the minute begins
 * @returns {number}
 */
export function slowestIn(trip, minute_s) {
  if (!trip) return minute_s;
  const { time_s, speed_mps } = trip;
  let slowest = -1;
  for (let i = 0; i < trip.length; i++) {
    if (time_s[i] < minute_s || time_s[i] >= minute_s + 60 || trip.text("reason", i) === "dwelling") continue;
    if (slowest < 0 || speed_mps[i] < speed_mps[slowest]) slowest = i;
  }
  return slowest < 0 ? minute_s : time_s[slowest];
}

/**
 * A train at a moment, the train for which it was slow then, and so on.
 * @param {Run} run
 * @param {string} train
 * @param {number} time_s
 * @returns {Link[]}
 */
export function chainAt(run, train, time_s) {
  /** @type {Link[]} */
  const links = [];
  let name = train;
  while (links.length < MOST_LINKS && !links.some((link) => link.train === name)) {
    const trip = run.trips.get(name);
    const index = trip ? trip.at(time_s) : -1;
    if (!trip || index < 0) break;
    const cause = trip.text("cause", index);
    links.push({ train: name, trip, index, since_s: trip.time_s[since(trip, index)], cause });
    name = cause;
  }
  return links;
}

/**
 * The sample from which on the same thing has bound a train.
 * @param {Trip} trip
 * @param {number} index
 * @returns {number}
 */
function since(trip, index) {
  const told = (/** @type {number} */ at) => trip.text("reason", at) + trip.text("cause", at);
  let first = index;
  while (first > 0 && told(first - 1) === told(index)) first -= 1;
  return first;
}

/**
 * Whence the lateness of a train comes that it owes to others until a time, the largest part first.
 * @param {Run} run
 * @param {string} train
 * @param {number} [until_s]
 * @returns {Share[]}
 */
export function sharesOf(run, train, until_s = Infinity) {
  const { edges } = run;
  const [time_s, lost_s] = [edges.numbers("time_s"), edges.numbers("lost_s")];
  /** @type {Map<string, Share>} */
  const found = new Map();
  for (let row = 0; row < edges.rows; row++) {
    if (edges.text("train", row) !== train || time_s[row] > until_s) continue;
    const [from, station, kind] = ["origin_train", "origin_station", "origin_kind"].map((name) => edges.text(name, row));
    const key = `${from}\n${station}\n${kind}`;
    const share = found.get(key) ?? { train: from, station, kind, lost_s: 0 };
    share.lost_s += lost_s[row];
    found.set(key, share);
  }
  return [...found.values()].sort((a, b) => b.lost_s - a.lost_s);
}

/**
 * @param {Result} result
 * @param {Share[]} shares
 * @returns {string}
 */
export function sharesTold(result, shares) {
  return shares
    .filter(({ lost_s }) => lost_s >= 1)
    .slice(0, MOST_SHARES)
    .map(({ train, station, kind, lost_s }) => {
      const place = result.stationOf.get(station);
      const how = word(kind, { station: place ? stationName(place) : station });
      return `${train || "–"} ${how} (${number(lost_s, 0)} s)`;
    })
    .join("; ");
}

/**
 * The moment in words.
 * @param {Result} result
 * @param {Run} run
 * @param {string} train
 * @param {number} time_s
 * @returns {HTMLElement | null}
 */
export function moment(result, run, train, time_s) {
  const links = chainAt(run, train, time_s);
  if (!links.length) return null;
  const told = sharesTold(result, sharesOf(run, train));
  return el(
    "div",
    { class: "moment", id: "moment-told" },
    el("strong", {}, word("moment_at", { time: clock(time_s), controller: run.controller.replaceAll("_", " ") })),
    el("ol", {}, links.map((link) => linkTold(result, run, link, time_s))),
    told ? el("p", {}, word("owed_to", { train, told })) : null,
  );
}

/** @param {Result} result @param {Run} run @param {Link} link @param {number} time_s */
function linkTold(result, run, { train, trip, index, since_s, cause }, time_s) {
  const speed = trip.speed_mps[index];
  const dwelling = trip.text("reason", index) === "dwelling";
  const call = run.lastCall(train, time_s);
  const station = call >= 0 ? result.stationOf.get(run.calls.text("station", call)) : undefined;
  const over_s = call >= 0 ? run.calls.numbers("dwell_delay_s")[call] : NaN;
  const where = dwelling && station ? stationName(station) : kilometres(trip.front_m[index]);
  const reason = reasonWord(trip.text("reason", index), trip.text("plan", index));
  const parts = [
    where,
    dwelling ? "" : kmh(speed),
    cause ? `${reason} (${cause})` : reason,
    word("since", { time: clock(since_s) }),
    dwelling && over_s >= 1 ? word("overstays_by", { seconds: number(over_s, 0) }) : "",
    `${word("delay")} ${signed(run.delayAt(train, time_s), 0)} s`,
  ];
  return el(
    "li",
    {},
    el("button", { type: "button", class: "link", onclick: () => choose({ train, time_s }) }, train),
    `: ${parts.filter(Boolean).join(", ")}`,
  );
}
