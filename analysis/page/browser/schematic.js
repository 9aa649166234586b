/** Trains on the tracks of the line at a moment. */

import { reasonColour, themed } from "./colours.js";
import { placeByCalls, trainLength } from "./runs.js";
import { state } from "./state.js";
import { stationName } from "./words.js";

/**
 * @typedef {import("./model.js").Result} Result
 * @typedef {import("./model.js").Run} Run
 * @typedef {{id: string, start_m: number, end_m: number, across: number, ways: number[]}} Track
 * @typedef {{id: string, track: string, start_m: number, end_m: number}} Block
 * @typedef {{train: string, front_m: number, tail_m: number, track: string, reason: string, speed_mps: number}} Here
 */

const LEVEL = 34;
const HEAD = 76;
const METRES_PER_PIXEL = 42;

/**
 * The trains that are on the line at a time.
 * @param {Result} result
 * @param {Run} run
 * @param {number} time_s
 * @returns {Here[]}
 */
export function trainsAt(result, run, time_s) {
  if (!run.trips.size) return trainsByCalls(result, run, time_s);
  const found = [];
  for (const [train, trip] of run.trips) {
    const index = trip.at(time_s);
    if (index < 0) continue;
    const front_m = trip.frontAt(time_s);
    const { front_m: all } = trip;
    const length_m = trainLength(result, train) || 200;
    found.push({
      train,
      front_m,
      tail_m: all[all.length - 1] >= all[0] ? front_m - length_m : front_m + length_m,
      track: trip.text("track", index),
      reason: trip.text("reason", index),
      speed_mps: trip.speed_mps[index],
    });
  }
  return found;
}

/** The same of a run without samples: lines join the calls. @param {Result} result @param {Run} run @param {number} time_s @returns {Here[]} */
function trainsByCalls(result, run, time_s) {
  const found = [];
  for (const train of run.callsOf.keys()) {
    const front_m = placeByCalls(run, train, time_s);
    if (!Number.isFinite(front_m)) continue;
    const call = run.lastCall(train, time_s);
    const stands = call >= 0 && run.calls.numbers("departure_s")[call] > time_s;
    const tail_m = front_m - (trainLength(result, train) || 200);
    const track = call >= 0 ? run.calls.text("track", call) : "";
    found.push({ train, front_m, tail_m, track, reason: stands ? "dwelling" : "", speed_mps: NaN });
  }
  return found;
}

export class Schematic {
  /** @param {Result} result */
  constructor(result) {
    this.result = result;
    const [low_m, high_m] = result.extent_m;
    const { tracks = [] } = result.line;
    /** @type {Track[]} */
    this.tracks = tracks.length ? tracks : [{ id: "", start_m: low_m - 200, end_m: high_m + 200, across: 0, ways: [1] }];
    this.trackOf = new Map(this.tracks.map((track) => [track.id, track]));
    this.low_m = Math.min(...this.tracks.map((track) => track.start_m));
    this.high_m = Math.max(...this.tracks.map((track) => track.end_m));
    const levels = this.tracks.map((track) => track.across);
    this.levels = [Math.min(...levels), Math.max(...levels)];
    /** @type {Map<string, Block[]>} */
    this.blocks = new Map();
    for (const block of result.line.blocks ?? []) {
      if (!this.blocks.has(block.track)) this.blocks.set(block.track, []);
      this.blocks.get(block.track)?.push(block);
    }
  }

  /** So many rows the line takes at a width. @param {number} width @returns {number} */
  rows(width) {
    return Math.max(Math.ceil((this.high_m - this.low_m) / (width * METRES_PER_PIXEL)), 1);
  }

  /** @param {number} width @returns {number} */
  height(width) {
    return this.rows(width) * (HEAD + LEVEL * (this.levels[1] - this.levels[0] + 1) + 22);
  }

  /**
   * @param {CanvasRenderingContext2D} pen
   * @param {number} width
   * @param {number} top
   * @param {Run} run
   * @param {number} time_s
   */
  draw(pen, width, top, run, time_s) {
    const rows = this.rows(width);
    const here = trainsAt(this.result, run, time_s);
    const length_m = (this.high_m - this.low_m) / rows;
    const tall = this.height(width) / rows;
    for (let row = 0; row < rows; row++) {
      const from_m = this.low_m + row * length_m;
      pen.save();
      pen.beginPath();
      pen.rect(0, top + row * tall, width, tall);
      pen.clip();
      const x = (/** @type {number} */ place_m) => 12 + ((place_m - from_m) / length_m) * (width - 72);
      const y = (/** @type {number} */ across) => top + row * tall + HEAD + LEVEL * (across - this.levels[0]) + 10;
      this.#stations(pen, x, y);
      this.#tracks(pen, x, y, here);
      this.#points(pen, x, y, run, time_s);
      this.#trains(pen, x, y, here);
      pen.restore();
    }
    return here;
  }

  /** @typedef {(value: number) => number} Scale */

  /** @param {CanvasRenderingContext2D} pen @param {Scale} x @param {Scale} y */
  #stations(pen, x, y) {
    const [first, last] = [y(this.levels[0]), y(this.levels[1])];
    pen.textBaseline = "middle";
    pen.textAlign = "left";
    let end = -Infinity;
    for (const station of this.result.stations) {
      const at = x(station.chainage_m);
      pen.fillStyle = themed("platform");
      pen.fillRect(at - 7, first - 9, 7, last - first + 18);
      if (at - end < 13) continue;
      end = at;
      pen.save();
      pen.translate(at - 1, first - 22);
      pen.rotate(-Math.PI / 5);
      pen.fillStyle = themed("ink");
      pen.fillText(stationName(station), 0, 0, 96);
      pen.restore();
    }
  }

  /** @param {CanvasRenderingContext2D} pen @param {Scale} x @param {Scale} y @param {Here[]} here */
  #tracks(pen, x, y, here) {
    pen.lineWidth = 2;
    pen.strokeStyle = themed("track");
    for (const [one, other] of this.result.line.joints ?? []) this.#joint(pen, x, y, one, other);
    for (const track of this.tracks) {
      const at = y(track.across);
      pen.strokeStyle = themed("track");
      pen.beginPath();
      pen.moveTo(x(track.start_m) + 2, at);
      pen.lineTo(x(track.end_m) - 2, at);
      pen.stroke();
      if (!state.blocks) continue;
      const taken = here.filter((train) => train.track === track.id);
      for (const block of this.blocks.get(track.id) ?? []) {
        const [left, right] = [x(block.start_m), x(block.end_m)];
        const isTaken = taken.some((train) => Math.min(train.front_m, train.tail_m) < block.end_m && Math.max(train.front_m, train.tail_m) > block.start_m);
        if (isTaken) {
          pen.fillStyle = themed("taken");
          pen.fillRect(left, at - 5, right - left, 10);
        }
        pen.fillStyle = themed(isTaken ? "stop-signal" : "go-signal");
        pen.beginPath();
        pen.arc(track.ways[0] >= 0 ? left : right, at + 9, 2.2, 0, 2 * Math.PI);
        pen.fill();
      }
    }
  }

  /** @param {CanvasRenderingContext2D} pen @param {Scale} x @param {Scale} y @param {string} one @param {string} other */
  #joint(pen, x, y, one, other) {
    const [a, b] = [this.trackOf.get(one), this.trackOf.get(other)];
    if (!a || !b || a.across === b.across) return;
    const [before, after] = a.start_m < b.start_m ? [a, b] : [b, a];
    const at = x((before.end_m + after.start_m) / 2);
    pen.beginPath();
    pen.moveTo(at - 7, y(before.across));
    pen.lineTo(at + 7, y(after.across));
    pen.stroke();
  }

  /** @param {CanvasRenderingContext2D} pen @param {Scale} x @param {Scale} y @param {Run} run @param {number} time_s */
  #points(pen, x, y, run, time_s) {
    if (!state.blocks) return;
    const table = run.obstructions;
    const [from_s, to_s] = [table.numbers("established_s"), table.numbers("lifted_s")];
    const barred = new Set();
    for (let row = 0; row < table.rows; row++) {
      if (from_s[row] <= time_s && !(to_s[row] <= time_s)) barred.add(table.text("obstruction", row));
    }
    const places = [
      ...(this.result.line.turnouts ?? []).map((/** @type {any} */ one) => [one.id, one.position_m ?? one.fouling_start_m]),
      ...(this.result.line.crossings ?? []).map((/** @type {any} */ one) => [one.id, (one.start_m + one.end_m) / 2]),
    ];
    const below = y(this.levels[1]) + 16;
    for (const [id, place_m] of places) {
      const at = x(place_m);
      pen.fillStyle = themed(barred.has(id) ? "stop-signal" : "quiet");
      pen.beginPath();
      pen.moveTo(at, below - 4);
      pen.lineTo(at + 4, below + 3);
      pen.lineTo(at - 4, below + 3);
      pen.fill();
    }
  }

  /** @param {CanvasRenderingContext2D} pen @param {Scale} x @param {Scale} y @param {Here[]} here */
  #trains(pen, x, y, here) {
    pen.textAlign = "center";
    pen.textBaseline = "bottom";
    const ends = new Map();
    for (const train of [...here].sort((a, b) => a.front_m - b.front_m)) {
      const at = y(this.trackOf.get(train.track)?.across ?? this.levels[0]);
      const [front, tail] = [x(train.front_m), x(train.tail_m)];
      const wide = Math.max(Math.abs(front - tail), 9);
      const left = front >= tail ? front - wide : front;
      pen.fillStyle = reasonColour(train.reason);
      pen.strokeStyle = themed(train.train === state.train ? "accent" : "ink");
      pen.lineWidth = train.train === state.train ? 3 : 1;
      pen.beginPath();
      pen.roundRect(left, at - 6, wide, 12, 3);
      pen.fill();
      pen.stroke();
      const half = pen.measureText(train.train).width / 2;
      const middle = left + wide / 2;
      if (middle - half < (ends.get(at) ?? -Infinity) + 3 && train.train !== state.train) continue;
      ends.set(at, middle + half);
      pen.fillStyle = themed("ink");
      pen.fillText(train.train, middle, at - 7);
    }
  }
}
