// SPDX-License-Identifier: Apache-2.0
// What the pages draw with: elements, tables, plots; time_chart.js and space_chart.js come next, then the page's own script, ready.js last.
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

/** The path through `count` points of `at(i)`, interrupted where it gives none; and how many there are. */
function pathThrough(count, at) {
  let d = "", pen = false, points = 0;
  for (let i = 0; i < count; ++i) {
    const p = at(i);
    if (!p) { pen = false; continue; }
    d += `${pen ? "L" : "M"}${p[0].toFixed(1)},${p[1].toFixed(1)}`;
    pen = true;
    ++points;
  }
  return { d, points };
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
