/** One train: speed with its limits, what bound it in every second, power and energy. */

import { choice, el, fill, opening, table } from "./elements.js";
import { callsTable } from "./calls_table.js";
import { Frame } from "./frame.js";
import { shownRuns, spanOf, tellTrain } from "./runs.js";
import { moment, momentOf } from "./moment.js";
import { choose, state } from "./state.js";
import { pen as penOf, reasonColour, themed } from "./colours.js";
import { clock, kilometres, lastNotAbove, number } from "./telling.js";
import { brakeCurve, energyOf, limitAt, phasesOf, powerOf } from "./physics.js";
import { REASONS, reasonWord, stationName, word } from "./words.js";

/**
 * @typedef {import("./model.js").Result} Result
 * @typedef {import("./model.js").Run} Run
 * @typedef {import("./model.js").Trip} Trip
 */

const RIBBON = 20;

export class TrainView {
  /** @param {Result} result */
  constructor(result) {
    this.result = result;
    const narrow = window.innerWidth < 700;
    const margins = { left: narrow ? 52 : 74, right: 10, top: 24, bottom: 22 };
    const shared = { whole: () => this.whole(), hover: this.hover, pick: this.pick };
    this.speed = new Frame({
      ...shared,
      label: word("speed"),
      height: 270,
      margins,
      draw: () => this.drawSpeed(),
      moved: () => this.follow(this.speed),
    });
    this.ribbon = new Frame({
      ...shared,
      label: word("why"),
      height: 60,
      margins: { ...margins, top: 18, bottom: 22 },
      draw: () => this.drawRibbon(),
      moved: () => this.follow(this.ribbon),
    });
    this.power = new Frame({
      ...shared,
      label: word("power"),
      height: 190,
      margins,
      draw: () => this.drawPower(),
      moved: () => this.follow(this.power),
    });
    this.frames = [this.speed, this.ribbon, this.power];
    for (const frame of this.frames.slice(1)) frame.element.querySelector(".tools")?.remove();
    /** @type {Map<Trip, {power_w: Float64Array, energy_kwh: Float64Array}>} */
    this.powers = new Map();
    this.head = el("div", { class: "row" });
    this.body = el("div", {});
    this.told = el("div", { "aria-live": "polite" });
    this.tables = el("div", {});
    this.legend = el("ul", { class: "legend" });
    this.element = el("div", {}, this.head, this.told, this.body);
    this.update();
  }

  /** @returns {{run: Run, index: number, trip: Trip}[]} */
  trips() {
    return shownRuns(this.result)
      .map(({ run, index }) => ({ run, index, trip: run.trips.get(state.train) }))
      .filter(({ trip }) => trip)
      .map((one) => /** @type {{run: Run, index: number, trip: Trip}} */ (one));
  }

  focused() {
    const trips = this.trips();
    return trips.find(({ run }) => run.controller === state.focus) ?? trips[0];
  }

  get type() {
    const { type_of: types = {}, train_types: told = {} } = this.result.line;
    return { name: types[state.train] ?? "", told: told[types[state.train]] };
  }

  /** @returns {[number, number, number, number]} */
  whole() {
    const trips = this.trips();
    if (!trips.length) return [...spanOf(this.result), 0, 1];
    const values = trips.flatMap(({ trip }) => {
      const all = state.axis === "time" ? trip.time_s : trip.front_m;
      return [all[0], all[all.length - 1]];
    });
    const [low, high] = [Math.min(...values), Math.max(...values)];
    const edge = 0.02 * (high - low || 1);
    return [low - edge, high + edge, 0, 1];
  }

  /** Another train, controller or axis. */
  update() {
    this.headline();
    const focus = this.focused();
    fill(this.told, focus ? moment(this.result, focus.run, state.train, momentOf(focus.trip)) : null);
    const trips = this.trips();
    if (!trips.length) {
      const told = state.train ? word("no_trip", { train: state.train, controller: state.focus }) : word("stage_none");
      fill(this.body, el("p", { class: "quiet" }, told), callsTable(this.result));
      return;
    }
    this.ribbon.wanted.height = 44 + RIBBON * trips.length;
    fill(
      this.body,
      this.speed.element,
      el("h4", {}, word("why")),
      this.ribbon.element,
      this.legend,
      this.type.told ? [el("h4", {}, word("power")), el("p", { class: "quiet" }, this.energyTold()), this.power.element] : el("p", { class: "quiet" }, word("no_line")),
      opening(word("phases"), () => this.phasesTable()),
      opening(word("calls"), () => callsTable(this.result)),
    );
    this.legends(trips);
    for (const frame of this.frames) {
      const [x0, x1] = this.whole();
      [frame.x0, frame.x1] = [x0, x1];
      frame.ask();
    }
    this.near();
  }

  /** Show the chosen moment, not the whole trip, once one is chosen. */
  near() {
    if (!Number.isFinite(state.time_s) || state.axis !== "time") return;
    const [x0, x1] = this.whole();
    if (state.time_s < x0 || state.time_s > x1) return;
    for (const frame of this.frames) [frame.x0, frame.x1] = [Math.max(x0, state.time_s - 420), Math.min(x1, state.time_s + 420)];
  }

  headline() {
    const { trains } = this.result;
    fill(
      this.head,
      choice({
        id: "train",
        label: word("train"),
        options: /** @type {[string, string][]} */ (trains.map((name) => [name, name])),
        value: state.train,
        onchange: (train) => choose({ train, time_s: NaN }),
      }),
      choice({
        id: "train-controller",
        label: word("controller"),
        options: shownRuns(this.result).map(({ run }) => [run.controller, run.controller.replaceAll("_", " ")]),
        value: state.focus,
        onchange: (focus) => choose({ focus }),
      }),
      choice({
        id: "axis",
        label: `${word("time")} / ${word("distance")}`,
        options: [["time", word("over_time")], ["distance", word("over_distance")]],
        value: state.axis,
        onchange: (axis) => choose({ axis: axis === "distance" ? "distance" : "time" }),
      }),
    );
  }

  /** @param {Frame} leader */
  follow(leader) {
    for (const frame of this.frames) {
      if (frame === leader) continue;
      [frame.x0, frame.x1] = [leader.x0, leader.x1];
      frame.ask();
    }
  }

  /** Samples that are in sight. @param {Trip} trip @returns {[number, number]} */
  seen(trip) {
    const values = state.axis === "time" ? trip.time_s : trip.front_m;
    if (state.axis === "distance" && values[values.length - 1] < values[0]) return [0, trip.length - 1];
    const from = Math.max(lastNotAbove(values, this.speed.x0), 0);
    return [from, Math.min(lastNotAbove(values, this.speed.x1) + 1, trip.length - 1)];
  }

  /** @param {Frame} frame @param {Trip} trip @param {(index: number) => number} value */
  curve(frame, trip, value) {
    const [from, to] = this.seen(trip);
    const along = state.axis === "time" ? trip.time_s : trip.front_m;
    const { pen } = frame;
    pen.beginPath();
    for (let i = from; i <= to; i++) pen.lineTo(frame.x(along[i]), frame.y(value(i)));
    pen.stroke();
  }

  drawSpeed() {
    const frame = this.speed;
    const top_mps = this.type.told?.maximum_speed_mps ?? 30;
    [frame.y0, frame.y1] = [0, Math.max(3.6 * top_mps * 1.08, 40)];
    frame.axisX(state.axis === "time");
    frame.axisY(`${word("speed")} [km/h]`, (value) => number(value, 0));
    frame.within(() => {
      this.stationMarks(frame);
      const focus = this.focused();
      if (focus && this.type.told) this.limits(frame, focus.trip);
      for (const { trip, index, run } of this.trips()) {
        const { colour, dash } = penOf(index);
        frame.pen.strokeStyle = colour;
        frame.pen.setLineDash(dash);
        frame.pen.lineWidth = run === focus.run ? 2.6 : 1.3;
        this.curve(frame, trip, (i) => 3.6 * trip.speed_mps[i]);
      }
      frame.pen.setLineDash([]);
      this.now(frame);
    });
  }

  /** @param {Frame} frame @param {Trip} trip */
  limits(frame, trip) {
    const { told, name } = this.type;
    const { front_m, limit_m } = trip;
    const rising = front_m[front_m.length - 1] >= front_m[0];
    const limits = this.result.line.limits ?? [];
    frame.pen.lineWidth = 1.4;
    frame.pen.strokeStyle = themed("limit");
    this.curve(frame, trip, (i) => 3.6 * limitAt(limits, name, told, front_m[i], trip.text("track", i), rising));
    frame.pen.strokeStyle = themed("authority");
    frame.pen.setLineDash([5, 3]);
    this.curve(frame, trip, (i) => 3.6 * brakeCurve(told, Math.abs(limit_m[i] - front_m[i])));
    frame.pen.setLineDash([]);
  }

  /** Where and when the train stops. @param {Frame} frame */
  stationMarks(frame) {
    const focus = this.focused();
    if (!focus) return;
    const { calls } = focus.run;
    const { pen } = frame;
    const { top, bottom } = frame.box;
    pen.fillStyle = themed("quiet");
    pen.textAlign = "left";
    pen.textBaseline = "top";
    let last = -Infinity;
    for (const row of focus.run.callsOf.get(state.train) ?? []) {
      const place = state.axis === "time" ? calls.numbers("arrival_s")[row] : calls.numbers("stop_m")[row];
      if (!(place >= frame.x0 && place <= frame.x1)) continue;
      const x = frame.x(place);
      pen.strokeStyle = themed("grid");
      pen.beginPath();
      pen.moveTo(x, top);
      pen.lineTo(x, bottom);
      pen.stroke();
      const station = this.result.stationOf.get(calls.text("station", row));
      const name = station ? stationName(station) : calls.text("station", row);
      if (x + 3 > last + 5) {
        pen.fillText(name, x + 3, top + 1);
        last = x + 3 + pen.measureText(name).width;
      }
    }
  }

  drawRibbon() {
    const frame = this.ribbon;
    const trips = this.trips();
    [frame.y0, frame.y1] = [0, 1];
    frame.axisX(state.axis === "time");
    const { pen } = frame;
    const { left, right, top } = frame.box;
    trips.forEach(({ trip, index }, row) => {
      const y = top + row * RIBBON;
      pen.fillStyle = penOf(index).colour;
      pen.fillRect(left - 10, y + 2, 6, RIBBON - 5);
      pen.save();
      pen.beginPath();
      pen.rect(left, y, right - left, RIBBON);
      pen.clip();
      const along = state.axis === "time" ? trip.time_s : trip.front_m;
      for (const phase of phasesOf(trip)) {
        const [a, b] = [frame.x(along[phase.start]), frame.x(along[phase.end])];
        const [x, wide] = [Math.min(a, b), Math.max(Math.abs(b - a), 1)];
        if (x > right || x + wide < left) continue;
        pen.fillStyle = reasonColour(phase.reason);
        pen.fillRect(x, y + 1, wide, RIBBON - 3);
        this.causeIn(pen, phase, Math.max(x, left), Math.min(x + wide, right), y);
      }
      pen.restore();
    });
    frame.within(() => this.now(frame));
  }

  /** @param {CanvasRenderingContext2D} pen @param {{cause: string, reason: string}} phase @param {number} x @param {number} to @param {number} y */
  causeIn(pen, phase, x, to, y) {
    if (!phase.cause || to - x < pen.measureText(phase.cause).width + 6) return;
    const told = phase.cause;
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    const wide = pen.measureText(told).width;
    pen.fillStyle = themed("paper");
    pen.fillRect(x + 2, y + 3, wide + 4, RIBBON - 7);
    pen.fillStyle = themed("ink");
    pen.fillText(told, x + 4, y + RIBBON / 2);
  }

  /** @param {Trip} trip */
  powerAndEnergy(trip) {
    let known = this.powers.get(trip);
    if (!known) {
      const power_w = powerOf(this.result.line, this.type.told, trip);
      known = { power_w, energy_kwh: energyOf(trip.time_s, power_w) };
      this.powers.set(trip, known);
    }
    return known;
  }

  drawPower() {
    const frame = this.power;
    const focus = this.focused();
    if (!focus || !this.type.told) return;
    const { power_w, energy_kwh } = this.powerAndEnergy(focus.trip);
    const most = power_w.reduce((a, b) => Math.max(a, b), 1e5) / 1e6;
    const least = power_w.reduce((a, b) => Math.min(a, b), 0) / 1e6;
    [frame.y0, frame.y1] = [least * 1.05, most * 1.1];
    frame.axisX(state.axis === "time");
    frame.axisY("MW", (value) => number(value, most > 4 ? 0 : 1));
    frame.within(() => {
      const { colour } = penOf(focus.index);
      frame.pen.strokeStyle = colour;
      frame.pen.lineWidth = 1.5;
      this.curve(frame, focus.trip, (i) => power_w[i] / 1e6);
      const total = energy_kwh.reduce((a, b) => Math.max(a, b), 1);
      frame.pen.strokeStyle = themed("authority");
      frame.pen.setLineDash([5, 3]);
      this.curve(frame, focus.trip, (i) => (energy_kwh[i] / total) * most);
      frame.pen.setLineDash([]);
      this.now(frame);
    });
    frame.pen.fillStyle = themed("authority");
    frame.pen.textAlign = "right";
    frame.pen.textBaseline = "bottom";
    const at = Math.min(this.seen(focus.trip)[1], energy_kwh.length - 1);
    frame.pen.fillText(`- - ${word("energy")} ${number(energy_kwh[at], 1)} kWh`, frame.box.right, frame.box.top - 3);
  }

  energyTold() {
    const focus = this.focused();
    const { energy } = focus.run;
    const { codes, texts } = energy.texts("train");
    const row = codes.findIndex((code) => texts[code] === state.train);
    const told = (/** @type {string} */ name) => number(energy.numbers(name)[row], 1);
    if (row < 0) return "";
    return word("energy_told", {
      train: state.train,
      controller: focus.run.controller.replaceAll("_", " "),
      gross: told("gross_kwh"),
      recovered: told("recovered_kwh"),
      net: told("net_kwh"),
    });
  }

  /** @param {Frame} frame */
  now(frame) {
    const focus = this.focused();
    if (!Number.isFinite(state.time_s) || !focus) return;
    const place = state.axis === "time" ? state.time_s : focus.trip.frontAt(state.time_s);
    if (!Number.isFinite(place)) return;
    const { top, bottom } = frame.box;
    frame.pen.strokeStyle = themed("now");
    frame.pen.setLineDash([4, 3]);
    frame.pen.beginPath();
    frame.pen.moveTo(frame.x(place), top);
    frame.pen.lineTo(frame.x(place), bottom);
    frame.pen.stroke();
    frame.pen.setLineDash([]);
  }

  /** When the focused train was at a place of the canvas. @param {number} x @returns {number} */
  timeAt(x) {
    const focus = this.focused();
    const value = this.speed.fromX(x);
    if (state.axis === "time" || !focus) return value;
    const { front_m, time_s } = focus.trip;
    const rising = front_m[front_m.length - 1] >= front_m[0];
    const index = front_m.findIndex((place_m) => (rising ? place_m >= value : place_m <= value));
    return index < 0 ? time_s[time_s.length - 1] : time_s[index];
  }

  hover = (/** @type {number} */ x) => {
    const focus = this.focused();
    return focus ? tellTrain(this.result, focus.run, state.train, this.timeAt(x)) : null;
  };

  pick = (/** @type {number} */ x) => choose({ time_s: this.timeAt(x) });
  /** @param {{run: Run, index: number, trip: Trip}[]} trips */
  legends(trips) {
    const used = new Set(trips.flatMap(({ trip }) => phasesOf(trip).map((phase) => phase.reason)));
    fill(
      this.legend,
      trips.map(({ run, index }) =>
        el("li", {}, el("span", { class: "swatch", style: { background: penOf(index).colour } }), run.controller.replaceAll("_", " ")),
      ),
      Object.keys(REASONS)
        .filter((reason) => used.has(reason))
        .map((reason) => el("li", {}, el("span", { class: "swatch box", style: { background: reasonColour(reason) } }), reasonWord(reason, ""))),
      el("li", {}, el("span", { class: "stroke", style: { background: themed("limit") } }), word("limit")),
      el("li", {}, el("span", { class: "stroke", style: { background: themed("authority") } }), word("authority_curve")),
    );
  }

  phasesTable() {
    const focus = this.focused();
    const { time_s, front_m } = focus.trip;
    return table({
      caption: `${word("why")}: ${state.train}, ${focus.run.controller}`,
      head: [word("from"), word("to"), word("duration"), word("place"), word("reason"), word("cause")],
      rows: phasesOf(focus.trip).map((phase) => [
        clock(time_s[phase.start]),
        clock(time_s[phase.end]),
        `${number(time_s[phase.end] - time_s[phase.start], 0)} s`,
        kilometres(front_m[phase.start]),
        reasonWord(phase.reason, phase.plan),
        phase.cause,
      ]),
    });
  }
}
