/** What the page works out from samples, line and train: limits, brake curve, power. */

import { lastNotAbove } from "./telling.js";

/**
 * @typedef {{start_m: number, end_m: number, limit_mps: number, track: string, train_type: string}} Limit
 * @typedef {{start_m: number, end_m: number, gradient: number, track: string}} Gradient
 * @typedef {{start_m: number, end_m: number, radius_m: number, track: string}} Curve
 * @typedef {{length_m: number, mass_kg: number, inertial_mass_kg: number, service_brake_mps2: number,
 *   maximum_speed_mps: number, curve_resistance_m: number,
 *   resistance: {a_n: number, b_nspm: number, c_ns2pm2: number},
 *   supply: {traction_efficiency: number, regeneration_efficiency: number,
 *     regeneration_force_n: number | null, regeneration_power_w: number | null,
 *     regeneration_cutoff_mps: number, auxiliary_w: number}}} TrainType
 */

const GRAVITY_MPS2 = 9.80665;

/**
 * The limit that holds for a whole train. [m/s]
 * @param {Limit[]} limits
 * @param {string} trainType
 * @param {TrainType} type
 * @param {number} front_m
 * @param {string} track
 * @param {boolean} rising
 * @returns {number}
 */
export function limitAt(limits, trainType, type, front_m, track, rising) {
  const tail_m = rising ? front_m - type.length_m : front_m + type.length_m;
  const [low_m, high_m] = [Math.min(front_m, tail_m), Math.max(front_m, tail_m)];
  let least = type.maximum_speed_mps;
  for (const one of limits) {
    if (one.track && one.track !== track) continue;
    if (one.train_type && one.train_type !== trainType) continue;
    if (one.start_m < high_m && one.end_m > low_m) least = Math.min(least, one.limit_mps);
  }
  return least;
}

/**
 * The speed from which the service brake stops within a distance. [m/s]
 * @param {TrainType} type
 * @param {number} distance_m
 * @returns {number}
 */
export function brakeCurve(type, distance_m) {
  return Math.sqrt(2 * type.service_brake_mps2 * Math.max(distance_m, 0));
}

/**
 * Mean height gained over a metre, and curvature, by place.
 * @template {{start_m: number, end_m: number, track: string}} T
 * @param {T[]} stretches
 * @param {number} place_m
 * @param {string} track
 * @returns {T | undefined}
 */
function lyingAt(stretches, place_m, track) {
  return stretches.find(
    (one) => one.start_m <= place_m && place_m < one.end_m && (!one.track || one.track === track),
  );
}

/**
 * Power at the wire, estimated from the speeds of two samples. [W]
 * @param {TrainType} type
 * @param {number} before_mps
 * @param {number} after_mps
 * @param {number} step_s
 * @param {number} slope rise over run, in the train's direction
 * @param {number} radius_m
 * @returns {number}
 */
export function powerBetween(type, before_mps, after_mps, step_s, slope, radius_m) {
  const speed = (before_mps + after_mps) / 2;
  const { supply, resistance } = type;
  const running = speed > 0 ? resistance.a_n + (resistance.b_nspm + resistance.c_ns2pm2 * speed) * speed : 0;
  const curve = Number.isFinite(radius_m) ? (type.mass_kg * GRAVITY_MPS2 * type.curve_resistance_m) / radius_m : 0;
  const weight = type.mass_kg * GRAVITY_MPS2 * slope;
  const wheel = ((type.inertial_mass_kg * (after_mps - before_mps)) / step_s + running + curve + weight) * speed;
  if (wheel >= 0) return wheel / supply.traction_efficiency + supply.auxiliary_w;
  if (speed < supply.regeneration_cutoff_mps) return supply.auxiliary_w;
  const electric = Math.min(-wheel, (supply.regeneration_force_n ?? Infinity) * speed, supply.regeneration_power_w ?? Infinity);
  return supply.auxiliary_w - electric * supply.regeneration_efficiency;
}

/**
 * Power at the wire of a whole trip, sample by sample. [W]
 * @param {{gradients?: Gradient[], curves?: Curve[]}} line
 * @param {TrainType} type
 * @param {import("./model.js").Trip} trip
 * @returns {Float64Array}
 */
export function powerOf(line, type, trip) {
  const { time_s, front_m, speed_mps } = trip;
  const rising = front_m[front_m.length - 1] >= front_m[0];
  const found = new Float64Array(trip.length);
  for (let i = 1; i < trip.length; i++) {
    const place_m = (front_m[i] + front_m[i - 1]) / 2 - (rising ? 1 : -1) * (type.length_m / 2);
    const track = trip.text("track", i);
    const slope = (lyingAt(line.gradients ?? [], place_m, track)?.gradient ?? 0) * (rising ? 1 : -1);
    const radius_m = lyingAt(line.curves ?? [], place_m, track)?.radius_m ?? Infinity;
    found[i] = powerBetween(type, speed_mps[i - 1], speed_mps[i], time_s[i] - time_s[i - 1], slope, radius_m);
  }
  return found;
}

/**
 * Energy from the first sample on. [kWh]
 * @param {Float64Array} time_s
 * @param {Float64Array} power_w
 * @returns {Float64Array}
 */
export function energyOf(time_s, power_w) {
  const found = new Float64Array(power_w.length);
  for (let i = 1; i < power_w.length; i++) {
    found[i] = found[i - 1] + (power_w[i] * (time_s[i] - time_s[i - 1])) / 3.6e6;
  }
  return found;
}

/**
 * Stretches of a trip in which the same thing bound its speed for the same cause.
 * @param {import("./model.js").Trip} trip
 * @returns {{start: number, end: number, reason: string, plan: string, cause: string}[]}
 */
export function phasesOf(trip) {
  const [reason, plan, cause] = ["reason", "plan", "cause"].map((name) => trip.run.samples.texts(name));
  const phases = [];
  let start = trip.start;
  for (let i = trip.start + 1; i <= trip.end; i++) {
    const same =
      i < trip.end &&
      reason.codes[i] === reason.codes[start] &&
      plan.codes[i] === plan.codes[start] &&
      cause.codes[i] === cause.codes[start];
    if (same) continue;
    phases.push({
      start: start - trip.start,
      end: Math.min(i - trip.start, trip.length - 1),
      reason: reason.texts[reason.codes[start]],
      plan: plan.texts[plan.codes[start]] ?? "",
      cause: cause.texts[cause.codes[start]] ?? "",
    });
    start = i;
  }
  return phases;
}

/**
 * Where along a centre line something is.
 * @param {number[][]} points chainage, longitude, latitude; rising
 * @param {number} place_m
 * @returns {[number, number]}
 */
export function onMap(points, place_m) {
  const places = points.map(([at]) => at);
  const index = Math.min(Math.max(lastNotAbove(places, place_m), 0), points.length - 2);
  const [from, to] = [points[index], points[index + 1]];
  const share = Math.min(Math.max((place_m - from[0]) / (to[0] - from[0] || 1), 0), 1);
  return [from[1] + share * (to[1] - from[1]), from[2] + share * (to[2] - from[2])];
}
