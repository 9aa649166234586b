/** The line: delays by train and station, headways and dwells, stops by place. */

import { choice, el, fill } from "./elements.js";
import { Frame } from "./frame.js";
import { shownRuns } from "./runs.js";
import { choose, state } from "./state.js";
import { heat, pen as penOf, themed } from "./colours.js";
import { clock, kilometres, number, signed } from "./telling.js";
import { stationName, word } from "./words.js";
import { sharesOf, sharesTold } from "./moment.js";
import { headways } from "./station_times.js";
import { delayTree } from "./tree.js";

/**
 * @typedef {import("./model.js").Result} Result
 * @typedef {import("./model.js").Run} Run
 */

const MEASURES = /** @type {const} */ ([
  ["secondary_delay_s", "secondary_delay"],
  ["primary_delay_s", "primary_delay"],
  ["arrival_delay_s", "arrival_delay"],
  ["departure_delay_s", "departure_delay"],
]);
const CELL = 17;
const HEAD = 112;
const MOST_HEIGHT = 900;
const LEAST_TOLD_S = 5;

export class LineView {
  /** @param {Result} result */
  constructor(result) {
    this.result = result;
    this.canvas = /** @type {HTMLCanvasElement} */ (el("canvas", { tabindex: "0", role: "img", id: "heat" }));
    this.told = el("div", { class: "hover", hidden: true });
    this.scroll = el("div", { class: "scroll tall stage" }, this.canvas, this.told);
    this.cell = { row: 0, column: 0 };
    this.head = el("div", { class: "row" });
    this.scale = el("div", { class: "legend" });
    this.stations = el("div", {});
    this.places = new Frame({
      label: word("stops_by_place"),
      height: 230,
      margins: { left: 54, right: 12, top: 24, bottom: 74 },
      whole: () => {
        const [low, high] = this.result.extent_m;
        return [low - 0.02 * (high - low), high + 0.02 * (high - low), 0, 1];
      },
      draw: () => this.drawStops(),
      hover: (x, y) => this.hoverStop(x, y),
      pick: (x, y) => this.pickStop(x, y),
    });
    this.tree = el("div", {});
    this.element = el("div", {});
    this.#listen();
    this.update();
    new ResizeObserver(() => this.drawHeat()).observe(this.element);
  }

  get run() {
    return this.result.run(state.focus, state.key);
  }

  update() {
    fill(
      this.head,
      choice({
        id: "heat-controller",
        label: word("controller"),
        options: shownRuns(this.result).map(({ run }) => [run.controller, run.controller.replaceAll("_", " ")]),
        value: state.focus,
        onchange: (focus) => choose({ focus }),
      }),
      choice({
        id: "measure",
        label: word("measure"),
        options: MEASURES.map(([name, told]) => [name, `${word(told)} [s]`]),
        value: state.measure,
        onchange: (measure) => choose({ measure }),
      }),
    );
    fill(
      this.element,
      el("h3", {}, word("delays_by_place")),
      el("p", { class: "quiet" }, word("heat_told")),
      this.head,
      this.longest(),
      this.scale,
      this.scroll,
      el("h3", {}, word("who_delayed")),
      el("p", { class: "quiet" }, word("who_told")),
      this.tree,
      el("h3", {}, word("stops_by_place")),
      el("p", { class: "quiet" }, word("stops_told")),
      this.places.element,
      el("h3", {}, word("headways")),
      el("p", { class: "quiet" }, word("headways_told")),
      this.stations,
    );
    this.drawHeat();
    fill(this.tree, this.run ? delayTree(this.result, this.run) : "");
    fill(this.stations, headways(this.result));
    this.places.ask();
  }

  /** The greatest lateness owed to others, in words. */
  longest() {
    const { run } = this;
    if (!run) return null;
    const delays_s = run.calls.numbers("secondary_delay_s");
    let most = -1;
    delays_s.forEach((value, row) => {
      if (value > (most < 0 ? 0 : delays_s[most])) most = row;
    });
    if (most < 0) return el("p", {}, word("nobody_delayed"));
    const train = run.calls.text("train", most);
    const station = this.result.stationOf.get(run.calls.text("station", most));
    const told = { train, station: station ? stationName(station) : "", seconds: number(delays_s[most], 0) };
    const time_s = run.calls.numbers("arrival_s")[most];
    const from = sharesTold(this.result, sharesOf(run, train, time_s));
    return el(
      "p",
      {},
      word("longest_secondary", told),
      " ",
      from ? word("mostly_from", { told: from }) : null,
      " ",
      el("button", { type: "button", class: "link", onclick: () => choose({ train, time_s }) }, `→ ${train}`),
    );
  }

  /** @returns {{trains: string[], values: Map<string, number>, rows: Map<string, number>}} */
  cells() {
    const { run } = this;
    const trains = run ? [...run.callsOf.keys()] : [];
    const values = new Map();
    const rows = new Map();
    if (run) {
      const measured = run.calls.numbers(state.measure);
      for (let row = 0; row < run.calls.rows; row++) {
        const at = `${run.calls.text("train", row)}\n${run.calls.text("station", row)}`;
        values.set(at, measured[row]);
        rows.set(at, row);
      }
    }
    return { trains, values, rows };
  }

  /** @returns {number} */
  get wide() {
    const room = (this.element.clientWidth || 900) - 154;
    return Math.max(Math.min(room / Math.max(this.result.stations.length, 1), 72), 24);
  }

  drawHeat() {
    const { trains, values } = this.cells();
    const { stations } = this.result;
    const wide = this.wide;
    const [width, height] = [80 + wide * stations.length + 70, HEAD + CELL * trains.length + 8];
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    const { canvas } = this;
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
    canvas.style.setProperty("width", `${width}px`);
    canvas.style.setProperty("height", `${height}px`);
    canvas.setAttribute("aria-label", `${word("delays_by_place")}. ${word("heat_told")}`);
    this.scroll.style.setProperty("max-height", `${MOST_HEIGHT}px`);
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.font = "12px system-ui, sans-serif";
    pen.clearRect(0, 0, width, height);
    const known = [...values.values()].filter(Number.isFinite);
    this.most = Math.max(...known, 30);
    stations.forEach((station, column) => {
      pen.save();
      pen.translate(80 + wide * (column + 0.5) - 3, HEAD - 6);
      pen.rotate(-Math.PI / 3.4);
      pen.fillStyle = themed("ink");
      pen.fillText(stationName(station), 0, 0);
      pen.restore();
    });
    trains.forEach((train, row) => this.drawRow(pen, train, row, values, wide));
    this.legend();
  }

  /** @param {CanvasRenderingContext2D} pen @param {string} train @param {number} row @param {Map<string, number>} values @param {number} wide */
  drawRow(pen, train, row, values, wide) {
    const y = HEAD + CELL * row;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    pen.fillStyle = train === state.train ? themed("accent") : themed("ink");
    pen.fillText(train, 72, y + CELL / 2, 70);
    this.result.stations.forEach((station, column) => {
      const value = values.get(`${train}\n${station.id}`);
      if (value === undefined) return;
      pen.fillStyle = heat(value, /** @type {number} */ (this.most));
      pen.fillRect(80 + wide * column, y, wide - 1, CELL - 1);
      if (wide >= 34 && Number.isFinite(value) && Math.abs(value) >= LEAST_TOLD_S) {
        pen.textAlign = "center";
        const share = Math.abs(value) / /** @type {number} */ (this.most);
        pen.fillStyle = share > 0.55 ? themed("on-heat") : themed("ink");
        pen.fillText(number(value, 0), 80 + wide * (column + 0.5), y + CELL / 2 + 1);
      }
    });
    pen.textAlign = "left";
    if (train === state.train) {
      pen.strokeStyle = themed("accent");
      pen.lineWidth = 2;
      pen.strokeRect(79, y, wide * this.result.stations.length, CELL - 1);
    }
  }

  legend() {
    const most = /** @type {number} */ (this.most);
    fill(
      this.scale,
      [0, 0.2, 0.4, 0.6, 0.8, 1].map((share) =>
        el("span", { class: "key" }, el("span", { class: "swatch box", style: { background: heat(share * most, most) } }), `${number(share * most, 0)} s`),
      ),
    );
  }

  #listen() {
    const at = (/** @type {MouseEvent} */ event) => {
      const column = Math.floor((event.offsetX - 80) / this.wide);
      const row = Math.floor((event.offsetY - HEAD) / CELL);
      return this.#cell(row, column);
    };
    this.canvas.addEventListener("pointermove", (event) => this.#tell(at(event), event));
    this.canvas.addEventListener("pointerleave", () => this.#tell(null));
    this.canvas.addEventListener("click", (event) => this.#choose(at(event)));
    this.canvas.addEventListener("keydown", (event) => this.#key(event));
  }

  /** @param {number} row @param {number} column */
  #cell(row, column) {
    const { trains, values, rows } = this.cells();
    const station = this.result.stations[column];
    const train = trains[row];
    const at = `${train}\n${station?.id}`;
    return rows.has(at) ? { train, station, value: values.get(at), call: /** @type {number} */ (rows.get(at)) } : null;
  }

  /** @param {ReturnType<LineView["cells"]> extends never ? never : any} cell @param {MouseEvent} [event] */
  #tell(cell, event) {
    this.told.hidden = !cell;
    if (!cell || !this.run) return;
    const { calls } = this.run;
    const lines = [
      `${cell.train}, ${stationName(cell.station)}`,
      `${word("arrival")} ${clock(calls.numbers("arrival_s")[cell.call])} (${signed(calls.numbers("arrival_delay_s")[cell.call], 0)} s)`,
      `${word("primary_delay")} ${number(calls.numbers("primary_delay_s")[cell.call], 0)} s`,
      `${word("secondary_delay")} ${number(calls.numbers("secondary_delay_s")[cell.call], 0)} s`,
    ];
    fill(this.told, lines.map((line, index) => el(index ? "div" : "strong", {}, line)));
    if (event) {
      const right = event.offsetX > 300;
      this.told.style.setProperty("left", `${right ? event.offsetX - 210 : event.offsetX + 14}px`);
      this.told.style.setProperty("top", `${event.offsetY + 12}px`);
    }
  }

  /** @param {any} cell */
  #choose(cell) {
    if (!cell || !this.run) return;
    choose({ train: cell.train, time_s: this.run.calls.numbers("arrival_s")[cell.call] });
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const steps = /** @type {Record<string, number>} */ ({ ArrowUp: -1, ArrowDown: 1 });
    const step = steps[event.key];
    if (!step || !this.run) return;
    event.preventDefault();
    const trains = [...this.run.callsOf.keys()];
    const row = Math.min(Math.max(trains.indexOf(state.train) + step, 0), trains.length - 1);
    choose({ train: trains[row] });
  }

  /** @returns {{x: number, top: number, run: Run, row: number, index: number}[]} */
  stems() {
    const frame = this.places;
    return shownRuns(this.result).flatMap(({ run, index }) => {
      const [front_m, duration_s] = [run.stops.numbers("front_m"), run.stops.numbers("duration_s")];
      return [...front_m.keys()].map((row) => ({ x: frame.x(front_m[row]), top: frame.y(duration_s[row]), run, row, index }));
    });
  }

  drawStops() {
    const frame = this.places;
    const durations = shownRuns(this.result).flatMap(({ run }) => [...run.stops.numbers("duration_s")]);
    [frame.y0, frame.y1] = [0, Math.max(...durations, 10) * 1.1];
    frame.axisY(`${word("duration")} [s]`, (value) => number(value, 0));
    const { pen } = frame;
    const { top: ceiling, bottom } = frame.box;
    let last = -Infinity;
    for (const station of this.result.stations) {
      const x = frame.x(station.chainage_m);
      if (x < frame.box.left || x > frame.box.right || x - last < 13) continue;
      last = x;
      pen.strokeStyle = themed("grid");
      pen.lineWidth = 1;
      pen.beginPath();
      pen.moveTo(Math.round(x) + 0.5, ceiling);
      pen.lineTo(Math.round(x) + 0.5, bottom);
      pen.stroke();
      pen.save();
      pen.translate(x + 4, bottom + 8);
      pen.rotate(-Math.PI / 4);
      pen.textAlign = "right";
      pen.fillStyle = themed("ink");
      pen.fillText(stationName(station), 0, 4, 90);
      pen.restore();
    }
    frame.within(() => {
      for (const { x, top, index } of this.stems()) {
        const { colour } = penOf(index);
        pen.strokeStyle = colour;
        pen.fillStyle = colour;
        pen.lineWidth = 1.6;
        pen.beginPath();
        pen.moveTo(x, bottom);
        pen.lineTo(x, top);
        pen.stroke();
        pen.beginPath();
        pen.arc(x, top, 3.4, 0, 2 * Math.PI);
        pen.fill();
      }
    });
  }

  /** @param {number} x @param {number} y */
  nearStem(x, y) {
    const near = this.stems().filter((stem) => Math.hypot(stem.x - x, Math.min(Math.abs(stem.top - y), y > stem.top ? 0 : Infinity)) < 8);
    near.sort((a, b) => Math.hypot(a.x - x, a.top - y) - Math.hypot(b.x - x, b.top - y));
    return near[0];
  }

  /** @param {number} x @param {number} y */
  hoverStop(x, y) {
    const stem = this.nearStem(x, y);
    if (!stem) return null;
    const { run, row } = stem;
    const cause = run.remaining.rows === run.stops.rows ? run.remaining.text("cause", row) : "";
    const next = this.result.stationOf.get(run.stops.text("next_station", row));
    return [
      `${run.stops.text("train", row)} · ${run.controller.replaceAll("_", " ")}`,
      `${clock(run.stops.numbers("start_s")[row])}, ${number(run.stops.numbers("duration_s")[row], 1)} s`,
      `${kilometres(run.stops.numbers("front_m")[row])}${next ? ` → ${stationName(next)}` : ""}`,
      cause ? `${word("cause")}: ${cause}` : "",
    ].filter(Boolean);
  }

  /** @param {number} x @param {number} y */
  pickStop(x, y) {
    const stem = this.nearStem(x, y);
    if (!stem) return;
    const { run, row } = stem;
    choose({ focus: run.controller, train: run.stops.text("train", row), time_s: run.stops.numbers("start_s")[row] });
  }
}
