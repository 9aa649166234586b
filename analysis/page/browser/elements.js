/** Elements of the page. Whatever comes from the data becomes text, never markup. */

const SVG = "http://www.w3.org/2000/svg";

/** @typedef {Node | string | number | null | undefined | false} Child */

/**
 * Make an element.
 * @param {string} tag
 * @param {Record<string, any>} [attributes] listeners begin with "on"; "style" is an object
 * @param {...(Child | Child[])} children
 * @returns {HTMLElement}
 */
export function el(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  dress(made, attributes);
  fill(made, ...children);
  return made;
}

/**
 * Make an element of a drawing.
 * @param {string} tag
 * @param {Record<string, any>} [attributes]
 * @param {...(Child | Child[])} children
 * @returns {SVGElement}
 */
export function svg(tag, attributes = {}, ...children) {
  const made = document.createElementNS(SVG, tag);
  dress(made, attributes);
  fill(made, ...children);
  return made;
}

/**
 * @param {HTMLElement | SVGElement} made
 * @param {Record<string, any>} attributes
 */
function dress(made, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name === "style") for (const key in value) made.style.setProperty(key, value[key]);
    else if (name === "value" || name === "checked" || name === "selected") {
      Object.assign(made, { [name]: value });
    } else made.setAttribute(name, value === true ? "" : String(value));
  }
}

/**
 * Put children into an element, in place of what it holds.
 * @param {Element} parent
 * @param {...(Child | Child[])} children
 */
export function fill(parent, ...children) {
  const kept = children.flat().filter((child) => child !== null && child !== undefined && child !== false);
  parent.replaceChildren(.../** @type {(Node | string)[]} */ (kept.map((child) => (child instanceof Node ? child : String(child)))));
}

/**
 * A list to choose from.
 * @param {{label: string, options: [string, string][], value: string, id: string,
 *   onchange: (value: string) => void}} wanted
 * @returns {HTMLElement}
 */
export function choice({ label, options, value, id, onchange }) {
  const list = el(
    "select",
    {
      id,
      onchange: (/** @type {Event} */ event) =>
        onchange(/** @type {HTMLSelectElement} */ (event.target).value),
    },
    options.map(([key, told]) => el("option", { value: key, selected: key === value }, told)),
  );
  /** @type {HTMLSelectElement} */ (list).value = value;
  return el("label", { class: "choice" }, el("span", {}, label), list);
}

/**
 * A box to tick.
 * @param {string} label
 * @param {boolean} checked
 * @param {(checked: boolean) => void} onchange
 * @returns {HTMLElement}
 */
export function tick(label, checked, onchange) {
  const box = el("input", {
    type: "checkbox",
    checked,
    onchange: (/** @type {Event} */ event) =>
      onchange(/** @type {HTMLInputElement} */ (event.target).checked),
  });
  return el("label", { class: "tick" }, box, el("span", {}, label));
}

/**
 * A table of texts.
 * @param {{caption: string, head: string[], rows: Child[][], numbers?: boolean}} wanted
 * @returns {HTMLElement}
 */
export function table({ caption, head, rows, numbers = true }) {
  return el(
    "div",
    { class: "scroll", tabindex: "0", role: "region", "aria-label": caption },
    el(
      "table",
      { class: numbers ? "numbers" : "" },
      el("caption", { class: "quiet" }, caption),
      el("thead", {}, el("tr", {}, head.map((text) => el("th", { scope: "col" }, text)))),
      el(
        "tbody",
        {},
        rows.map((row) =>
          el(
            "tr",
            {},
            row.map((cell, index) => (index ? el("td", {}, cell) : el("th", { scope: "row" }, cell))),
          ),
        ),
      ),
    ),
  );
}

/**
 * Something that opens when asked to.
 * @param {string} label
 * @param {() => Child | Child[]} content made when it is opened first
 * @returns {HTMLElement}
 */
export function opening(label, content) {
  const body = el("div", { class: "opened" });
  const made = el("details", {}, el("summary", {}, label), body);
  made.addEventListener("toggle", () => {
    const { open } = /** @type {HTMLDetailsElement} */ (made);
    if (open && !body.firstChild) fill(body, content());
  });
  return made;
}
