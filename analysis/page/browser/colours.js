/** Colours and dashes: distinct to colour-blind readers, readable on both grounds. */

/** @typedef {{colour: string, dash: number[]}} Pen */

// Okabe and Ito 2008 and Tol's muted scheme, darkened or lightened until they stand out; then each time the colour that is
// farthest from all before it for whoever sees it least, as for the figures.
const LIGHT = [
  "#0072b2", "#c84f00", "#008060", "#aa4499", "#4b2d0f", "#4b0096", "#ff1eff", "#0000f0",
  "#87004b", "#96965a", "#004b69", "#0096ff", "#873c00", "#a578d2", "#781ec3", "#e10f69",
];
const DARK = [
  "#58aee8", "#ff9452", "#34cf9f", "#b40ff0", "#697800", "#e1f000", "#ffd2ff", "#786996",
  "#ff004b", "#a578ff", "#d2f0c3", "#ff5ac3", "#1ec300", "#78f087", "#b46969", "#b4c3f0",
];
/** @type {number[][]} */
const DASHES = [[], [7, 3], [2, 2.5], [9, 3, 2, 3]];

const REASON_LIGHT = {
  traction: "#7fbf7b", line_limit: "#b8c4ce", train_ahead: "#d73027", obstruction_ahead: "#8c510a",
  station_stop: "#6baed6", plan: "#f2b134", emergency: "#7a0177", peer: "#bdbdbd",
  dwelling: "#e9ecef", held: "#9e7bb5",
};
const REASON_DARK = {
  traction: "#4f9150", line_limit: "#5d6b78", train_ahead: "#ff6b5e", obstruction_ahead: "#c98b4a",
  station_stop: "#4a86b3", plan: "#d9a02c", emergency: "#d45bd0", peer: "#777777",
  dwelling: "#333a42", held: "#9a7cb8",
};

/** @returns {boolean} */
export function isDark() {
  return document.documentElement.dataset.theme === "dark";
}

/**
 * How a controller is drawn.
 * @param {number} index its place
 * @returns {Pen}
 */
export function pen(index) {
  const colours = isDark() ? DARK : LIGHT;
  return {
    colour: colours[index % colours.length],
    dash: DASHES[Math.floor(index / colours.length) % DASHES.length],
  };
}

/**
 * @param {string} reason
 * @returns {string}
 */
export function reasonColour(reason) {
  const colours = /** @type {Record<string, string>} */ (isDark() ? REASON_DARK : REASON_LIGHT);
  return colours[reason] ?? "#888888";
}

/**
 * A colour of the style sheet.
 * @param {string} name
 * @returns {string}
 */
export function themed(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim() || "#888";
}

/**
 * A colour for how late a train is: from nothing to as late as can be, early in blue.
 * @param {number} value
 * @param {number} most
 * @returns {string}
 */
export function heat(value, most) {
  if (!Number.isFinite(value)) return "transparent";
  const share = Math.min(Math.abs(value) / most, 1);
  if (value < 0) return isDark() ? mix("#1c2126", "#4a90d9", share) : mix("#ffffff", "#2f79b8", share);
  const steps = isDark()
    ? ["#1c2126", "#6b3d17", "#d9772b", "#ffd9a0"]
    : ["#ffffff", "#fdd49e", "#e34a33", "#6d0000"];
  const place = share * (steps.length - 1);
  const low = Math.min(Math.floor(place), steps.length - 2);
  return mix(steps[low], steps[low + 1], place - low);
}

/**
 * @param {string} from
 * @param {string} to
 * @param {number} share
 * @returns {string}
 */
function mix(from, to, share) {
  const part = (/** @type {string} */ colour, /** @type {number} */ at) =>
    parseInt(colour.slice(at, at + 2), 16);
  const mixed = [1, 3, 5].map((at) => Math.round(part(from, at) + share * (part(to, at) - part(from, at))));
  return `rgb(${mixed.join(",")})`;
}
