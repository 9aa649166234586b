/**
 * The data of the page: one gzip of a JSON text and of columns of whole numbers.
 *
 * @typedef {{constant: number}} Constant
 * @typedef {{order: number, planes: number, at: number}} Planes
 * @typedef {(Constant | Planes) & {
 *   type: "number" | "text" | "bool", scale?: number, texts?: string[], raw?: number,
 *   missing?: Constant | Planes}} PackedColumn
 * @typedef {{rows: number, columns: Record<string, PackedColumn>}} PackedTable
 * @typedef {{codes: Int32Array, texts: string[]}} Texts
 */

/** A table whose columns are read when somebody asks for them. */
export class Table {
  /**
   * @param {PackedTable} told
   * @param {Uint8Array} content
   */
  constructor(told, content) {
    this.rows = told.rows;
    this.told = told.columns;
    this.content = content;
    /** @type {Map<string, Float64Array>} */
    this.numbersOf = new Map();
    /** @type {Map<string, Texts>} */
    this.textsOf = new Map();
  }

  /**
   * @param {string} name
   * @returns {boolean}
   */
  has(name) {
    return name in this.told;
  }

  /**
   * Numbers of a column; NaN where there is none, and everywhere in a column that is not there.
   * @param {string} name
   * @returns {Float64Array}
   */
  numbers(name) {
    let found = this.numbersOf.get(name);
    if (!found) {
      found = this.told[name] ? this.#read(this.told[name]) : new Float64Array(this.rows).fill(NaN);
      this.numbersOf.set(name, found);
    }
    return found;
  }

  /**
   * Texts of a column: which of its different texts each row has.
   * @param {string} name
   * @returns {Texts}
   */
  texts(name) {
    let found = this.textsOf.get(name);
    if (!found) {
      const told = this.told[name];
      found = told
        ? { codes: Int32Array.from(whole(told, this.rows, this.content)), texts: told.texts ?? [] }
        : { codes: new Int32Array(this.rows), texts: [""] };
      this.textsOf.set(name, found);
    }
    return found;
  }

  /**
   * @param {string} name
   * @param {number} row
   * @returns {string}
   */
  text(name, row) {
    const { codes, texts } = this.texts(name);
    return texts[codes[row]] ?? "";
  }

  /** @param {PackedColumn} told */
  #read(told) {
    let values;
    if (told.raw !== undefined) {
      const bytes = this.content.slice(told.raw, told.raw + 8 * this.rows);
      values = new Float64Array(bytes.buffer);
    } else {
      values = whole(told, this.rows, this.content);
      const scale = told.scale ?? 1;
      if (scale !== 1) for (let i = 0; i < values.length; i++) values[i] /= scale;
    }
    if (told.missing) {
      const missing = whole(told.missing, this.rows, this.content);
      for (let i = 0; i < values.length; i++) if (missing[i]) values[i] = NaN;
    }
    return values;
  }
}

/**
 * Read whole numbers: bytes of one significance together, signs folded in, differences.
 * @param {Constant | Planes} told
 * @param {number} rows
 * @param {Uint8Array} content
 * @returns {Float64Array}
 */
export function whole(told, rows, content) {
  const values = new Float64Array(rows);
  if ("constant" in told) return values.fill(told.constant);
  let weight = 1;
  for (let plane = 0; plane < told.planes; plane++) {
    const at = told.at + plane * rows;
    for (let i = 0; i < rows; i++) values[i] += weight * content[at + i];
    weight *= 256;
  }
  for (let i = 0; i < rows; i++) {
    const folded = values[i];
    values[i] = folded % 2 === 0 ? folded / 2 : -(folded + 1) / 2;
  }
  for (let again = 0; again < told.order; again++) {
    let sum = 0;
    for (let i = 0; i < rows; i++) values[i] = sum += values[i];
  }
  return values;
}

/**
 * Take a page's data apart.
 * @param {string} text base64
 * @returns {Promise<{told: any, content: Uint8Array}>}
 */
export async function unpack(text) {
  const letters = atob(text.trim());
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const plain = new Uint8Array(await new Response(stream).arrayBuffer());
  const length = new DataView(plain.buffer).getUint32(0, true);
  const told = JSON.parse(new TextDecoder().decode(plain.subarray(4, 4 + length)));
  return { told, content: plain.subarray(4 + length) };
}
