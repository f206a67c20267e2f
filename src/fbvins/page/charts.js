// SPDX-License-Identifier: Apache-2.0
// What the pages draw with: elements, tables, plots. The page's own script comes next, ready.js last.
"use strict";
window.addEventListener("error", e => document.documentElement.setAttribute("data-error", e.message + " line " + e.lineno));
const data = JSON.parse(document.getElementById("data").textContent);

// --- small helpers ---------------------------------------------------------------------------------------------------
const NS = "http://www.w3.org/2000/svg";
function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [k, v] of Object.entries(attributes)) node.setAttribute(k, v);
  node.append(...children);
  return node;
}
function svg(tag, attributes = {}, text) {
  const node = document.createElementNS(NS, tag);
  for (const [k, v] of Object.entries(attributes)) node.setAttribute(k, v);
  if (text !== undefined) node.textContent = text;
  return node;
}
const color = name => `var(--${name})`;
const runColor = i => color("run" + i % 8);
const finite = x => x !== null && x !== undefined && Number.isFinite(x);
function number(x, digits = 3) {
  if (!finite(x)) return "–";
  if (x !== 0 && (Math.abs(x) < 1e-3 || Math.abs(x) >= 1e5)) return x.toExponential(1).replace("e-", "e−").replace("-", "−");
  return Number(x.toPrecision(digits)).toString().replace("-", "−");
}
function meters(x) { return !finite(x) ? ["–", ""] : x < 0.1 ? [(1000 * x).toFixed(x < 0.01 ? 1 : 0), "mm"] : x < 1 ? [(100 * x).toFixed(1), "cm"] : [x.toFixed(2), "m"]; }
function niceTicks(lo, hi, count) {
  if (!(hi > lo)) hi = lo + 1;
  const rough = (hi - lo) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find(m => m * power >= rough * 0.999);
  const ticks = [];
  for (let k = Math.ceil(lo / step - 1e-9); k * step <= hi + step * 1e-9; ++k) ticks.push(Number((k * step).toPrecision(12)));
  return ticks;
}
function card(title, note, legend) {
  const head = el("div", { class: "titled" }, el("h3", {}, title));
  if (note) head.append(el("span", { class: "note" }, note));
  if (legend) {
    const list = el("div", { class: "legend" });
    for (const [name, c, block] of legend) {
      const mark = el("i", block ? { class: "block" } : {});
      mark.style.background = c;
      list.append(el("span", {}, mark, name));
    }
    head.append(list);
  }
  return el("div", { class: "card" }, head);
}
const main = document.getElementById("main");
document.getElementById("title").textContent = data.title;
const section = title => { const s = el("section", {}, el("h2", {}, title)); main.append(s); return s; };
const figure = (value, unit, name) => el("div", { class: "figure" }, el("b", {}, value, el("small", {}, unit)), el("span", {}, name));
/** What the axes are, for a reader who cannot see the plot, too. */
function nameAxes(node, x, y) {
  node.setAttribute("data-axes", `${x} | ${y}`);
  node.setAttribute("aria-label", `${y || "value"} over ${x}`);
}
const charts = [];        // redrawn on resize or zoom
let zoom = null;          // [from s, to s] of all curves over time
function redraw() {
  for (const chart of charts) chart.draw();
  document.getElementById("unzoom").hidden = !zoom;
}

// --- curves over time, zoomed together -------------------------------------------------------------------------------
const tip = document.getElementById("tip");
class TimeChart {
  /** series: [{name, color, t, y, dash?, width?}], bands: [{color, t, low, high}], ribbons: [{stretches, label}] */
  constructor(parent, { series, bands = [], ribbons = [], unit = "", quantity = "", height = 190, zero = false, quantile = 1, digits = 3 }) {
    Object.assign(this, { series, bands, ribbons, unit, quantity, height, zero, quantile, digits });
    this.node = svg("svg", { class: "plot", role: "img" });
    parent.append(this.node);
    this.node.addEventListener("pointermove", e => this.hover(e));
    this.node.addEventListener("pointerleave", () => hideCursors());
    this.node.addEventListener("pointerdown", e => { this.from = this.secondsAt(e); this.node.setPointerCapture(e.pointerId); });
    this.node.addEventListener("pointerup", e => this.release(e));
    this.node.addEventListener("dblclick", () => { zoom = null; redraw(); });
    charts.push(this);
  }
  extent() {
    let end = 0;
    for (const s of [...this.series, ...this.bands]) if (s.t.length) end = Math.max(end, s.t[s.t.length - 1]);
    for (const r of this.ribbons) if (r.stretches.length) end = Math.max(end, r.stretches[r.stretches.length - 1][1]);
    return zoom || [0, end || 1];
  }
  range(t0, t1) {
    const seen = [];
    for (const s of this.series) for (let i = 0; i < s.t.length; ++i) if (s.t[i] >= t0 && s.t[i] <= t1 && finite(s.y[i])) seen.push(s.y[i]);
    if (!seen.length) return [0, 1];
    seen.sort((a, b) => a - b);
    const cut = Math.floor((seen.length - 1) * (1 - this.quantile));
    let lo = seen[cut], hi = seen[seen.length - 1 - cut];
    for (const b of this.bands) {      // a band may extend the range, but not flatten its curve
      const tops = b.high.filter((x, i) => finite(x) && b.t[i] >= t0 && b.t[i] <= t1).sort((x, y) => x - y);
      const bottoms = b.low.filter((x, i) => finite(x) && b.t[i] >= t0 && b.t[i] <= t1).sort((x, y) => x - y);
      const span = Math.max(hi - lo, 1e-12);
      if (tops.length) hi = Math.max(hi, Math.min(tops[Math.floor(tops.length * 0.95)], hi + 2.5 * span));
      if (bottoms.length) lo = Math.min(lo, Math.max(bottoms[Math.floor(bottoms.length * 0.05)], lo - 2.5 * span));
    }
    for (const s of this.series) if (s.dash) { lo = Math.min(lo, ...s.y); hi = Math.max(hi, ...s.y); }   // bounds are always visible
    if (this.zero) lo = Math.min(0, lo);
    const pad = 0.05 * (hi - lo || Math.abs(hi) || 1);
    return [this.zero && lo === 0 ? 0 : lo - pad, hi + pad];
  }
  draw() {
    const width = Math.max(280, this.node.parentElement.clientWidth - 36), left = 52, right = 6, top = 8;
    const ribbonHeight = this.ribbons.length * 15, bottom = 24, height = this.height + ribbonHeight;
    const [t0, t1] = this.extent(), [y0, y1] = this.range(t0, t1);
    const x = t => left + (t - t0) / (t1 - t0) * (width - left - right);
    const plotBottom = height - bottom - ribbonHeight;
    const y = v => plotBottom - (v - y0) / (y1 - y0) * (plotBottom - top);
    Object.assign(this, { x, y, t0, t1, left, right, width });
    this.node.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.node.replaceChildren();
    const clip = "clip" + charts.indexOf(this);
    const defs = svg("defs"), path = svg("clipPath", { id: clip });
    path.append(svg("rect", { x: left, y: top - 2, width: Math.max(1, width - left - right), height: plotBottom - top + 4 }));
    defs.append(path);
    this.node.append(defs);
    for (const v of niceTicks(y0, y1, Math.max(2, (plotBottom - top) / 38))) {
      this.node.append(svg("line", { class: "grid-line", x1: left, x2: width - right, y1: y(v), y2: y(v) }));
      this.node.append(svg("text", { x: left - 8, y: y(v) + 4, "text-anchor": "end" }, number(v)));
    }
    for (const v of niceTicks(t0, t1, Math.max(3, (width - left) / 90))) {
      this.node.append(svg("line", { class: "grid-line", x1: x(v), x2: x(v), y1: top, y2: plotBottom }));
      this.node.append(svg("text", { x: x(v), y: height - 6, "text-anchor": "middle" }, number(v, 6) + " s"));
    }
    this.node.append(svg("line", { class: "axis", x1: left, x2: width - right, y1: plotBottom, y2: plotBottom }));
    this.node.append(svg("text", { class: "axis-name", x: 0, y: top + 3 }, this.unit || this.quantity));
    nameAxes(this.node, "time [s]", this.unit || this.quantity);
    const inside = svg("g", { "clip-path": `url(#${clip})` });
    let points = 0;
    for (const b of this.bands) {
      let forward = "", back = "";
      for (let i = 0; i < b.t.length; ++i) {
        if (!finite(b.low[i]) || !finite(b.high[i])) continue;
        forward += `${forward ? "L" : "M"}${x(b.t[i]).toFixed(1)},${y(b.high[i]).toFixed(1)}`;
        back = `L${x(b.t[i]).toFixed(1)},${y(b.low[i]).toFixed(1)}` + back;
      }
      if (forward) inside.append(svg("path", { d: forward + back + "Z", fill: b.color, opacity: .13 }));
    }
    for (const s of this.series) {
      let d = "", pen = false;
      for (let i = 0; i < s.t.length; ++i) {
        if (!finite(s.y[i])) { pen = false; continue; }
        d += `${pen ? "L" : "M"}${x(s.t[i]).toFixed(1)},${y(s.y[i]).toFixed(1)}`;
        pen = true;
        ++points;
      }
      inside.append(svg("path", { class: "curve", d, stroke: s.color, "stroke-width": s.width || 1.5, ...(s.dash ? { "stroke-dasharray": s.dash } : {}) }));
    }
    this.node.append(inside);
    this.ribbons.forEach((r, i) => {
      const at = plotBottom + 5 + 15 * i;
      for (const [from, to, state, reason, shade = state] of r.stretches) {
        const a = Math.max(x(from), left), b = Math.min(x(to), width - right);
        if (b <= a) continue;
        const bar = svg("rect", { x: a, y: at, width: Math.max(b - a, 1), height: 9, fill: color(shade) });
        bar.append(svg("title", {}, `${state}${reason === "none" ? "" : ": " + reason.replaceAll("_", " ")}, ${number(from)} to ${number(to)} s`));
        this.node.append(bar);
        ++points;
      }
      this.node.append(svg("text", { x: left - 8, y: at + 8, "text-anchor": "end", fill: r.color, style: `fill:${r.color};font-size:10px` }, r.label));
    });
    this.cursor = svg("line", { class: "cursor", y1: top, y2: plotBottom });
    this.brush = svg("rect", { class: "brush", y: top, height: Math.max(1, plotBottom - top) });
    this.node.append(this.cursor, this.brush);
    this.node.setAttribute("data-points", points);
  }
  secondsAt(e) {
    const box = this.node.getBoundingClientRect();
    const px = (e.clientX - box.left) / box.width * this.width;
    return this.t0 + Math.min(1, Math.max(0, (px - this.left) / (this.width - this.left - this.right))) * (this.t1 - this.t0);
  }
  hover(e) {
    const t = this.secondsAt(e);
    for (const chart of charts) if (chart.showCursor) chart.showCursor(t);
    if (this.from !== undefined) {
      const a = this.x(Math.min(t, this.from)), b = this.x(Math.max(t, this.from));
      this.brush.setAttribute("x", a);
      this.brush.setAttribute("width", b - a);
      this.brush.style.visibility = "visible";
    }
    tip.replaceChildren(el("div", {}, number(t, 4) + " s"));
    for (const s of this.series) {
      let lo = 0, hi = s.t.length - 1;
      while (lo < hi) { const mid = lo + hi >> 1; if (s.t[mid] < t) lo = mid + 1; else hi = mid; }
      if (!s.t.length || !finite(s.y[lo])) continue;
      const mark = el("span", { class: "swatch" });
      mark.style.background = s.color;
      tip.append(el("div", {}, mark, s.name, el("b", {}, number(s.y[lo], this.digits) + (this.unit ? " " + this.unit : ""))));
    }
    tip.style.left = Math.min(e.clientX + 14, innerWidth - tip.offsetWidth - 8) + "px";
    tip.style.top = e.clientY + 14 + "px";
    tip.style.visibility = "visible";
  }
  showCursor(t) {
    const inside = t >= this.t0 && t <= this.t1;
    this.cursor.style.visibility = inside ? "visible" : "hidden";
    if (inside) { this.cursor.setAttribute("x1", this.x(t)); this.cursor.setAttribute("x2", this.x(t)); }
  }
  release(e) {
    const t = this.secondsAt(e), from = this.from;
    this.from = undefined;
    this.brush.style.visibility = "hidden";
    if (from !== undefined && Math.abs(this.x(t) - this.x(from)) > 6) { zoom = [Math.min(from, t), Math.max(from, t)]; redraw(); }
  }
}
function hideCursors() {
  tip.style.visibility = "hidden";
  for (const chart of charts) if (chart.cursor) chart.cursor.style.visibility = "hidden";
}

// --- paths in space: a fixed view, or rotated with the mouse -----------------------------------------------------------
class SpaceChart {
  /** paths: [{name, color, x, y, z, width, dash}]; view: "top", "side" or "3d" */
  constructor(parent, { paths, view, height = 330 }) {
    Object.assign(this, { paths, view, height, yaw: -0.7, pitch: 0.55, scale: 1, shift: [0, 0] });
    this.node = svg("svg", { class: "space", role: "img" });
    parent.append(this.node);
    this.node.addEventListener("pointerdown", e => { this.last = [e.clientX, e.clientY]; this.node.setPointerCapture(e.pointerId); });
    this.node.addEventListener("pointerup", () => { this.last = undefined; });
    this.node.addEventListener("pointermove", e => this.drag(e));
    this.node.addEventListener("wheel", e => { e.preventDefault(); this.scale *= Math.exp(-0.0015 * e.deltaY); this.draw(); }, { passive: false });
    this.node.addEventListener("dblclick", () => { this.scale = 1; this.shift = [0, 0]; this.yaw = -0.7; this.pitch = 0.55; this.draw(); });
    const all = { x: [], y: [], z: [] };
    for (const p of paths) for (const k of ["x", "y", "z"]) for (const v of p[k]) if (finite(v)) all[k].push(v);
    this.box = ["x", "y", "z"].map(k => all[k].length ? [Math.min(...chunked(all[k], Math.min)), Math.max(...chunked(all[k], Math.max))] : [0, 1]);
    charts.push(this);
  }
  project(x, y, z) {
    if (this.view === "top") return [x, -y];
    if (this.view === "side") return [x, -z];
    const c = Math.cos(this.yaw), s = Math.sin(this.yaw), cp = Math.cos(this.pitch), sp = Math.sin(this.pitch);
    const u = c * x - s * y, v = s * x + c * y;
    return [u, -(z * cp + v * sp)];
  }
  draw() {
    const width = Math.max(240, this.node.parentElement.clientWidth - 36), height = this.height, margin = this.view === "3d" ? 16 : 34;
    const centre = this.box.map(([a, b]) => (a + b) / 2);
    const corners = [];
    for (const x of this.box[0]) for (const y of this.box[1]) for (const z of this.box[2]) corners.push(this.project(x - centre[0], y - centre[1], z - centre[2]));
    const reach = i => Math.max(0.05, ...corners.map(c => Math.abs(c[i])));
    const radius = Math.hypot(...this.box.map(([a, b]) => (b - a) / 2));
    const fit = this.view === "3d" ? Math.min(width, height) / 2 / radius * 0.92
                                   : Math.min((width / 2 - margin) / reach(0), (height / 2 - margin) / reach(1));
    const k = fit * this.scale;
    const at = (x, y, z) => { const [u, v] = this.project(x - centre[0], y - centre[1], z - centre[2]); return [width / 2 + this.shift[0] + k * u, height / 2 + this.shift[1] + k * v]; };
    this.node.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.node.replaceChildren();
    this.view === "3d" ? this.drawFloor(at) : this.drawGrid(at, k, centre, width, height);
    nameAxes(this.node, "x [m]", this.view === "3d" ? "y, z [m]" : this.view === "top" ? "y [m]" : "z [m]");
    let points = 0;
    for (const p of this.paths) {
      let d = "", pen = false;
      for (let i = 0; i < p.x.length; ++i) {
        if (!finite(p.x[i])) { pen = false; continue; }
        const [u, v] = at(p.x[i], p.y[i], p.z[i]);
        d += `${pen ? "L" : "M"}${u.toFixed(1)},${v.toFixed(1)}`;
        pen = true;
        ++points;
      }
      this.node.append(svg("path", { class: "curve", d, stroke: p.color, "stroke-width": p.width || 1.6, opacity: p.opacity || 1 }));
      const first = p.x.findIndex(finite);
      if (first >= 0 && p.mark) {
        const [u, v] = at(p.x[first], p.y[first], p.z[first]);
        this.node.append(svg("circle", { cx: u, cy: v, r: 4, fill: color("card"), stroke: p.color, "stroke-width": 2 }));
      }
    }
    this.node.setAttribute("data-points", points);
  }
  drawGrid(at, k, centre, width, height) {
    const halfX = width / 2 / k, halfY = height / 2 / k, vertical = this.view === "top" ? 1 : 2;
    const dx = -this.shift[0] / k, dy = this.shift[1] / k;
    for (const v of niceTicks(centre[0] + dx - halfX, centre[0] + dx + halfX, width / 80)) {
      const [u] = at(v, centre[1], centre[2]);
      this.node.append(svg("line", { class: "grid-line", x1: u, x2: u, y1: 0, y2: height - 16 }));
      if (u > 24 && u < width - 14) this.node.append(svg("text", { x: u, y: height - 3, "text-anchor": "middle" }, number(v) + " m"));
    }
    this.node.append(svg("text", { class: "axis-name", x: width - 2, y: height - 3, "text-anchor": "end" }, "x"));
    this.node.append(svg("text", { class: "axis-name", x: 0, y: 9 }, vertical === 1 ? "y [m]" : "z [m]"));
    for (const v of niceTicks(centre[vertical] + dy - halfY, centre[vertical] + dy + halfY, height / 60)) {
      const [, w] = vertical === 1 ? at(centre[0], v, centre[2]) : at(centre[0], centre[1], v);
      if (w > height - 20 || w < 22) continue;
      this.node.append(svg("line", { class: "grid-line", x1: 0, x2: width, y1: w, y2: w }));
      this.node.append(svg("text", { x: 0, y: w - 3 }, number(v)));
    }
  }
  /** A grid on the floor below the path, and the axes. */
  drawFloor(at) {
    const [bx, by, bz] = this.box, step = niceTicks(0, Math.max(bx[1] - bx[0], by[1] - by[0]), 7)[1] || 1;
    const x0 = Math.floor(bx[0] / step) * step, x1 = Math.ceil(bx[1] / step) * step, y0 = Math.floor(by[0] / step) * step, y1 = Math.ceil(by[1] / step) * step;
    const line = (a, b, c) => this.node.append(svg("line", { class: c, x1: a[0], y1: a[1], x2: b[0], y2: b[1] }));
    for (let x = x0; x <= x1 + 1e-9; x += step) line(at(x, y0, bz[0]), at(x, y1, bz[0]), "grid-line");
    for (let y = y0; y <= y1 + 1e-9; y += step) line(at(x0, y, bz[0]), at(x1, y, bz[0]), "grid-line");
    const origin = at(x0, y0, bz[0]);
    [[x0 + step, y0, bz[0]], [x0, y0 + step, bz[0]], [x0, y0, bz[0] + step]].forEach((end, i) => {
      const tipOf = at(...end);
      this.node.append(svg("line", { x1: origin[0], y1: origin[1], x2: tipOf[0], y2: tipOf[1], stroke: color("axis" + i), "stroke-width": 2 }));
      this.node.append(svg("text", { x: tipOf[0] + 4, y: tipOf[1] + 4 }, "xyz"[i]));
    });
    this.node.append(svg("text", { x: 0, y: 10 }, `grid of ${number(step)} m`));
  }
  drag(e) {
    if (!this.last) return;
    const dx = e.clientX - this.last[0], dy = e.clientY - this.last[1];
    this.last = [e.clientX, e.clientY];
    if (this.view === "3d" && !e.shiftKey) {
      this.yaw += 0.008 * dx;
      this.pitch = Math.min(1.57, Math.max(-0.2, this.pitch + 0.006 * dy));
    } else {
      this.shift = [this.shift[0] + dx, this.shift[1] + dy];
    }
    this.draw();
  }
}
function chunked(values, pick) {
  const out = [];
  for (let i = 0; i < values.length; i += 4096) out.push(pick(...values.slice(i, i + 4096)));
  return out;
}

// --- plots over a quantity other than time -----------------------------------------------------------------------------
class XYChart {
  /** series: [{name, color, x, y, dash?}]; both axes begin at 0, that of y below it where a series does. */
  constructor(parent, { series, xUnit = "", xName = "", yName = "", height = 200, yMax, yFormat = v => number(v), xMax, marks = [], bars = false }) {
    Object.assign(this, { series, xUnit, xName, yName, height, yMax, yFormat, xMax, marks, bars });
    this.node = svg("svg", { role: "img" });
    parent.append(this.node);
    charts.push(this);
  }
  draw() {
    const width = Math.max(280, this.node.parentElement.clientWidth - 36), height = this.height, left = 52, right = 10, top = this.yName ? 20 : 8, bottom = this.xName ? 40 : 24;
    let x1 = this.xMax || 0, y0 = 0, y1 = this.yMax || 0;
    for (const s of this.series) { if (!this.xMax) for (const v of s.x) x1 = Math.max(x1, v); if (!this.yMax) for (const v of s.y) { y1 = Math.max(y1, v); y0 = Math.min(y0, v); } }
    x1 = x1 || 1; y1 = y1 || 1;
    const x = v => left + Math.min(v / x1, 1) * (width - left - right), y = v => height - bottom - (v - y0) / (y1 - y0) * (height - top - bottom);
    this.node.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.node.replaceChildren();
    for (const v of niceTicks(y0, y1, 4)) {
      this.node.append(svg("line", { class: "grid-line", x1: left, x2: width - right, y1: y(v), y2: y(v) }));
      this.node.append(svg("text", { x: left - 8, y: y(v) + 4, "text-anchor": "end" }, this.yFormat(v)));
    }
    for (const v of niceTicks(0, x1, Math.max(3, (width - left) / 90))) {
      this.node.append(svg("line", { class: "grid-line", x1: x(v), x2: x(v), y1: top, y2: height - bottom }));
      this.node.append(svg("text", { x: x(v), y: height - bottom + 18, "text-anchor": "middle" }, number(v) + " " + this.xUnit));
    }
    this.node.append(svg("text", { class: "axis-name", x: width - right, y: height - 2, "text-anchor": "end" }, this.xName));
    this.node.append(svg("line", { class: "axis", x1: left, x2: width - right, y1: height - bottom, y2: height - bottom }));
    this.node.append(svg("text", { class: "axis-name", x: 0, y: 10 }, this.yName));
    nameAxes(this.node, this.xName ? `${this.xName} [${this.xUnit}]` : this.xUnit, this.yName);
    let points = 0;
    for (const s of this.series) {
      let d = "";
      s.x.forEach((v, i) => {
        if (this.bars && !s.dash) {
          const next = i + 1 < s.x.length ? s.x[i + 1] : v + (s.x[1] - s.x[0] || 1);
          d += `${d ? "L" : `M${x(v).toFixed(1)},${y(0).toFixed(1)}L`}${x(v).toFixed(1)},${y(s.y[i]).toFixed(1)}L${x(next).toFixed(1)},${y(s.y[i]).toFixed(1)}`;
        } else d += `${d ? "L" : "M"}${x(v).toFixed(1)},${y(s.y[i]).toFixed(1)}`;
        ++points;
      });
      if (this.bars && !s.dash && d) this.node.append(svg("path", { d: d + `L${width - right},${y(0)}Z`, fill: s.color, opacity: .12 }));
      this.node.append(svg("path", { class: "curve", d, stroke: s.color, ...(s.dash ? { "stroke-dasharray": s.dash } : {}) }));
    }
    for (const m of this.marks) {
      this.node.append(svg("line", { x1: x(m.x), x2: x(m.x), y1: top, y2: height - bottom, stroke: m.color, "stroke-dasharray": "4 3", opacity: .8 }));
      this.node.append(svg("circle", { cx: x(m.x), cy: y(m.y || 0), r: m.y ? 3 : 0, fill: m.color }));
    }
    this.node.setAttribute("data-points", points);
  }
}

/** Shares of the values in steps up to the limit; the last one holds all beyond. */
function histogram(values, limit, bins = 48) {
  const counts = new Array(bins).fill(0);
  for (const v of values) counts[Math.min(bins - 1, Math.floor(v / limit * bins))] += 1 / values.length;
  return { x: counts.map((_, i) => i * limit / bins), y: counts };
}

// --- tables ----------------------------------------------------------------------------------------------------------
/** rows: arrays of text or {text, class, swatch}; the first `texts` columns are text. */
function table(head, rows, texts = 1) {
  const thead = el("tr"), body = el("tbody");
  head.forEach((h, i) => thead.append(el("th", i < texts ? { class: "text" } : {}, h)));
  for (const row of rows) {
    const tr = el("tr");
    row.forEach((cell, i) => {
      const c = typeof cell === "object" && cell !== null ? cell : { text: cell };
      const td = el("td", { class: [i < texts ? "text" : "", c.class || ""].join(" ").trim() });
      if (c.swatch) { const mark = el("span", { class: "swatch" }); mark.style.background = c.swatch; td.append(mark); }
      td.append(c.text ?? "–");
      tr.append(td);
    });
    body.append(tr);
  }
  return el("div", { class: "scroll" }, el("table", {}, el("thead", {}, thead), body));
}
const COLUMNS = ["max", "mean", "median", "rmse", "std"];
function errorTable(runs, quantity) {
  const best = Object.fromEntries(COLUMNS.map(k => [k, Math.min(...runs.filter(r => r.table).map(r => r.table[quantity][k]))]));
  const rows = runs.map(r => [{ text: r.label, swatch: r.color }, ...COLUMNS.map(k => r.table ? { text: r.table[quantity][k].toFixed(4), class: runs.length > 1 && r.table[quantity][k] === best[k] ? "best" : "" } : "–"),
    r.table ? String(r.table[quantity].count) : "–"]);
  return table(["", "Max", "Mean", "Median", "RMSE", "Std", "Poses"], rows);
}
