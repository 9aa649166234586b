/** The runs that are shown, and what is told of their trains. */

import { state } from "./state.js";
import { clock, kilometres, kmh, signed } from "./telling.js";
import { reasonWord, stationName, word } from "./words.js";

/**
 * @typedef {import("./model.js").Result} Result
 * @typedef {import("./model.js").Run} Run
 */

/**
 * The runs that are shown, the baseline first.
 * @param {Result} result
 * @returns {{run: Run, index: number}[]}
 */
export function shownRuns(result) {
  return result.controllers
    .map(({ name }, index) => ({ run: result.run(name, state.key), index, name }))
    .filter(({ run, name }) => run && state.shown.includes(name))
    .map(({ run, index }) => ({ run: /** @type {Run} */ (run), index }));
}

/**
 * The widest span of all shown runs.
 * @param {Result} result
 * @returns {[number, number]}
 */
export function spanOf(result) {
  const runs = result.runs.filter((/** @type {Run} */ run) => run.key === state.key);
  const spans = (runs.length ? runs : result.runs).slice(0, 3).map((/** @type {Run} */ run) => run.span_s);
  if (!spans.length) return [0, 3600];
  const start_s = Math.min(...spans.map((/** @type {number[]} */ span) => span[0]));
  const end_s = Math.max(...spans.map((/** @type {number[]} */ span) => span[1]));
  return [start_s - 60, end_s + 60];
}

/**
 * Where a train was by its calls alone.
 * @param {Run} run
 * @param {string} train
 * @param {number} time_s
 * @returns {number}
 */
export function placeByCalls(run, train, time_s) {
  const arrival_s = run.calls.numbers("arrival_s");
  const departure_s = run.calls.numbers("departure_s");
  const stop_m = run.calls.numbers("stop_m");
  let before = null;
  for (const row of run.callsOf.get(train) ?? []) {
    for (const at_s of [arrival_s[row], departure_s[row]]) {
      if (!Number.isFinite(at_s)) continue;
      const here = { at_s, place_m: stop_m[row] };
      if (at_s >= time_s && before) {
        const share = at_s > before.at_s ? (time_s - before.at_s) / (at_s - before.at_s) : 0;
        return before.place_m + share * (here.place_m - before.place_m);
      }
      if (at_s > time_s) return NaN;
      before = here;
    }
  }
  return NaN;
}

/** @param {Result} result @param {string} train @returns {number} */
export function trainLength(result, train) {
  const { type_of: types = {}, train_types: told = {} } = result.line;
  return told[types[train]]?.length_m ?? 0;
}

/**
 * What is told of a train at a moment.
 * @param {Result} result
 * @param {Run} run
 * @param {string} train
 * @param {number} time_s
 * @returns {string[]}
 */
export function tellTrain(result, run, train, time_s) {
  const lines = [`${train} · ${run.controller.replaceAll("_", " ")}`, clock(time_s)];
  const trip = run.trips.get(train);
  const index = trip ? trip.at(time_s) : -1;
  if (trip && index >= 0) {
    lines.push(`${kilometres(trip.front_m[index])}, ${kmh(trip.speed_mps[index])}`);
    const cause = trip.text("cause", index);
    const told = reasonWord(trip.text("reason", index), trip.text("plan", index));
    lines.push(cause ? `${told} (${cause})` : told);
  }
  const call = run.lastCall(train, time_s);
  if (call >= 0) {
    const station = result.stationOf.get(run.calls.text("station", call));
    const here = run.calls.numbers("departure_s")[call] > time_s;
    const name = station ? stationName(station) : run.calls.text("station", call);
    lines.push(`${here ? "" : "← "}${name}, ${word("delay")} ${signed(run.delayAt(train, time_s), 0)} s`);
  }
  return lines;
}
