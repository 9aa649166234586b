/** The page: reads the data, builds the sections when they come into sight, and keeps them in step. */

import { unpack } from "./unpack.js";
import { Result } from "./model.js";
import { choice, el, fill } from "./elements.js";
import { address, choose, listen, state } from "./state.js";
import { controls, firstChoice } from "./controls.js";
import { overview } from "./overview.js";
import { Diagram } from "./diagram.js";
import { TrainView } from "./train_view.js";
import { LineView } from "./line_view.js";
import { Animation } from "./animation.js";
import { about, papers } from "./about.js";
import { word } from "./words.js";

const SCHEMA = 1;
const SECTIONS = /** @type {const} */ (["diagram", "train_view", "line_view", "animation", "papers", "about"]);

/**
 * What is on the page now.
 * @type {{results: Result[], told: any, diagram?: Diagram, train?: TrainView, line?: LineView,
 *   animation?: Animation, made: Set<string>}}
 */
const page = { results: [], told: null, made: new Set() };
const root = /** @type {HTMLElement} */ (document.getElementById("page"));
const spoken = el("div", { class: "hidden", role: "status", "aria-live": "polite", id: "spoken" });

/** @param {string} told */
function say(told) {
  spoken.textContent = told;
}

/** @returns {Result} */
function current() {
  return page.results[state.result];
}

function theme() {
  const dark = state.theme === "dark" || (state.theme === "auto" && matchMedia("(prefers-color-scheme: dark)").matches);
  document.documentElement.dataset.theme = dark ? "dark" : "light";
}

/** Choose what is shown of other results. */
function open() {
  const result = current();
  const first = firstChoice(result);
  const wanted = new URLSearchParams(location.hash.slice(1));
  const names = (wanted.get("show") ?? "").split("\n").filter((name) => result.controllers.some((one) => one.name === name));
  const train = wanted.get("train") ?? "";
  const at_s = Number(wanted.get("at") ?? NaN);
  Object.assign(state, first, {
    key: result.keys[0] ?? "",
    shown: names.length ? names : first.shown,
    train: result.trains.includes(train) ? train : worstTrain(result),
    time_s: wanted.has("at") && Number.isFinite(at_s) ? at_s : NaN,
  });
  if (!state.shown.includes(state.focus)) state.focus = state.shown[0];
}

/** The train that stands longest under the baseline, else the first one. @param {Result} result */
function worstTrain(result) {
  const run = result.run(state.focus || result.controllers[0].name, result.keys[0] ?? "");
  const durations_s = run?.stops.numbers("duration_s") ?? new Float64Array();
  if (run && durations_s.length) return run.stops.text("train", durations_s.indexOf(Math.max(...durations_s)));
  return result.trains[0] ?? "";
}

/** Build everything anew, in the language that is chosen. */
function build() {
  document.documentElement.lang = state.language;
  page.made.clear();
  page.diagram = page.train = page.line = page.animation = undefined;
  const result = current();
  const main = el("main", { id: "main" }, overview(result, page.told.indicators, page.results));
  main.append(el("div", { id: "bar" }, controls(result, say)));
  for (const name of SECTIONS) {
    main.append(
      el(
        "section",
        { id: name, "aria-labelledby": `${name}-title` },
        el("h2", { id: `${name}-title` }, word(name)),
        el("div", { class: "body", "data-section": name }),
      ),
    );
  }
  fill(root, el("a", { href: "#main", class: "skip" }, word("skip")), heading(result), main, spoken);
  observe();
}

/** @param {Result} result */
function heading(result) {
  const { told } = result;
  const seeds = told.seeds.length > 6 ? `${told.seeds[0]}–${told.seeds[told.seeds.length - 1]} (${told.seeds.length})` : told.seeds.join(", ");
  const languages = /** @type {[string, string][]} */ ([["en", "English"], ["ja", "日本語"]]);
  const themes = /** @type {[string, string][]} */ (["auto", "light", "dark"].map((name) => [name, word(name)]));
  return el(
    "header",
    {},
    el(
      "div",
      { class: "row choices" },
      page.results.length > 1
        ? choice({
            id: "results",
            label: word("results"),
            options: page.results.map((one, at) => [String(at), one.name]),
            value: String(state.result),
            onchange: (at) => choose({ result: Number(at) }),
          })
        : null,
      choice({ id: "language", label: word("language"), options: languages, value: state.language, onchange: (language) => choose({ language: language === "ja" ? "ja" : "en" }) }),
      choice({ id: "theme", label: word("theme"), options: themes, value: state.theme, onchange: (name) => choose({ theme: /** @type {"auto" | "light" | "dark"} */ (name) }) }),
    ),
    el("h1", {}, told.title),
    el(
      "p",
      { class: "quiet" },
      word("trains_controllers_seeds", {
        trains: result.trains.length,
        controllers: result.controllers.length,
        seeds: word("seeds_told", { seeds }),
      }),
    ),
    el(
      "nav",
      { "aria-label": word("sections") },
      ["findings", ...SECTIONS].map((name) => el("a", { href: `#${name}` }, word(name))),
    ),
  );
}

/** @param {string} name @returns {Node} */
function make(name) {
  const result = current();
  switch (name) {
    case "diagram":
      page.diagram = new Diagram(result);
      return page.diagram.element;
    case "train_view":
      page.train = new TrainView(result);
      return page.train.element;
    case "line_view":
      page.line = new LineView(result);
      return page.line.element;
    case "animation":
      page.animation = new Animation(result);
      return page.animation.element;
    case "papers":
      return papers(result);
    default:
      return about(result, page.told.indicators, page.told.cite);
  }
}

/** @param {Element} body */
function fillSection(body) {
  const name = /** @type {HTMLElement} */ (body).dataset.section ?? "";
  if (page.made.has(name)) return;
  page.made.add(name);
  try {
    fill(body, make(name));
  } catch (error) {
    // Strange results may break a part, never the page.
    fill(body, el("p", { role: "alert" }, word("section_failed", { why: String(error) })));
  }
}

/** Sections are made when they come near. */
function observe() {
  const observer = new IntersectionObserver(
    (entries) => {
      for (const entry of entries) {
        if (entry.isIntersecting) {
          observer.unobserve(entry.target);
          fillSection(entry.target);
        }
      }
    },
    { rootMargin: "400px" },
  );
  for (const body of document.querySelectorAll("[data-section]")) observer.observe(body);
}

/** Make whatever is missing, for the printer. */
function makeAll() {
  for (const body of document.querySelectorAll("[data-section]")) fillSection(body);
}

/** Draw again what is drawn on canvas. */
function repaint() {
  page.diagram?.frame.paint();
  for (const frame of page.train?.frames ?? []) frame.paint();
  page.line?.drawHeat();
  page.line?.places.paint();
  page.animation?.paint();
}

/** @param {Set<keyof import("./state.js").State>} changed */
function update(changed) {
  if (changed.has("theme")) theme();
  if (changed.has("result")) open();
  if (["result", "language", "theme"].some((name) => changed.has(/** @type {any} */ (name)))) {
    const { scrollY } = window;
    build();
    window.scrollTo(0, scrollY);
    return;
  }
  const only = (/** @type {string[]} */ ...names) => [...changed].every((name) => names.includes(name));
  if (!only("time_s", "measure", "axis", "blocks", "booked", "stops", "delays", "obstructions", "bands", "numbers")) {
    const bar = document.getElementById("bar");
    const focus = document.activeElement?.getAttribute("data-controller");
    if (bar) fill(bar, controls(current(), say));
    if (focus) bar?.querySelector(/** @type {any} */ (`[data-controller="${CSS.escape(focus)}"]`))?.focus();
  }
  if (changed.has("train") || changed.has("time_s")) page.diagram?.seek();
  if (changed.has("key")) page.diagram?.reach();
  page.diagram?.frame.ask();
  if (!only("measure", "blocks", "second", "booked", "stops", "delays", "obstructions", "bands", "numbers")) page.train?.update();
  if (!only("time_s", "axis", "blocks", "second", "booked", "stops", "delays", "obstructions", "bands", "numbers")) page.line?.update();
  if (!only("measure", "axis", "booked", "stops", "delays", "obstructions", "bands", "numbers")) page.animation?.update();
  try {
    history.replaceState(null, "", `#${address()}`);
  } catch {
    // A page shown inside another one has no address of its own.
  }
}

async function start() {
  const holder = /** @type {HTMLElement} */ (document.getElementById("data"));
  const { told, content } = await unpack(holder.textContent ?? "");
  if (told.schema !== SCHEMA) throw new Error(`schema ${told.schema}`);
  holder.remove();
  page.told = told;
  page.results = told.results.map((/** @type {any} */ result) => new Result(result, content));
  const wanted = new URLSearchParams(location.hash.slice(1)).get("language") ?? navigator.language;
  state.language = wanted.startsWith("ja") ? "ja" : "en";
  theme();
  open();
  build();
  listen(update);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    theme();
    build();
  });
  window.addEventListener("beforeprint", () => {
    makeAll();
    // Paper is white.
    document.documentElement.dataset.theme = "light";
    repaint();
  });
  window.addEventListener("afterprint", () => {
    theme();
    repaint();
  });
  const body = document.querySelector('[data-section="diagram"]');
  if (body) fillSection(body);
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  root.removeAttribute("aria-busy");
  root.dataset.ready = String(Math.round(performance.now()));
}

start().catch((error) => {
  root.removeAttribute("aria-busy");
  fill(root, el("p", { role: "alert" }, word("failed", { why: String(error) })));
});

/** For tests of the page in a browser. */
Object.assign(window, { kankaku: { page, state, choose, makeAll } });
