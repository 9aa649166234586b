/** What stays in sight: controllers, train, seed. */

import { choice, el } from "./elements.js";
import { pen } from "./colours.js";
import { choose, state } from "./state.js";
import { slowestIn } from "./moment.js";
import { clockSeconds } from "./telling.js";
import { word } from "./words.js";

/** @typedef {import("./model.js").Result} Result */

/**
 * @param {Result} result
 * @param {(told: string) => void} say
 * @returns {HTMLElement}
 */
export function controls(result, say) {
  const several = result.keys.length > 1;
  return el(
    "div",
    { class: "controls", role: "group", "aria-label": word("shown_controllers") },
    finder(result, say),
    several ? keyChoice(result) : null,
    chips(result),
  );
}

/** @param {Result} result */
function keyChoice(result) {
  const delays = result.told.delays_s.length > 1;
  const options = result.keys.map((key) => {
    const [seed, delay_s] = key.split("/");
    return /** @type {[string, string]} */ ([key, delays ? `${seed}, ${delay_s} s` : seed]);
  });
  return choice({
    id: "key",
    label: delays ? `${word("seed")}, ${word("initial_delay")}` : word("seed"),
    options,
    value: state.key,
    onchange: (key) => choose({ key }),
  });
}

/** @param {Result} result */
function chips(result) {
  const names = result.controllers.map(({ name }) => name);
  return el(
    "div",
    { class: "chips" },
    names.map((name, index) => {
      const on = state.shown.includes(name);
      return el(
        "button",
        {
          type: "button",
          class: "chip",
          "data-controller": name,
          "aria-pressed": String(on),
          style: { "--own": pen(index).colour },
          onclick: () => toggle(names, name),
        },
        el("span", { class: "swatch", "aria-hidden": "true" }),
        name.replaceAll("_", " "),
      );
    }),
    names.length > 2
      ? [
          el("button", { type: "button", class: "link", id: "show-all", onclick: () => choose({ shown: names }) }, word("all")),
          el("button", { type: "button", class: "link", id: "show-few", onclick: () => choose(firstChoice(result)) }, word("few")),
        ]
      : null,
  );
}

/** @param {string[]} names @param {string} name */
function toggle(names, name) {
  const kept = state.shown.includes(name) ? state.shown.filter((one) => one !== name) : [...state.shown, name];
  if (!kept.length) return;
  const shown = names.filter((one) => kept.includes(one));
  choose({ shown, focus: shown.includes(state.focus) ? state.focus : shown[0] });
}

/**
 * What is shown at first: the baseline and who stands least.
 * @param {Result} result
 * @returns {{shown: string[], focus: string, second: string}}
 */
export function firstChoice(result) {
  const baseline = result.controllers[0].name;
  const best = result.told.leaders.stops ?? baseline;
  const other = best !== baseline ? best : (result.controllers[1]?.name ?? "");
  const shown = [...new Set([baseline, other])].filter(Boolean);
  return { shown, focus: baseline, second: other };
}

/** @param {Result} result @param {(told: string) => void} say */
function finder(result, say) {
  const field = /** @type {HTMLInputElement} */ (
    el("input", { type: "search", id: "find", list: "trains", autocomplete: "off", placeholder: "723B 07:36", value: state.train, size: 12 })
  );
  const find = () => {
    const [name = "", at = ""] = field.value.trim().split(/\s+/);
    const train = result.trains.find((one) => one.toLowerCase() === name.toLowerCase());
    if (!train) {
      say(word("no_such_train", { train: name }));
      return;
    }
    const asked_s = clockSeconds(at);
    const trip = result.run(state.focus, state.key)?.trips.get(train);
    // A minute means whatever happened in it.
    const time_s = at.split(":").length === 2 ? slowestIn(trip, asked_s) : asked_s;
    say(`${word("train")} ${train}`);
    choose({ train, time_s: Number.isFinite(time_s) ? time_s : NaN });
    const seek = () => document.getElementById("train_view")?.scrollIntoView({ behavior: "instant" });
    seek();
    // Parts that come near are made now, and move the others.
    setTimeout(seek, 60);
  };
  return el(
    "form",
    {
      class: "finder",
      role: "search",
      onsubmit: (/** @type {Event} */ event) => {
        event.preventDefault();
        find();
      },
    },
    el("label", { for: "find", class: "hidden" }, word("find_train")),
    field,
    el("datalist", { id: "trains" }, result.trains.map((name) => el("option", { value: name }))),
    el("button", { type: "submit" }, word("find")),
  );
}
