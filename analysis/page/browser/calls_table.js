/** The calls of a train as a table. */

import { el, table } from "./elements.js";
import { state } from "./state.js";
import { clock, signed } from "./telling.js";
import { stationName, word } from "./words.js";

/** @typedef {import("./model.js").Result} Result */

/**
 * The calls of the chosen train.
 * @param {Result} result
 * @returns {HTMLElement}
 */
export function callsTable(result) {
  const run = result.run(state.focus, state.key);
  const rows = run?.callsOf.get(state.train) ?? [];
  if (!run) return el("p", {}, "–");
  const { calls } = run;
  const time = (/** @type {string} */ name, /** @type {number} */ row) => clock(calls.numbers(name)[row]);
  const delay = (/** @type {string} */ name, /** @type {number} */ row) => signed(calls.numbers(name)[row], 1);
  return table({
    caption: `${word("calls")}: ${state.train}, ${run.controller} [s]`,
    head: ["station", "track", "booked_arrival", "arrival", "arrival_delay", "booked_departure", "departure", "departure_delay", "dwell_delay", "primary_delay", "secondary_delay"].map((key) => word(key)),
    rows: rows.map((row) => {
      const station = result.stationOf.get(calls.text("station", row));
      return [
        station ? stationName(station) : calls.text("station", row),
        calls.text("track", row),
        time("booked_arrival_s", row),
        time("arrival_s", row),
        delay("arrival_delay_s", row),
        time("booked_departure_s", row),
        time("departure_s", row),
        delay("departure_delay_s", row),
        delay("dwell_delay_s", row),
        delay("primary_delay_s", row),
        delay("secondary_delay_s", row),
      ];
    }),
  });
}
