/** Numbers, times and places as a reader likes to see them. */

/**
 * A time of day.
 * @param {number} time_s seconds after midnight
 * @param {boolean} [seconds]
 * @returns {string}
 */
export function clock(time_s, seconds = true) {
  if (!Number.isFinite(time_s)) return "–";
  const whole = Math.round(time_s);
  const two = (/** @type {number} */ value) => String(value).padStart(2, "0");
  const told = `${two(Math.floor(whole / 3600) % 24)}:${two(Math.floor(whole / 60) % 60)}`;
  return seconds ? `${told}:${two(whole % 60)}` : told;
}

/**
 * Seconds after midnight of a clock time such as 7:36 or 07:36:20; NaN if it is none.
 * @param {string} text
 * @returns {number}
 */
export function clockSeconds(text) {
  const found = /^\s*(\d{1,2}):(\d{2})(?::(\d{2}))?\s*$/.exec(text);
  if (!found) return NaN;
  return 3600 * Number(found[1]) + 60 * Number(found[2]) + Number(found[3] ?? 0);
}

/**
 * A number with separators.
 * @param {number} value
 * @param {number} [decimals]
 * @returns {string}
 */
export function number(value, decimals = 1) {
  if (!Number.isFinite(value)) return "–";
  const told = value.toFixed(decimals);
  const [whole, part] = told.replace(/^-(?=0(\.0*)?$)/, "").split(".");
  const spaced = whole.replace(/\B(?=(\d{3})+(?!\d))/g, ",");
  return part ? `${spaced}.${part}` : spaced;
}

/**
 * A number with its sign.
 * @param {number} value
 * @param {number} [decimals]
 * @returns {string}
 */
export function signed(value, decimals = 1) {
  const told = number(value, decimals);
  return Number.isFinite(value) && !told.startsWith("-") ? `+${told}` : told;
}

/**
 * As many decimals as a mean of that size deserves.
 * @param {number} value
 * @returns {string}
 */
export function mean(value) {
  const size = Math.abs(value);
  return number(value, size >= 1000 ? 0 : size > 0 && size < 1 ? 2 : 1);
}

/**
 * A place in kilometres.
 * @param {number} place_m
 * @returns {string}
 */
export function kilometres(place_m) {
  return `${number(place_m / 1000, 3)} km`;
}

/**
 * A speed in km/h.
 * @param {number} speed_mps
 * @returns {string}
 */
export function kmh(speed_mps) {
  return `${number(3.6 * speed_mps, 1)} km/h`;
}

/**
 * Round steps for an axis.
 * @param {number} span
 * @param {number} most so many steps at most
 * @returns {number}
 */
export function roundStep(span, most) {
  const least = span / Math.max(most, 1);
  const power = 10 ** Math.floor(Math.log10(least));
  const step = [1, 2, 5, 10].find((one) => one * power >= least * (1 - 1e-9)) ?? 10;
  return step * power;
}

const CLOCK_STEPS_S = [1, 5, 10, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 28800];

/**
 * Round steps for a clock axis.
 * @param {number} span_s
 * @param {number} most
 * @returns {number}
 */
export function clockStep(span_s, most) {
  return CLOCK_STEPS_S.find((step) => span_s / step <= most) ?? 28800;
}

/**
 * Move labels apart just as far as they need (pool adjacent violators).
 * @param {number[]} places rising
 * @param {number} gap
 * @returns {number[]}
 */
export function spread(places, gap) {
  /** @type {{value: number, count: number}[]} */
  const pools = [];
  places.forEach((place, index) => {
    pools.push({ value: place - index * gap, count: 1 });
    while (pools.length > 1 && pools[pools.length - 2].value > pools[pools.length - 1].value) {
      const last = /** @type {{value: number, count: number}} */ (pools.pop());
      const other = pools[pools.length - 1];
      const count = last.count + other.count;
      other.value = (last.value * last.count + other.value * other.count) / count;
      other.count = count;
    }
  });
  const moved = pools.flatMap(({ value, count }) => Array(count).fill(value));
  return moved.map((value, index) => value + index * gap);
}

/**
 * The last place in a rising list that is not above a value; -1 if all are.
 * @param {ArrayLike<number>} values
 * @param {number} value
 * @param {number} [from]
 * @param {number} [to]
 * @returns {number}
 */
export function lastNotAbove(values, value, from = 0, to = values.length) {
  let low = from;
  let high = to;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (values[middle] <= value) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}
