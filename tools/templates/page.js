"use strict";
// Draws the figures of a page anew, so that they can be zoomed, moved and read. Without this script the page shows them as they are.
(() => {
const WIDTH = 680, HEIGHT = 440, RIGHT = 20, TOP = 40, BOTTOM = 62;
const MOST_NAMES = 12;
const linked = new Map();
const phased = [];

const decode = (text, Numbers) => new Numbers(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);

function element(parent, name, attributes, text) {
  const made = parent.namespaceURI.endsWith("svg")
    ? document.createElementNS(parent.namespaceURI, name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {})) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  parent.append(made);
  return made;
}

// A number whose neighbours are a step apart.
function written(value, step) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.max(Math.abs(value), step);
  if (size !== 0 && (size < 1e-4 || size >= 1e7)) {
    if (Math.abs(value) < 1e-6 * step) return "0";
    const place = x => Math.floor(Math.log10(x) + 1e-9);
    const digits = Math.min(Math.max(place(Math.abs(value)) - place(step), 0) + 1, 8);
    const [mantissa, power] = value.toExponential(digits - 1).split("e");
    const raised = String(Number(power)).replace("-", "⁻").replace(/\d/g, d => "⁰¹²³⁴⁵⁶⁷⁸⁹"[d]);
    return `${mantissa}·10${raised}`.replace("-", "−");
  }
  const text = value.toFixed(Math.min(Math.max(Math.ceil(-Math.log10(step) - 1e-9), 0), 9));
  const [whole, part] = (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "−").split(".");
  const grouped = whole.replace("−", "").length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, "\u202f") : whole;
  return part ? `${grouped}.${part}` : grouped;
}

function ticks([low, high], most) {
  const raw = (high - low) / most, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map(k => k * power).find(s => s >= raw * 0.999);
  const places = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step && places.length < 50; k++) places.push(k * step);
  return { step, places };
}

class Plot {
  constructor(figure, svg, data) {
    Object.assign(this, { figure, data });
    this.curves = data.curves.map(curve => ({ ...curve, y: decode(curve.y, Float32Array), hidden: false }));
    this.curves.forEach((curve, k) => {
      curve.x = data.curves[k].x === undefined ? this.curves[0].x : decode(data.curves[k].x, Float32Array);
      if (curve.error !== undefined) curve.error = decode(curve.error, Float32Array);
    });
    this.rows = data.rows === undefined ? null : decode(data.rows, Uint32Array);
    const x = this.curves.length ? this.curves[0].x : [];
    this.ordered = x.length > 1 && x.every((v, k) => k === 0 || !(v < x[k - 1]));
    this.view = this.whole();
    this.at = null;
    this.svg = document.createElementNS(svg.namespaceURI, "svg");
    for (const [key, value] of Object.entries({
      viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "live", tabindex: 0, role: "img",
      "aria-label": `${data.title}. Arrow keys read values, plus and minus zoom, Shift and arrows move, 0 shows all.`,
    })) this.svg.setAttribute(key, value);
    svg.replaceWith(this.svg);
    this.bar();
    this.listen();
    if (this.rows) {
      if (!linked.has(data.count)) linked.set(data.count, []);
      linked.get(data.count).push(this);
    }
    if (this.curves.some(curve => curve.phase)) phased.push(this);
    this.draw();
  }

  whole() { return { x: [...this.data.x.range], y: [...this.data.y.range] }; }

  bar() {
    const scroll = this.svg.parentNode;
    const bar = document.createElement("div");
    bar.className = "legend";
    scroll.before(bar);
    this.buttons = this.curves.map((curve, k) => {
      if (!curve.label) return null;
      const button = element(bar, "button", { type: "button", class: `${curve.role} ${curve.style}`, "aria-pressed": "true" }, curve.label);
      button.addEventListener("click", () => { curve.hidden = !curve.hidden; this.draw(); });
      return button;
    });
    const tools = element(bar, "span", { class: "tools" });
    for (const [sign, name, act] of [["+", "Zoom in", () => this.zoom(0.6)], ["−", "Zoom out", () => this.zoom(1 / 0.6)], ["⤢", "Show all", () => this.reset()]]) {
      element(tools, "button", { type: "button", title: name, "aria-label": name }, sign).addEventListener("click", act);
    }
    this.values = document.createElement("p");
    this.values.className = "values";
    this.values.setAttribute("aria-live", "polite");
    scroll.after(this.values);
  }

  isShown(curve) { return !curve.hidden && (!curve.phase || Plot.phase === "both" || curve.phase === Plot.phase); }

  px(x) { const [a, b] = this.view.x; return this.left + (x - a) / (b - a) * (WIDTH - RIGHT - this.left); }
  py(y) { const [a, b] = this.view.y; return HEIGHT - BOTTOM - (y - a) / (b - a) * (HEIGHT - BOTTOM - TOP); }
  ux(px) { const [a, b] = this.view.x; return a + (px - this.left) / (WIDTH - RIGHT - this.left) * (b - a); }
  uy(py) { const [a, b] = this.view.y; return a + (HEIGHT - BOTTOM - py) / (HEIGHT - BOTTOM - TOP) * (b - a); }

  draw() {
    const { svg, data, view } = this;
    svg.replaceChildren();
    const across = data.x.names ? { step: 1, places: data.x.names.map((_, k) => k) } : ticks(view.x, 6);
    const up = ticks(view.y, 6);
    const heights = up.places.map(y => written(y, up.step));
    this.left = Math.max(76, 46 + 9 * Math.max(0, ...heights.map(h => h.length)));
    const [right, bottom] = [WIDTH - RIGHT, HEIGHT - BOTTOM];
    element(svg, "text", { x: WIDTH / 2, y: 24, class: "title" }, data.title);
    across.places.forEach(x => {
      const at = this.px(x);
      if (at < this.left - 1 || at > right + 1) return;
      if (!data.x.names) element(svg, "path", { class: "grid", d: `M${at} ${TOP}V${bottom}` });
      const name = data.x.names ? (data.x.names.length > MOST_NAMES ? "" : data.x.names[x]) : written(x, across.step);
      const most = data.x.names ? Math.max(3, Math.floor(70 / data.x.names.length)) : 99;
      element(svg, "text", { x: at, y: bottom + 20, class: "number" }, name.length > most ? name.slice(0, most - 1) + "…" : name);
    });
    up.places.forEach((y, k) => {
      element(svg, "path", { class: "grid", d: `M${this.left} ${this.py(y)}H${right}` });
      element(svg, "text", { x: this.left - 8, y: this.py(y) + 6, class: "height" }, heights[k]);
    });
    element(svg, "text", { x: (this.left + right) / 2, y: HEIGHT - 14, class: "axis" }, data.x.label);
    element(svg, "text", { transform: `translate(20 ${(TOP + bottom) / 2}) rotate(-90)`, class: "axis" }, data.y.label);
    // A window of its own cuts off what lies outside.
    const inner = element(svg, "svg", { x: this.left, y: TOP, width: right - this.left, height: bottom - TOP,
      viewBox: `${this.left} ${TOP} ${right - this.left} ${bottom - TOP}` });
    for (const [from, to] of data.shaded) {
      element(inner, "rect", { class: "shaded", x: this.px(from), y: TOP, width: Math.max(this.px(to) - this.px(from), 0), height: bottom - TOP });
    }
    for (const [label, height] of data.levels) {
      element(inner, "path", { class: "level", d: `M${this.left} ${this.py(height)}H${right}` });
      element(inner, "text", { class: "height", x: right - 4, y: this.py(height) - 5 }, label);
    }
    this.curves.forEach((curve, k) => {
      if (this.buttons[k]) this.buttons[k].setAttribute("aria-pressed", String(!curve.hidden));
      if (this.isShown(curve)) this.path(inner, curve);
    });
    element(svg, "path", { class: "frame", d: `M${this.left} ${TOP}V${bottom}H${right}` });
    this.cursor = element(inner, "g", { class: "cursor" });
    this.box = element(inner, "rect", { class: "box", width: 0, height: 0 });
    this.mark(this.at);
  }

  path(parent, curve) {
    const { x, y, style, role } = curve;
    let d = "", dots = "", pen = false;
    for (let k = 0; k < x.length; k++) {
      if (!Number.isFinite(x[k]) || !Number.isFinite(y[k])) { pen = false; continue; }
      const [px, py] = [this.px(x[k]).toFixed(1), this.py(y[k]).toFixed(1)];
      if (curve.error && Number.isFinite(curve.error[k])) {
        const [low, high] = [this.py(y[k] - curve.error[k]), this.py(y[k] + curve.error[k])];
        d += `M${px} ${low}V${high}m-5 0h10M${px - 5} ${low}h10`;
      }
      if (style === "line") { d += `${pen ? "L" : "M"}${px} ${py}`; pen = true; continue; }
      if (style === "stems") d += `M${px} ${this.py(0).toFixed(1)}V${py}`;
      dots += `M${px} ${py}h0`;
    }
    if (d) element(parent, "path", { class: `${role} line`, d });
    if (dots) element(parent, "path", { class: `${role} dots ${x.length > 100 ? "many" : "few"}`, d: dots });
  }

  // The point under a place of the drawing: of rows the nearest row, else the nearest point of any curve.
  find(px, py) {
    let best = null, least = Infinity;
    this.curves.filter(curve => this.isShown(curve)).forEach(curve => {
      for (let k = 0; k < curve.x.length; k++) {
        if (!Number.isFinite(curve.x[k]) || !Number.isFinite(curve.y[k])) continue;
        const dx = this.px(curve.x[k]) - px, dy = this.py(curve.y[k]) - py;
        const distance = this.ordered ? dx * dx + 1e-3 * dy * dy : dx * dx + dy * dy;
        if (distance < least) [least, best] = [distance, { curve, k }];
      }
    });
    return best;
  }

  // Marks a point: of rows in every figure of the same rows.
  point(at) {
    if (at && this.rows) {
      for (const other of linked.get(this.data.count)) other.mark(other.ofRow(this.rows[at.k]));
    } else {
      this.mark(at);
    }
  }

  ofRow(row) {
    let [low, high] = [0, this.rows.length - 1];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.rows[middle] < row) low = middle + 1; else high = middle;
    }
    if (low && row - this.rows[low - 1] < this.rows[low] - row) low--;
    return { curve: this.curves[0], k: low };
  }

  mark(at) {
    this.at = at;
    this.cursor.replaceChildren();
    this.values.replaceChildren();
    if (!at) return;
    const step = axis => (this.view[axis][1] - this.view[axis][0]) / 2000;
    const shown = this.rows ? this.curves.filter(curve => this.isShown(curve)) : [at.curve];
    const x = at.curve.x[at.k];
    if (!Number.isFinite(x)) return;
    const names = this.data.x.names;
    element(this.values, "span", {}, names ? names[Math.round(x)] : `${this.data.x.label}: ${written(x, step("x"))}`);
    element(this.cursor, "path", { d: `M${this.px(x)} ${TOP}V${HEIGHT - BOTTOM}` });
    for (const curve of shown) {
      const y = curve.y[at.k];
      if (!Number.isFinite(y)) continue;
      element(this.cursor, "circle", { class: curve.role, cx: this.px(curve.x[at.k]), cy: this.py(y), r: 5 });
      const error = curve.error && Number.isFinite(curve.error[at.k]) ? ` ± ${written(curve.error[at.k], step("y"))}` : "";
      element(this.values, "span", { class: curve.role }, `${curve.label || this.data.y.label}: ${written(y, step("y"))}${error}`);
    }
  }

  zoom(factor, x = (this.view.x[0] + this.view.x[1]) / 2, y = (this.view.y[0] + this.view.y[1]) / 2) {
    this.view = {
      x: this.view.x.map(v => x + (v - x) * factor),
      y: this.view.y.map(v => y + (v - y) * factor),
    };
    this.draw();
  }

  pan(right, up) {
    const [w, h] = [this.view.x[1] - this.view.x[0], this.view.y[1] - this.view.y[0]];
    this.view = { x: this.view.x.map(v => v + right * w), y: this.view.y.map(v => v + up * h) };
    this.draw();
  }

  reset() { this.view = this.whole(); this.draw(); }

  place(event) {
    const box = this.svg.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width * WIDTH, (event.clientY - box.top) / box.height * HEIGHT];
  }

  listen() {
    const { svg } = this;
    let from = null;
    svg.addEventListener("pointermove", event => {
      const [x, y] = this.place(event);
      if (!from) { this.point(this.find(x, y)); return; }
      if (from.pan) {
        this.pan((from.x - x) / (WIDTH - RIGHT - this.left), (y - from.y) / (HEIGHT - BOTTOM - TOP));
        [from.x, from.y] = [x, y];
        return;
      }
      for (const [key, value] of Object.entries({ x: Math.min(x, from.x), y: Math.min(y, from.y), width: Math.abs(x - from.x), height: Math.abs(y - from.y) })) {
        this.box.setAttribute(key, value);
      }
    });
    svg.addEventListener("pointerdown", event => {
      if (event.button !== 0) return;
      const [x, y] = this.place(event);
      from = { x, y, pan: event.shiftKey };
      if (event.pointerId !== undefined && event.isTrusted) svg.setPointerCapture(event.pointerId);
    });
    svg.addEventListener("pointerup", event => {
      const [x, y] = this.place(event);
      const began = from;
      from = null;
      if (!began || began.pan) return;
      this.box.setAttribute("width", 0);
      if (Math.abs(x - began.x) < 6 || Math.abs(y - began.y) < 6) return;
      const sorted = (a, b) => (a < b ? [a, b] : [b, a]);
      this.view = { x: sorted(this.ux(began.x), this.ux(x)), y: sorted(this.uy(began.y), this.uy(y)) };
      this.draw();
    });
    svg.addEventListener("pointercancel", () => { from = null; });
    svg.addEventListener("dblclick", () => this.reset());
    svg.addEventListener("wheel", event => {
      // The page scrolls unless the figure was chosen.
      if (!event.ctrlKey && document.activeElement !== svg) return;
      event.preventDefault();
      const [x, y] = this.place(event);
      this.zoom(event.deltaY < 0 ? 0.8 : 1.25, this.ux(x), this.uy(y));
    }, { passive: false });
    svg.addEventListener("keydown", event => {
      const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (way && event.shiftKey) this.pan(0.1 * way[0], 0.1 * way[1]);
      else if (way && way[0]) this.next(way[0]);
      else if (event.key === "+" || event.key === "=") this.zoom(0.6);
      else if (event.key === "-") this.zoom(1 / 0.6);
      else if (event.key === "0" || event.key === "Home") this.reset();
      else if (event.key === "Escape") this.point(null);
      else return;
      event.preventDefault();
    });
  }

  next(way) {
    const curve = (this.at && this.at.curve) || this.curves.find(curve => this.isShown(curve));
    if (!curve) return;
    const { length } = curve.x;
    const stride = Math.max(1, Math.round(length / 300));
    let k = this.at ? this.at.k + way * stride : way > 0 ? 0 : length - 1;
    k = Math.min(Math.max(k, 0), length - 1);
    while (k > 0 && k < length - 1 && !Number.isFinite(curve.x[k])) k += way;
    this.point({ curve, k });
  }
}
Plot.phase = "both";

// A heat map stays as it is drawn; its values are read.
function heat(svg, data) {
  const cells = decode(data.cells, Float32Array), rows = cells.length / data.columns;
  const values = document.createElement("p");
  values.className = "values";
  svg.parentNode.after(values);
  const [left, top, right, bottom] = data.place;
  const told = (side, share, index) => side.names.length ? side.names[index]
    : `${side.label}: ${written(side.range[0] + share * (side.range[1] - side.range[0]), (side.range[1] - side.range[0]) / 200)}`;
  svg.addEventListener("pointermove", event => {
    const box = svg.getBoundingClientRect(), view = svg.viewBox.baseVal;
    const across = ((event.clientX - box.left) / box.width * view.width - left) / (right - left);
    const down = ((event.clientY - box.top) / box.height * view.height - top) / (bottom - top);
    values.replaceChildren();
    if (!(across >= 0 && across < 1 && down >= 0 && down < 1)) return;
    const [column, row] = [Math.floor(across * data.columns), Math.floor(down * rows)];
    const value = cells[row * data.columns + column];
    element(values, "span", {}, told(data.sides[0], across, column));
    element(values, "span", {}, told(data.sides[1], 1 - down, row));
    element(values, "span", {}, `${data.legend}: ${Number.isFinite(value) ? Number(value.toPrecision(3)).toString().replace("-", "−") : "–"}`);
  });
}

function phases() {
  const sections = new Set(phased.map(plot => plot.figure.closest("section")));
  const boxes = [];
  for (const section of sections) {
    const set = document.createElement("fieldset");
    set.className = "phases";
    (section.querySelector("h2") || section.firstElementChild).after(set);
    element(set, "legend", {}, "Model shown");
    for (const [phase, words] of [["both", "both"], ["before", "before the diagnosis"], ["after", "after it"]]) {
      const label = element(set, "label", {});
      const box = element(label, "input", { type: "radio", name: `phase-${boxes.length}`, value: phase });
      box.checked = phase === "both";
      label.append(` ${words}`);
      box.addEventListener("change", () => {
        Plot.phase = phase;
        for (const all of boxes) for (const other of all) other.checked = other.value === phase;
        for (const plot of phased) plot.draw();
      });
    }
    boxes.push([...set.querySelectorAll("input")]);
  }
}

for (const holder of document.querySelectorAll("figure script[type='application/json']")) {
  const figure = holder.closest("figure"), svg = holder.parentNode.querySelector("svg");
  const data = JSON.parse(holder.textContent);
  holder.remove();
  if (data.cells === undefined) new Plot(figure, svg, data); else heat(svg, data);
}
phases();
document.documentElement.classList.add("scripted");
})();
