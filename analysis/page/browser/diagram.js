/** The time-distance diagram (ダイヤ). */

import { el, fill, tick } from "./elements.js";
import { Frame } from "./frame.js";
import { choose, state } from "./state.js";
import { pen as penOf, themed } from "./colours.js";
import { lastNotAbove } from "./telling.js";
import { stationName, word } from "./words.js";
import { placeByCalls, shownRuns, spanOf, tellTrain, trainLength } from "./runs.js";

/**
 * @typedef {import("./model.js").Result} Result
 * @typedef {import("./model.js").Run} Run
 * @typedef {import("./model.js").Trip} Trip
 * @typedef {{run: Run, index: number, trip: Trip | null, train: string, distance: number}} Found
 */

const TOLERANCES_M = [60, 15, 4, 1];
const NEAR = 14;
const LEAST_DELAY_S = 20;
const MOST_AT_ONCE = 100;

export class Diagram {
  /** @param {Result} result */
  constructor(result) {
    this.result = result;
    this.span = spanOf(result);
    const [low_m, high_m] = result.extent_m;
    const edge_m = 0.03 * (high_m - low_m);
    const narrow = window.innerWidth < 700;
    this.frame = new Frame({
      label: word("diagram"),
      height: narrow ? 420 : 620,
      margins: { left: narrow ? 86 : 134, right: 20, top: 10, bottom: 24 },
      whole: () => [this.span[0], this.span[1], low_m - edge_m, high_m + edge_m],
      zoomY: true,
      axes: () => this.axes(),
      draw: () => this.draw(),
      heavy: () => shownRuns(this.result).reduce((sum, { run }) => sum + run.callsOf.size, 0) > MOST_AT_ONCE,
      hover: (x, y) => this.hover(x, y),
      pick: (x, y) => this.pick(x, y),
      key: (key) => this.key(key),
    });
    this.ticks = el("div", { class: "row" });
    this.note = el("p", { class: "quiet", hidden: true }, word("no_trajectory"));
    this.element = el("div", {}, this.ticks, this.note, this.frame.element);
    this.words();
  }

  /** Write the words again. */
  words() {
    const box = (/** @type {"booked"|"stops"|"delays"|"obstructions"|"bands"|"numbers"} */ name, /** @type {string} */ told) =>
      tick(word(told), state[name], (checked) => choose({ [name]: checked }));
    fill(
      this.ticks,
      box("booked", "booked"),
      box("stops", "stops_between"),
      box("delays", "injected"),
      box("obstructions", "obstructions"),
      box("bands", "bands"),
      box("numbers", "train_numbers"),
    );
  }

  axes() {
    const { frame } = this;
    const [first] = shownRuns(this.result);
    this.note.hidden = !first || first.run.trips.size > 0;
    frame.axisX(true);
    frame.placesY(this.result.stations.map((one) => ({ name: stationName(one), place: one.chainage_m })));
  }

  draw() {
    this.frame.within(() => {
      const runs = shownRuns(this.result);
      const [first] = runs;
      if (first && state.obstructions) this.obstructions(this.focused(runs).run);
      if (first && state.booked) this.booked(first.run);
      if (first && state.delays) this.injected(this.focused(runs).run);
      for (const { run, index } of runs) this.trains(run, index);
      if (state.train) this.chosen(runs);
      if (state.stops) for (const { run, index } of runs) this.stops(run, index);
      this.now();
    });
  }

  /** @param {{run: Run, index: number}[]} runs */
  focused(runs) {
    return runs.find(({ run }) => run.controller === state.focus) ?? runs[0];
  }

  /** Metres of a pixel decide how many corners a line needs. @returns {number} */
  tolerance() {
    const { top, bottom } = this.frame.box;
    const pixel_m = (this.frame.y1 - this.frame.y0) / (bottom - top);
    return TOLERANCES_M.find((one) => one <= 0.75 * pixel_m) ?? TOLERANCES_M[TOLERANCES_M.length - 1];
  }

  /** @param {Run} run @param {number} index */
  trains(run, index) {
    const { pen } = this.frame;
    const { colour, dash } = penOf(index);
    pen.strokeStyle = colour;
    pen.setLineDash(dash);
    pen.lineWidth = 1.1;
    pen.globalAlpha = 0.8;
    for (const train of run.callsOf.keys()) this.line(run, train);
    pen.globalAlpha = 1;
    pen.setLineDash([]);
    if (state.numbers && index === shownRuns(this.result)[0]?.index) this.numbers(run);
  }

  /** @param {Run} run @param {string} train */
  line(run, train) {
    const trip = run.trips.get(train);
    const { frame } = this;
    const { pen } = frame;
    if (!trip) {
      this.joined(run, train, "arrival_s", "departure_s");
      return;
    }
    const { time_s, front_m } = trip;
    if (time_s[0] > frame.x1 || time_s[time_s.length - 1] < frame.x0) return;
    const corners = trip.line(this.tolerance());
    const times = { length: corners.length };
    const from = Math.max(cornerBefore(corners, time_s, frame.x0), 0);
    pen.beginPath();
    for (let at = from; at < times.length; at++) {
      const sample = corners[at];
      const x = frame.x(time_s[sample]);
      const y = frame.y(front_m[sample]);
      if (at === from) pen.moveTo(x, y);
      else pen.lineTo(x, y);
      if (time_s[sample] > frame.x1) break;
    }
    pen.stroke();
  }

  /** Join the calls of a train. @param {Run} run @param {string} train @param {string} arrive @param {string} leave */
  joined(run, train, arrive, leave) {
    const { frame } = this;
    const arrival_s = run.calls.numbers(arrive);
    const departure_s = run.calls.numbers(leave);
    const stop_m = run.calls.numbers("stop_m");
    frame.pen.beginPath();
    let begun = false;
    for (const row of run.callsOf.get(train) ?? []) {
      for (const time_s of [arrival_s[row], departure_s[row]]) {
        if (!Number.isFinite(time_s)) continue;
        if (begun) frame.pen.lineTo(frame.x(time_s), frame.y(stop_m[row]));
        else frame.pen.moveTo(frame.x(time_s), frame.y(stop_m[row]));
        begun = true;
      }
    }
    frame.pen.stroke();
  }

  /** @param {Run} run */
  booked(run) {
    const { pen } = this.frame;
    pen.strokeStyle = themed("booked");
    pen.lineWidth = 1;
    pen.setLineDash([3, 2]);
    for (const train of run.callsOf.keys()) this.joined(run, train, "booked_arrival_s", "booked_departure_s");
    pen.setLineDash([]);
  }

  /** The chosen train stands out, the focused controller on top. @param {{run: Run, index: number}[]} runs */
  chosen(runs) {
    const { pen } = this.frame;
    const having = runs.filter(({ run }) => run.callsOf.has(state.train));
    const focus = having.find(({ run }) => run.controller === state.focus);
    if (focus && state.bands) this.band(focus.run);
    pen.strokeStyle = themed("paper");
    pen.lineWidth = 6;
    for (const { run } of having) this.line(run, state.train);
    for (const { run, index } of [...having].sort((a, b) => Number(a === focus) - Number(b === focus))) {
      const { colour, dash } = penOf(index);
      pen.strokeStyle = colour;
      pen.lineWidth = run === focus?.run ? 3.4 : 2.2;
      pen.setLineDash(dash);
      this.line(run, state.train);
    }
    pen.setLineDash([]);
  }

  /** The way that the chosen train had in every second: its tail to its end of authority. @param {Run} run */
  band(run) {
    const trip = run.trips.get(state.train);
    if (!trip) return;
    const { frame } = this;
    const length_m = trainLength(this.result, state.train);
    const { time_s, front_m, limit_m } = trip;
    const rising = front_m[front_m.length - 1] >= front_m[0];
    const from = Math.max(lastNotAbove(time_s, frame.x0), 0);
    const to = Math.min(lastNotAbove(time_s, frame.x1) + 1, time_s.length - 1);
    const step = Math.max(Math.floor((to - from) / 1500), 1);
    frame.pen.beginPath();
    for (let i = from; i <= to; i += step) frame.pen.lineTo(frame.x(time_s[i]), frame.y(limit_m[i]));
    for (let i = to; i >= from; i -= step) {
      frame.pen.lineTo(frame.x(time_s[i]), frame.y(front_m[i] - (rising ? length_m : -length_m)));
    }
    frame.pen.fillStyle = themed("band");
    frame.pen.fill();
  }

  /** @param {Run} run */
  numbers(run) {
    const { frame } = this;
    const { pen } = frame;
    const { left, right, top } = frame.box;
    pen.fillStyle = themed("ink");
    pen.font = "10px system-ui, sans-serif";
    pen.textAlign = "left";
    pen.textBaseline = "bottom";
    let last = -Infinity;
    for (const train of run.callsOf.keys()) {
      const at = this.entry(run, train);
      if (!at) continue;
      const x = frame.x(at.time_s);
      const y = Math.max(frame.y(at.place_m), top + 24);
      if (x < left || x > right - 10 || Math.abs(x - last) < 15) continue;
      last = x;
      pen.save();
      pen.translate(x + 4, y - 3);
      pen.rotate(-Math.PI / 3);
      pen.fillText(train, 0, 0);
      pen.restore();
    }
    pen.font = "12px system-ui, sans-serif";
  }

  /** Where a train comes into what is shown. @param {Run} run @param {string} train */
  entry(run, train) {
    const rows = run.callsOf.get(train) ?? [];
    const departure_s = run.calls.numbers("departure_s");
    const stop_m = run.calls.numbers("stop_m");
    const { frame } = this;
    for (const row of rows) {
      const [time_s, place_m] = [departure_s[row], stop_m[row]];
      if (time_s >= frame.x0 && time_s <= frame.x1 && place_m >= frame.y0 && place_m <= frame.y1) {
        return { time_s, place_m };
      }
    }
    return null;
  }

  /** @param {Run} run @param {number} index */
  stops(run, index) {
    const { frame } = this;
    const { pen } = frame;
    const start_s = run.stops.numbers("start_s");
    const duration_s = run.stops.numbers("duration_s");
    const front_m = run.stops.numbers("front_m");
    for (let row = 0; row < run.stops.rows; row++) {
      const x = frame.x(start_s[row]);
      const wide = Math.max(frame.x(start_s[row] + duration_s[row]) - x, 5);
      pen.fillStyle = penOf(index).colour;
      pen.strokeStyle = themed("ink");
      pen.lineWidth = 1.4;
      pen.beginPath();
      pen.roundRect(x, frame.y(front_m[row]) - 3.5, wide, 7, 3.5);
      pen.fill();
      pen.stroke();
    }
  }

  /** Overstays that were given to trains. @param {Run} run */
  injected(run) {
    const { frame } = this;
    const { pen } = frame;
    const delay_s = run.calls.numbers("dwell_delay_s");
    const departure_s = run.calls.numbers("departure_s");
    const stop_m = run.calls.numbers("stop_m");
    pen.fillStyle = themed("injected");
    for (let row = 0; row < run.calls.rows; row++) {
      if (!(delay_s[row] >= LEAST_DELAY_S) || !Number.isFinite(departure_s[row])) continue;
      const x = frame.x(departure_s[row] - delay_s[row]);
      pen.fillRect(x, frame.y(stop_m[row]) - 5, Math.max(frame.x(departure_s[row]) - x, 3), 10);
    }
  }

  /** @param {Run} run */
  obstructions(run) {
    const { frame } = this;
    const { pen } = frame;
    const table = run.obstructions;
    const [start_m, end_m] = [table.numbers("start_m"), table.numbers("end_m")];
    const [from_s, to_s] = [table.numbers("established_s"), table.numbers("lifted_s")];
    pen.fillStyle = themed("obstruction");
    for (let row = 0; row < table.rows; row++) {
      if (!Number.isFinite(from_s[row])) continue;
      const until_s = Number.isFinite(to_s[row]) ? to_s[row] : frame.x1;
      const x = frame.x(from_s[row]);
      const [y0, y1] = [frame.y(start_m[row]), frame.y(end_m[row])];
      pen.fillRect(x, Math.min(y0, y1), Math.max(frame.x(until_s) - x, 1.5), Math.max(Math.abs(y1 - y0), 3));
    }
  }

  now() {
    if (!Number.isFinite(state.time_s)) return;
    const { top, bottom } = this.frame.box;
    const { pen } = this.frame;
    pen.strokeStyle = themed("now");
    pen.lineWidth = 1.2;
    pen.setLineDash([4, 3]);
    pen.beginPath();
    pen.moveTo(this.frame.x(state.time_s), top);
    pen.lineTo(this.frame.x(state.time_s), bottom);
    pen.stroke();
    pen.setLineDash([]);
  }

  /** What is nearest to a place of the canvas. @param {number} x @param {number} y @returns {Found | null} */
  nearest(x, y) {
    const { frame } = this;
    const time_s = frame.fromX(x);
    /** @type {Found | null} */
    let best = null;
    for (const { run, index } of shownRuns(this.result)) {
      for (const train of run.callsOf.keys()) {
        const trip = run.trips.get(train) ?? null;
        const place_m = trip ? trip.frontAt(time_s) : placeByCalls(run, train, time_s);
        const distance = Math.abs(frame.y(place_m) - y);
        if (distance < NEAR && (!best || distance < best.distance)) best = { run, index, trip, train, distance };
      }
    }
    return best;
  }

  /** @param {number} x @param {number} y @returns {string[] | null} */
  hover(x, y) {
    const found = this.nearest(x, y);
    return found ? tellTrain(this.result, found.run, found.train, this.frame.fromX(x)) : null;
  }

  /** @param {number} x @param {number} y */
  pick(x, y) {
    const time_s = this.frame.fromX(x);
    const found = this.nearest(x, y);
    if (found) choose({ train: found.train, focus: found.run.controller, time_s });
    else choose({ time_s });
  }

  /** @param {string} key @returns {boolean} */
  key(key) {
    const step = { "[": -1, "]": 1 }[key];
    if (!step) return false;
    const { trains } = this.result;
    const at = trains.indexOf(state.train) + step;
    choose({ train: trains[(at + trains.length) % trains.length] });
    return true;
  }

  /** Another seed may begin and end at other times. */
  reach() {
    this.span = spanOf(this.result);
    this.frame.reset();
  }

  /** Bring the chosen train and time into sight. */
  seek() {
    const run = this.result.run(state.focus, state.key);
    const rows = run?.callsOf.get(state.train) ?? [];
    if (!run || !rows.length) return;
    const times_s = rows.flatMap((row) => [run.calls.numbers("arrival_s")[row], run.calls.numbers("departure_s")[row]]);
    const known = times_s.filter(Number.isFinite);
    const { frame } = this;
    const chosen_s = Number.isFinite(state.time_s) ? state.time_s : known[0];
    const seen = chosen_s > frame.x0 && chosen_s < frame.x1 && known.some((time_s) => time_s > frame.x0 && time_s < frame.x1);
    if (seen) frame.ask();
    else {
      const half_s = (frame.x1 - frame.x0) / 2;
      frame.show(chosen_s - half_s, chosen_s + half_s);
    }
  }
}

/**
 * @param {Int32Array} corners
 * @param {Float64Array} time_s
 * @param {number} from_s
 */
function cornerBefore(corners, time_s, from_s) {
  let low = 0;
  let high = corners.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (time_s[corners[middle]] <= from_s) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}
