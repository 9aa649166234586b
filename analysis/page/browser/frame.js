/** A drawing on canvas with two axes that can be moved, zoomed and asked. */

import { el, fill } from "./elements.js";
import { clock, clockStep, number, roundStep, spread } from "./telling.js";
import { themed } from "./colours.js";
import { word } from "./words.js";

/**
 * @typedef {{left: number, right: number, top: number, bottom: number}} Margins
 * @typedef {{label: string, height: number, margins: Margins, whole: () => [number, number, number, number],
 *   draw: (frame: Frame) => void, hover?: (x: number, y: number) => string[] | null,
 *   pick?: (x: number, y: number) => void, key?: (key: string) => boolean,
 *   zoomY?: boolean, moved?: () => void, axes?: (frame: Frame) => void,
 *   heavy?: () => boolean}} Wanted what is heavy is drawn on its axes once it is at rest
 */

const MOST_ZOOM = 4000;
const REST_MS = 120;

export class Frame {
  /** @param {Wanted} wanted */
  constructor(wanted) {
    this.wanted = wanted;
    this.margins = { ...wanted.margins };
    this.canvas = /** @type {HTMLCanvasElement} */ (
      el("canvas", { tabindex: "0", role: "application", "aria-label": `${wanted.label}. ${word("keys")}` })
    );
    this.pen = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext("2d"));
    this.told = el("div", { class: "hover", hidden: true });
    this.element = el(
      "div",
      { class: "frame" },
      el(
        "div",
        { class: "tools" },
        this.#button("+", "zoom_in", () => this.zoom(0.6)),
        this.#button("−", "zoom_out", () => this.zoom(1 / 0.6)),
        this.#button("⟲", "whole", () => this.reset()),
      ),
      el("div", { class: "stage" }, this.canvas, this.told),
    );
    const whole = wanted.whole();
    /** @type {number} */
    this.x0 = whole[0];
    /** @type {number} */
    this.x1 = whole[1];
    /** @type {number} */
    this.y0 = whole[2];
    /** @type {number} */
    this.y1 = whole[3];
    this.width = 600;
    this.height = wanted.height;
    this.asked = false;
    this.quick = false;
    this.layer = document.createElement("canvas");
    /** What the layer shows. @type {[number, number, number, number] | null} */
    this.layered = null;
    this.rest = 0;
    /** @type {Map<number, {x: number, y: number}>} */
    this.pointers = new Map();
    this.travelled = 0;
    this.cursor = { x: NaN, y: NaN };
    this.#listen();
    new ResizeObserver(() => this.#fit()).observe(this.element);
  }

  /** @param {string} sign @param {string} name @param {() => void} onclick */
  #button(sign, name, onclick) {
    return el("button", { type: "button", onclick, title: word(name), "aria-label": word(name) }, sign);
  }

  #fit() {
    const width = Math.max(this.element.clientWidth, 200);
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    this.width = width;
    this.height = this.wanted.height;
    this.canvas.width = Math.round(width * scale);
    this.canvas.height = Math.round(this.height * scale);
    this.canvas.style.setProperty("height", `${this.height}px`);
    this.scale = scale;
    this.ask();
  }

  /** Draw soon. @param {boolean} [quick] what is heavy may come later */
  ask(quick = false) {
    this.quick = quick && (this.quick || !this.asked);
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => this.paint(this.quick));
  }

  /** Draw now. @param {boolean} [quick] */
  paint(quick = false) {
    this.asked = this.quick = false;
    const { axes, draw } = this.wanted;
    ready(this.pen, this);
    if (!axes) {
      draw(this);
      return;
    }
    axes(this);
    if (quick && this.layered && this.wanted.heavy?.()) {
      this.#shift(this.layered);
      clearTimeout(this.rest);
      this.rest = setTimeout(() => this.ask(), REST_MS);
      return;
    }
    const { canvas, layer, pen } = this;
    [layer.width, layer.height] = [canvas.width, canvas.height];
    this.pen = /** @type {CanvasRenderingContext2D} */ (layer.getContext("2d"));
    ready(this.pen, this);
    draw(this);
    this.pen = pen;
    this.layered = [this.x0, this.x1, this.y0, this.y1];
    pen.drawImage(layer, 0, 0, this.width, this.height);
  }

  /** Show what was drawn last where it belongs now. @param {[number, number, number, number]} shown */
  #shift([x0, x1, y0, y1]) {
    const { left, right, top, bottom } = this.box;
    const scale = this.scale ?? 1;
    const [x, y] = [this.x(x0), this.y(y1)];
    this.within(() =>
      this.pen.drawImage(
        this.layer,
        left * scale,
        top * scale,
        (right - left) * scale,
        (bottom - top) * scale,
        x,
        y,
        this.x(x1) - x,
        this.y(y0) - y,
      ),
    );
  }

  /** Where the drawing lies. @returns {{left: number, right: number, top: number, bottom: number}} */
  get box() {
    const { left, right, top, bottom } = this.margins;
    return { left, right: this.width - right, top, bottom: this.height - bottom };
  }

  /** @param {number} value @returns {number} */
  x(value) {
    const { left, right } = this.box;
    return left + ((value - this.x0) / (this.x1 - this.x0)) * (right - left);
  }

  /** @param {number} value @returns {number} */
  y(value) {
    const { top, bottom } = this.box;
    return bottom - ((value - this.y0) / (this.y1 - this.y0)) * (bottom - top);
  }

  /** @param {number} place @returns {number} */
  fromX(place) {
    const { left, right } = this.box;
    return this.x0 + ((place - left) / (right - left)) * (this.x1 - this.x0);
  }

  /** @param {number} place @returns {number} */
  fromY(place) {
    const { top, bottom } = this.box;
    return this.y0 + ((bottom - place) / (bottom - top)) * (this.y1 - this.y0);
  }

  /** Show everything. */
  reset() {
    [this.x0, this.x1, this.y0, this.y1] = this.wanted.whole();
    this.#moved();
  }

  /** @param {number} x0 @param {number} x1 @param {number} [y0] @param {number} [y1] */
  show(x0, x1, y0 = this.y0, y1 = this.y1) {
    [this.x0, this.x1, this.y0, this.y1] = [x0, x1, y0, y1];
    this.#moved();
  }

  /**
   * @param {number} factor below 1 shows less, larger
   * @param {number} [x] around which place of the canvas
   * @param {number} [y]
   */
  zoom(factor, x = (this.box.left + this.box.right) / 2, y = (this.box.top + this.box.bottom) / 2) {
    const [left, right, low, high] = this.wanted.whole();
    const span = right - left;
    const now = this.x1 - this.x0;
    const by = Math.min(Math.max(now * factor, span / MOST_ZOOM), span * 1.5) / now;
    const about = this.fromX(x);
    this.x0 = about - (about - this.x0) * by;
    this.x1 = about + (this.x1 - about) * by;
    if (this.wanted.zoomY) {
      const tall = Math.min(((this.y1 - this.y0) * by), (high - low) * 1.5);
      const centre = this.fromY(y);
      /** @type {number} */
      const part = (centre - this.y0) / (this.y1 - this.y0);
      this.y0 = centre - tall * part;
      this.y1 = this.y0 + tall;
    }
    this.#moved();
  }

  /** @param {number} dx @param {number} dy pixels */
  move(dx, dy) {
    const { left, right, top, bottom } = this.box;
    const x = (dx / (right - left)) * (this.x1 - this.x0);
    this.x0 -= x;
    this.x1 -= x;
    if (this.wanted.zoomY) {
      const y = (dy / (bottom - top)) * (this.y1 - this.y0);
      this.y0 += y;
      this.y1 += y;
    }
    this.#moved();
  }

  #moved() {
    const [left, right, low, high] = this.wanted.whole();
    const shift = Math.max(left - this.x1 + 0.1 * (this.x1 - this.x0), 0) - Math.max(this.x0 + 0.1 * (this.x1 - this.x0) - right, 0);
    this.x0 += shift;
    this.x1 += shift;
    const tall = this.y1 - this.y0;
    const up = Math.max(low - this.y1 + 0.1 * tall, 0) - Math.max(this.y0 + 0.1 * tall - high, 0);
    this.y0 += up;
    this.y1 += up;
    this.wanted.moved?.();
    this.ask(true);
  }

  #listen() {
    const { canvas } = this;
    canvas.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
      this.travelled = 0;
    });
    canvas.addEventListener("pointermove", (event) => this.#pointer(event));
    canvas.addEventListener("pointerup", (event) => {
      this.pointers.delete(event.pointerId);
      if (this.travelled < 5) this.wanted.pick?.(event.offsetX, event.offsetY);
    });
    canvas.addEventListener("pointercancel", (event) => this.pointers.delete(event.pointerId));
    canvas.addEventListener("pointerleave", () => this.tell(NaN, NaN));
    canvas.addEventListener("keydown", (event) => this.#key(event));
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    if (!event.ctrlKey && !event.metaKey && document.activeElement !== this.canvas) return;
    event.preventDefault();
    this.zoom(Math.exp(Math.max(Math.min(event.deltaY, 100), -100) / 400), event.offsetX, event.offsetY);
  }

  /** @param {PointerEvent} event */
  #pointer(event) {
    const held = this.pointers.get(event.pointerId);
    const here = { x: event.offsetX, y: event.offsetY };
    if (!held) {
      this.tell(here.x, here.y);
      return;
    }
    const others = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
    if (others.length) {
      const before = Math.hypot(held.x - others[0].x, held.y - others[0].y);
      const after = Math.hypot(here.x - others[0].x, here.y - others[0].y);
      if (after > 1) this.zoom(before / after, (here.x + others[0].x) / 2, (here.y + others[0].y) / 2);
    } else this.move(here.x - held.x, here.y - held.y);
    this.travelled += Math.abs(here.x - held.x) + Math.abs(here.y - held.y);
    this.pointers.set(event.pointerId, here);
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const steps = /** @type {Record<string, () => void>} */ ({
      ArrowLeft: () => this.move(60, 0),
      ArrowRight: () => this.move(-60, 0),
      ArrowUp: () => this.move(0, 40),
      ArrowDown: () => this.move(0, -40),
      "+": () => this.zoom(0.7),
      "=": () => this.zoom(0.7),
      "-": () => this.zoom(1 / 0.7),
      0: () => this.reset(),
    });
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (this.wanted.key?.(event.key)) event.preventDefault();
    else if (steps[event.key]) {
      event.preventDefault();
      steps[event.key]();
    }
  }

  /**
   * Tell what lies at a place of the canvas.
   * @param {number} x
   * @param {number} y
   */
  tell(x, y) {
    this.cursor = { x, y };
    const lines = Number.isFinite(x) ? this.wanted.hover?.(x, y) : null;
    this.told.hidden = !lines;
    if (lines) {
      fill(this.told, lines.map((line, index) => el(index ? "div" : "strong", {}, line)));
      const right = x > this.width / 2;
      this.told.style.setProperty("left", right ? "auto" : `${x + 14}px`);
      this.told.style.setProperty("right", right ? `${this.width - x + 14}px` : "auto");
      this.told.style.setProperty("top", `${Math.min(y + 10, this.height - 90)}px`);
    }
  }

  /** Draw only within the box. @param {() => void} draw */
  within(draw) {
    const { left, right, top, bottom } = this.box;
    this.pen.save();
    this.pen.beginPath();
    this.pen.rect(left, top, right - left, bottom - top);
    this.pen.clip();
    draw();
    this.pen.restore();
  }

  /** A clock or a distance below. @param {boolean} isClock */
  axisX(isClock) {
    const { left, right, top, bottom } = this.box;
    const most = Math.max((right - left) / 74, 2);
    const span = this.x1 - this.x0;
    const step = isClock ? clockStep(span, most) : roundStep(span, most);
    const { pen } = this;
    pen.textAlign = "center";
    pen.textBaseline = "top";
    pen.lineWidth = 1;
    for (let value = Math.ceil(this.x0 / step) * step; value <= this.x1; value += step) {
      const x = Math.round(this.x(value)) + 0.5;
      pen.strokeStyle = themed("grid");
      pen.beginPath();
      pen.moveTo(x, top);
      pen.lineTo(x, bottom);
      pen.stroke();
      pen.fillStyle = themed("quiet");
      const told = isClock ? clock(value, step < 60) : number(value / 1000, step < 100 ? 2 : step < 1000 ? 1 : 0);
      pen.fillText(isClock ? told : `${told} km`, x, bottom + 5);
    }
  }

  /** Numbers on the left. @param {string} title @param {(value: number) => string} tell */
  axisY(title, tell) {
    const { left, right, top, bottom } = this.box;
    const step = roundStep(this.y1 - this.y0, (bottom - top) / 26);
    const { pen } = this;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (let value = Math.ceil(this.y0 / step) * step; value <= this.y1 + 1e-9; value += step) {
      const y = Math.round(this.y(value)) + 0.5;
      pen.strokeStyle = themed("grid");
      pen.beginPath();
      pen.moveTo(left, y);
      pen.lineTo(right, y);
      pen.stroke();
      pen.fillStyle = themed("quiet");
      pen.fillText(tell(value), left - 6, y);
    }
    pen.textAlign = "left";
    pen.textBaseline = "bottom";
    pen.fillStyle = themed("ink");
    pen.fillText(title, left, top - 3);
  }

  /**
   * Names of places on the left, moved apart, with a line across each.
   * @param {{name: string, place: number}[]} places
   */
  placesY(places) {
    const { left, right, top, bottom } = this.box;
    const seen = places
      .map(({ name, place }) => ({ name, y: this.y(place) }))
      .filter(({ y }) => y >= top - 1 && y <= bottom + 1)
      .sort((a, b) => a.y - b.y);
    const moved = spread(seen.map(({ y }) => y), 13);
    const { pen } = this;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    seen.forEach(({ name, y }, index) => {
      pen.strokeStyle = themed("grid");
      pen.beginPath();
      pen.moveTo(left - 10, moved[index]);
      pen.lineTo(left - 3, y);
      pen.lineTo(right, y);
      pen.stroke();
      pen.fillStyle = themed("ink");
      pen.fillText(name, left - 13, moved[index], left - 15);
    });
  }
}

/** @param {CanvasRenderingContext2D} pen @param {Frame} frame */
function ready(pen, { scale = 1, width, height }) {
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "12px system-ui, sans-serif";
}
