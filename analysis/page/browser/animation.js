/** The line in motion: two controllers in step, on the schematic line and on the map. */

import { choice, el, fill, tick } from "./elements.js";
import { spanOf } from "./runs.js";
import { choose, state } from "./state.js";
import { pen as penOf, reasonColour, themed } from "./colours.js";
import { clock } from "./telling.js";
import { onMap } from "./physics.js";
import { Schematic, trainsAt } from "./schematic.js";
import { REASONS, reasonWord, stationName, word } from "./words.js";

/**
 * @typedef {import("./model.js").Result} Result
 * @typedef {import("./model.js").Run} Run
 */

const SPEEDS = [1, 10, 30, 60, 120, 300];
const TITLE = 24;

export class Animation {
  /** @param {Result} result */
  constructor(result) {
    this.result = result;
    this.schematic = new Schematic(result);
    this.span = spanOf(result);
    this.time_s = Number.isFinite(state.time_s) ? state.time_s : (this.span[0] + this.span[1]) / 2;
    this.times = 60;
    this.playing = false;
    this.last = NaN;
    /** @type {number[]} milliseconds of script of the last frames */
    this.spent = [];
    this.canvas = /** @type {HTMLCanvasElement} */ (el("canvas", { role: "img", id: "line-canvas" }));
    this.map = /** @type {HTMLCanvasElement} */ (el("canvas", { role: "img", id: "map-canvas" }));
    this.button = el("button", { type: "button", id: "play", class: "strong", onclick: () => this.toggle() });
    this.slider = /** @type {HTMLInputElement} */ (
      el("input", {
        type: "range",
        id: "moment",
        min: Math.floor(this.span[0]),
        max: Math.ceil(this.span[1]),
        step: 1,
        "aria-label": word("time"),
        oninput: () => this.seek(Number(this.slider.value)),
        onchange: () => choose({ time_s: this.time_s }),
      })
    );
    this.clock = el("output", { class: "clock", for: "moment", id: "clock" });
    this.head = el("div", { class: "row" });
    this.legend = el("ul", { class: "legend" });
    this.mapped = this.points();
    this.element = el(
      "div",
      {},
      this.head,
      el("div", { class: "row player" }, this.button, this.clock, this.slider),
      el("div", { class: "stage" }, this.canvas),
      this.legend,
      el("h3", {}, word("map")),
      this.mapped.length > 1 ? this.map : el("p", { class: "quiet" }, word("no_map")),
    );
    new ResizeObserver(() => this.fit()).observe(this.element);
    this.update();
  }

  /** The centre line, or the stations, by chainage. @returns {number[][]} */
  points() {
    const drawn = this.result.line.geometry_m_lon_lat_deg ?? [];
    if (drawn.length > 1) return drawn;
    return this.result.stations
      .filter((one) => one.longitude_deg !== null && one.latitude_deg !== null)
      .map((one) => [one.chainage_m, /** @type {number} */ (one.longitude_deg), /** @type {number} */ (one.latitude_deg)]);
  }

  /** The two runs that are shown in step. @returns {{run: Run, index: number}[]} */
  pair() {
    const runs = this.result.controllers
      .map(({ name }, index) => ({ run: this.result.run(name, state.key), index }))
      .filter(({ run }) => run);
    const found = [state.focus, state.second].map((name) => runs.find(({ run }) => run?.controller === name));
    const known = [...new Set(found)].filter(Boolean);
    return /** @type {{run: Run, index: number}[]} */ (known.length ? known : runs.slice(0, 1));
  }

  update() {
    const options = /** @type {[string, string][]} */ (
      this.result.controllers.map(({ name }) => [name, name.replaceAll("_", " ")])
    );
    fill(
      this.head,
      choice({ id: "first-run", label: word("controller"), options, value: state.focus, onchange: (focus) => this.chooseRun({ focus }) }),
      choice({ id: "second-run", label: word("second"), options: [["", "–"], ...options], value: state.second, onchange: (second) => choose({ second }) }),
      choice({
        id: "times",
        label: word("speed_of_play"),
        options: SPEEDS.map((times) => [String(times), `${times} ×`]),
        value: String(this.times),
        onchange: (times) => {
          this.times = Number(times);
        },
      }),
      tick(word("blocks"), state.blocks, (blocks) => choose({ blocks })),
    );
    fill(
      this.legend,
      Object.keys(REASONS).map((reason) =>
        el("li", {}, el("span", { class: "swatch box", style: { background: reasonColour(reason) } }), reasonWord(reason, "")),
      ),
    );
    this.told();
    if (Number.isFinite(state.time_s) && !this.playing) this.time_s = state.time_s;
    this.fit();
  }

  /** @param {{focus: string}} wanted */
  chooseRun({ focus }) {
    const shown = state.shown.includes(focus) ? state.shown : [...state.shown, focus];
    choose({ focus, shown });
  }

  told() {
    fill(this.button, this.playing ? `❚❚ ${word("pause")}` : `▶ ${word("play")}`);
    this.button.setAttribute("aria-pressed", String(this.playing));
  }

  toggle() {
    this.playing = !this.playing;
    this.last = NaN;
    if (this.playing && this.time_s >= this.span[1] - 1) this.time_s = this.span[0];
    this.told();
    if (this.playing) requestAnimationFrame((now) => this.step(now));
    else choose({ time_s: this.time_s });
  }

  /** @param {number} now milliseconds */
  step(now) {
    if (!this.playing || !this.element.isConnected) return;
    const passed_s = Number.isNaN(this.last) ? 0 : Math.min((now - this.last) / 1000, 0.25);
    this.last = now;
    this.time_s = Math.min(this.time_s + passed_s * this.times, this.span[1]);
    const before = performance.now();
    this.paint();
    this.spent.push(performance.now() - before);
    if (this.spent.length > 600) this.spent.shift();
    if (this.time_s >= this.span[1]) this.toggle();
    else requestAnimationFrame((next) => this.step(next));
  }

  /** @param {number} time_s */
  seek(time_s) {
    this.time_s = time_s;
    this.paint();
  }

  fit() {
    const width = this.element.clientWidth;
    if (!width) return;
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    this.width = width;
    this.tall = this.schematic.height(width) + TITLE;
    const height = this.tall * Math.max(this.pair().length, 1);
    for (const [canvas, high] of /** @type {[HTMLCanvasElement, number][]} */ ([[this.canvas, height], [this.map, this.mapped.length > 1 ? this.mapHeight(width) : 1]])) {
      canvas.width = Math.round(width * scale);
      canvas.height = Math.round(high * scale);
      canvas.style.setProperty("width", `${width}px`);
      canvas.style.setProperty("height", `${high}px`);
    }
    this.scale = scale;
    this.paint();
  }

  paint() {
    if (!this.width) return;
    this.clock.textContent = clock(this.time_s);
    this.slider.value = String(Math.round(this.time_s));
    this.slider.setAttribute("aria-valuetext", clock(this.time_s));
    const pen = this.ready(this.canvas);
    const pair = this.pair();
    let told = "";
    pair.forEach(({ run, index }, at) => {
      const top = at * /** @type {number} */ (this.tall);
      pen.fillStyle = penOf(index).colour;
      pen.fillRect(0, top + 4, 10, 14);
      pen.fillStyle = themed("ink");
      pen.textAlign = "left";
      pen.textBaseline = "middle";
      pen.font = "bold 13px system-ui, sans-serif";
      const here = trainsAt(this.result, run, this.time_s);
      const count = word("trains_on_line", { count: here.length });
      pen.fillText(`${run.controller.replaceAll("_", " ")} – ${count}`, 16, top + 12);
      pen.font = "11px system-ui, sans-serif";
      this.schematic.draw(pen, /** @type {number} */ (this.width), top + TITLE, run, this.time_s);
      told += `${run.controller}: ${count}. `;
    });
    if (!this.playing) this.canvas.setAttribute("aria-label", `${word("schematic")}, ${clock(this.time_s)}. ${told}`);
    if (this.mapped.length > 1) this.paintMap(pair);
  }

  /** @param {HTMLCanvasElement} canvas */
  ready(canvas) {
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    const scale = this.scale ?? 1;
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, canvas.width, canvas.height);
    return pen;
  }

  /** As high as the line needs. @param {number} width @returns {number} */
  mapHeight(width) {
    const [longitudes, latitudes] = [1, 2].map((part) => this.mapped.map((point) => point[part]));
    const up = Math.max(...latitudes) - Math.min(...latitudes);
    const across = (Math.max(...longitudes) - Math.min(...longitudes)) * Math.cos((latitudes[0] * Math.PI) / 180);
    const needed = (width * up) / Math.max(across, 1e-6) + 110;
    return Math.round(Math.min(Math.max(needed, 200), 560));
  }

  /** From degrees to the canvas of the map. @returns {(at: [number, number]) => [number, number]} */
  projection() {
    const width = /** @type {number} */ (this.width);
    const height = this.mapHeight(width);
    const [longitudes, latitudes] = [1, 2].map((part) => this.mapped.map((point) => point[part]));
    const [west, east] = [Math.min(...longitudes), Math.max(...longitudes)];
    const [south, north] = [Math.min(...latitudes), Math.max(...latitudes)];
    const shrink = Math.cos((((south + north) / 2) * Math.PI) / 180);
    const across = Math.max((east - west) * shrink, 1e-6);
    const up = Math.max(north - south, 1e-6);
    // The longer side of the line lies along the longer side of the canvas.
    const turned = up > 2 * across && width > height;
    const [long, short] = turned ? [up, across] : [across, up];
    const factor = Math.min((width - 120) / long, (height - 90) / short);
    return ([longitude, latitude]) => {
      const [x, y] = [(longitude - west) * shrink, north - latitude];
      const [u, v] = turned ? [y, across - x] : [x, y];
      return [60 + u * factor + (width - 120 - long * factor) / 2, 45 + v * factor + (height - 90 - short * factor) / 2];
    };
  }

  /** @param {{run: Run, index: number}[]} pair */
  paintMap(pair) {
    const pen = this.ready(this.map);
    const place = this.projection();
    pen.strokeStyle = themed("track");
    pen.lineWidth = 3;
    pen.lineJoin = "round";
    pen.beginPath();
    for (const [, longitude, latitude] of this.mapped) pen.lineTo(...place([longitude, latitude]));
    pen.stroke();
    this.mapStations(pen, place);
    this.north(pen, place);
    pair.forEach(({ run, index }, at) => {
      const side = pair.length > 1 ? (at ? 7 : -7) : 0;
      for (const train of trainsAt(this.result, run, this.time_s)) {
        const [x, y] = place(onMap(this.mapped, train.front_m));
        const [x0, y0] = place(onMap(this.mapped, train.front_m - 150));
        const length = Math.hypot(x - x0, y - y0) || 1;
        pen.fillStyle = penOf(index).colour;
        pen.strokeStyle = themed(train.train === state.train ? "accent" : "paper");
        pen.lineWidth = train.train === state.train ? 3 : 1;
        pen.beginPath();
        pen.arc(x + (side * (y0 - y)) / length, y + (side * (x - x0)) / length, train.train === state.train ? 7 : 5, 0, 2 * Math.PI);
        pen.fill();
        pen.stroke();
      }
    });
    this.map.setAttribute("aria-label", `${word("map")}, ${clock(this.time_s)}`);
  }

  /** Which way is north. @param {CanvasRenderingContext2D} pen @param {(at: [number, number]) => [number, number]} place */
  north(pen, place) {
    const [, longitude, latitude] = this.mapped[0];
    const [x0, y0] = place([longitude, latitude]);
    const [x1, y1] = place([longitude, latitude + 0.01]);
    const length = Math.hypot(x1 - x0, y1 - y0) || 1;
    const [u, v] = [(x1 - x0) / length, (y1 - y0) / length];
    pen.strokeStyle = pen.fillStyle = themed("quiet");
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(28 - 12 * u, 40 - 12 * v);
    pen.lineTo(28 + 12 * u, 40 + 12 * v);
    pen.lineTo(28 + 6 * u + 4 * v, 40 + 6 * v - 4 * u);
    pen.stroke();
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.font = "11px system-ui, sans-serif";
    pen.fillText(word("north"), 28 + 20 * u, 40 + 20 * v);
  }

  /** @param {CanvasRenderingContext2D} pen @param {(at: [number, number]) => [number, number]} place */
  mapStations(pen, place) {
    pen.font = "11px system-ui, sans-serif";
    pen.textBaseline = "middle";
    /** @type {{x: number, y: number, wide: number}[]} */
    const taken = [];
    for (const station of this.result.stations) {
      const [x, y] = place(onMap(this.mapped, station.chainage_m));
      pen.fillStyle = themed("paper");
      pen.strokeStyle = themed("track");
      pen.lineWidth = 1.5;
      pen.beginPath();
      pen.arc(x, y, 3.5, 0, 2 * Math.PI);
      pen.fill();
      pen.stroke();
      const name = stationName(station);
      const wide = pen.measureText(name).width;
      const [x1, y1] = place(onMap(this.mapped, station.chainage_m + 200));
      const [x0, y0] = place(onMap(this.mapped, station.chainage_m - 200));
      const beside = [[x + 16 + wide / 2, y], [x - 16 - wide / 2, y]];
      const above = [[x, y - 22], [x, y + 22]];
      const level = Math.abs(x1 - x0) > 2 * Math.abs(y1 - y0);
      const free = (level ? [...above, ...beside] : [...beside, ...above]).find(
        ([u, v]) =>
          u - wide / 2 > 0 &&
          u + wide / 2 < /** @type {number} */ (this.width) &&
          !taken.some((other) => Math.abs(other.y - v) < 13 && Math.abs(other.x - u) < (other.wide + wide) / 2 + 4),
      );
      if (!free) continue;
      taken.push({ x: free[0], y: free[1], wide });
      pen.textAlign = "center";
      pen.fillStyle = themed("ink");
      pen.fillText(name, free[0], free[1]);
    }
  }
}
