/** What is chosen on the page; views listen, and the address keeps it. */

/**
 * @typedef {{result: number, key: string, shown: string[], focus: string, second: string,
 *   train: string, time_s: number, language: "en" | "ja", theme: "auto" | "light" | "dark",
 *   axis: "time" | "distance", measure: string, booked: boolean, stops: boolean,
 *   delays: boolean, obstructions: boolean, bands: boolean, numbers: boolean,
 *   blocks: boolean}} State
 * @typedef {(changed: Set<keyof State>) => void} Listener
 */

/** @type {State} */
export const state = {
  result: 0,
  key: "",
  shown: [],
  focus: "",
  second: "",
  train: "",
  time_s: NaN,
  language: "en",
  theme: "auto",
  axis: "time",
  measure: "secondary_delay_s",
  booked: true,
  stops: true,
  delays: true,
  obstructions: true,
  bands: false,
  numbers: true,
  blocks: true,
};

/** @type {Set<Listener>} */
const listeners = new Set();

/** @param {Listener} listener */
export function listen(listener) {
  listeners.add(listener);
}

/**
 * Choose something else.
 * @param {Partial<State>} wanted
 */
export function choose(wanted) {
  /** @type {Set<keyof State>} */
  const changed = new Set();
  for (const name of /** @type {(keyof State)[]} */ (Object.keys(wanted))) {
    if (!Object.is(state[name], wanted[name])) changed.add(name);
  }
  if (!changed.size) return;
  Object.assign(state, wanted);
  for (const listener of [...listeners]) listener(changed);
}

/** What of the state an address holds. @returns {string} */
export function address() {
  const told = new URLSearchParams();
  if (state.train) told.set("train", state.train);
  if (Number.isFinite(state.time_s)) told.set("at", String(Math.round(state.time_s)));
  if (state.shown.length) told.set("show", state.shown.join("\n"));
  if (state.language !== "en") told.set("language", state.language);
  return told.toString();
}
