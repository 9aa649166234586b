/** Results as the views see them: runs, trips, calls. */

import { Table } from "./unpack.js";
import { lastNotAbove } from "./telling.js";

/**
 * @typedef {{id: string, name: string, local: string, chainage_m: number,
 *   longitude_deg: number | null, latitude_deg: number | null}} Station
 * @typedef {{train: string, start_m: number, end_m: number}} Stretch
 */

/** The way of one train in one run, sample by sample. */
export class Trip {
  /**
   * @param {Run} run
   * @param {string} train
   * @param {number} start
   * @param {number} end
   */
  constructor(run, train, start, end) {
    this.run = run;
    this.train = train;
    this.start = start;
    this.end = end;
    /** @type {Map<number, Int32Array>} */
    this.corners = new Map();
  }

  /** @param {string} name @returns {Float64Array} */
  #part(name) {
    return this.run.samples.numbers(name).subarray(this.start, this.end);
  }

  get time_s() {
    return this.#part("time_s");
  }

  get front_m() {
    return this.#part("front_m");
  }

  get speed_mps() {
    return this.#part("speed_mps");
  }

  get limit_m() {
    return this.#part("limit_m");
  }

  /** @returns {number} */
  get length() {
    return this.end - this.start;
  }

  /**
   * The sample that holds at a time; -1 while the train is not on the line.
   * @param {number} time_s
   * @returns {number}
   */
  at(time_s) {
    const times_s = this.time_s;
    if (time_s < times_s[0] || time_s > times_s[times_s.length - 1]) return -1;
    return lastNotAbove(times_s, time_s);
  }

  /**
   * Where the front was at a time; NaN while the train is not on the line.
   * @param {number} time_s
   * @returns {number}
   */
  frontAt(time_s) {
    const index = this.at(time_s);
    if (index < 0) return NaN;
    const { time_s: times_s, front_m } = this;
    if (index + 1 >= times_s.length) return front_m[index];
    const share = (time_s - times_s[index]) / (times_s[index + 1] - times_s[index]);
    return front_m[index] + share * (front_m[index + 1] - front_m[index]);
  }

  /** @param {string} name @param {number} index @returns {string} */
  text(name, index) {
    return this.run.samples.text(name, this.start + index);
  }

  /**
   * Samples that draw the way within a tolerance (swing filter).
   * @param {number} tolerance_m
   * @returns {Int32Array}
   */
  line(tolerance_m) {
    const known = this.corners.get(tolerance_m);
    if (known) return known;
    const found = swing(this.time_s, this.front_m, tolerance_m);
    this.corners.set(tolerance_m, found);
    return found;
  }
}

/**
 * Corners of a line that keeps within a tolerance of every point.
 * @param {Float64Array} x rising
 * @param {Float64Array} y
 * @param {number} tolerance
 * @returns {Int32Array}
 */
export function swing(x, y, tolerance) {
  const kept = [0];
  let low = -Infinity;
  let high = Infinity;
  let from = 0;
  for (let i = 1; i < x.length; i++) {
    const dx = x[i] - x[from];
    const slope = (y[i] - y[from]) / dx;
    if (i > from + 1 && (slope < low || slope > high)) {
      from = i - 1;
      kept.push(from);
      low = -Infinity;
      high = Infinity;
    }
    const step = x[i] - x[from];
    low = Math.max(low, (y[i] - tolerance - y[from]) / step);
    high = Math.min(high, (y[i] + tolerance - y[from]) / step);
  }
  if (x.length > 1) kept.push(x.length - 1);
  return Int32Array.from(kept);
}

/** One controller with one seed and initial delay. */
export class Run {
  /**
   * @param {any} told
   * @param {Uint8Array} content
   */
  constructor(told, content) {
    /** @type {string} */
    this.controller = told.controller;
    /** @type {number} */
    this.seed = told.seed;
    /** @type {number} */
    this.initial_delay_s = told.initial_delay_s;
    const nothing = { rows: 0, columns: {} };
    const table = (/** @type {string} */ name) => new Table(told[name] ?? nothing, content);
    this.calls = table("calls");
    this.stops = table("interstation_stops");
    this.remaining = table("remaining_stops");
    this.energy = table("energy");
    this.obstructions = table("obstructions");
    this.violations = table("violations");
    this.unfinished = table("unfinished");
    this.edges = table("edges");
    this.samples = table("trajectory");
    /** @type {Map<string, Trip>} */
    this.trips = new Map();
    for (const [train, start, end] of told.trips ?? []) {
      if (end - start > 1) this.trips.set(train, new Trip(this, train, start, end));
    }
  }

  /** @returns {string} */
  get key() {
    return `${this.seed}/${this.initial_delay_s}`;
  }

  /** Rows of the calls of every train, in order. @returns {Map<string, number[]>} */
  get callsOf() {
    if (!this._callsOf) {
      /** @type {Map<string, number[]>} */
      this._callsOf = new Map();
      const { codes, texts } = this.calls.texts("train");
      for (let row = 0; row < this.calls.rows; row++) {
        const train = texts[codes[row]];
        const rows = this._callsOf.get(train);
        if (rows) rows.push(row);
        else this._callsOf.set(train, [row]);
      }
    }
    return this._callsOf;
  }

  /**
   * The call that a train is at, or made last; -1 before its first one.
   * @param {string} train
   * @param {number} time_s
   * @returns {number}
   */
  lastCall(train, time_s) {
    const arrival_s = this.calls.numbers("arrival_s");
    const departure_s = this.calls.numbers("departure_s");
    let found = -1;
    for (const row of this.callsOf.get(train) ?? []) {
      const since_s = Number.isNaN(arrival_s[row]) ? departure_s[row] : arrival_s[row];
      if (since_s <= time_s) found = row;
    }
    return found;
  }

  /**
   * How late a train was when it was seen last at a station; NaN before.
   * @param {string} train
   * @param {number} time_s
   * @returns {number}
   */
  delayAt(train, time_s) {
    const row = this.lastCall(train, time_s);
    if (row < 0) return NaN;
    const left = this.calls.numbers("departure_s")[row] <= time_s;
    return this.calls.numbers(left ? "departure_delay_s" : "arrival_delay_s")[row];
  }

  /** From when to when anything happens. @returns {[number, number]} */
  get span_s() {
    let start_s = Infinity;
    let end_s = -Infinity;
    const names = ["arrival_s", "departure_s", "booked_arrival_s", "booked_departure_s"];
    for (const name of names) {
      for (const time_s of this.calls.numbers(name)) {
        if (time_s < start_s) start_s = time_s;
        if (time_s > end_s) end_s = time_s;
      }
    }
    for (const trip of this.trips.values()) {
      start_s = Math.min(start_s, trip.time_s[0]);
      end_s = Math.max(end_s, trip.time_s[trip.length - 1]);
    }
    return end_s > start_s ? [start_s, end_s] : [0, 3600];
  }
}

/** Results of one line. */
export class Result {
  /**
   * @param {any} told
   * @param {Uint8Array} content
   */
  constructor(told, content) {
    this.told = told;
    /** @type {string} */
    this.name = told.name;
    /** @type {{name: string, knows_future: boolean, peer: boolean, competes: boolean, layers: any}[]} */
    this.controllers = told.controllers;
    this.summary = new Table(told.summary, content);
    this.runs = told.runs.map((/** @type {any} */ run) => new Run(run, content));
    this.line = told.line ?? {};
    const placed = new Map((this.line.stations ?? []).map((/** @type {any} */ one) => [one.id, one]));
    /** @type {Station[]} */
    this.stations = told.stations
      .map((/** @type {any} */ one) => ({
        id: one.station,
        name: one.name || one.station,
        local: one.name_local || one.name || one.station,
        chainage_m: one.chainage_m,
        longitude_deg: placed.get(one.station)?.longitude_deg ?? null,
        latitude_deg: placed.get(one.station)?.latitude_deg ?? null,
      }))
      .filter((/** @type {Station} */ one) => Number.isFinite(one.chainage_m));
    this.stationOf = new Map(this.stations.map((station) => [station.id, station]));
  }

  /**
   * @param {string} controller
   * @param {string} key seed and initial delay
   * @returns {Run | undefined}
   */
  run(controller, key) {
    return this.runs.find((/** @type {Run} */ run) => run.controller === controller && run.key === key);
  }

  /** Seeds and initial delays, those with trajectories first. @returns {string[]} */
  get keys() {
    const seen = this.runs.filter((/** @type {Run} */ run) => run.trips.size);
    const all = [...seen, ...this.runs].map((run) => run.key);
    return [...new Set(all)];
  }

  /** All trains, as they come. @returns {string[]} */
  get trains() {
    const names = new Set();
    for (const run of this.runs.slice(0, 1)) for (const name of run.callsOf.keys()) names.add(name);
    return [...names];
  }

  /** Between which chainages everything lies. [m] @returns {[number, number]} */
  get extent_m() {
    const places = this.stations.map((station) => station.chainage_m);
    for (const run of this.runs.slice(0, 1)) places.push(...run.calls.numbers("stop_m"));
    const known = places.filter(Number.isFinite);
    if (!known.length) return [0, 1000];
    const low = Math.min(...known);
    const high = Math.max(...known);
    return high > low ? [low, high] : [low - 500, high + 500];
  }
}
