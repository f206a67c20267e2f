// SPDX-License-Identifier: Apache-2.0
// Curves over time, zoomed together; comes after charts.js.
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
    Object.assign(this, { x, y, t0, t1, left, right, width, top, plotBottom });
    this.node.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.node.replaceChildren();
    const clip = "clip" + charts.indexOf(this);
    const defs = svg("defs"), path = svg("clipPath", { id: clip });
    path.append(svg("rect", { x: left, y: top - 2, width: Math.max(1, width - left - right), height: plotBottom - top + 4 }));
    defs.append(path);
    this.node.append(defs);
    this.drawAxes(y0, y1, height);
    const inside = svg("g", { "clip-path": `url(#${clip})` });
    this.drawBands(inside);
    let points = this.drawCurves(inside);
    this.node.append(inside);
    points += this.drawRibbons();
    this.cursor = svg("line", { class: "cursor", y1: top, y2: plotBottom });
    this.brush = svg("rect", { class: "brush", y: top, height: Math.max(1, plotBottom - top) });
    this.node.append(this.cursor, this.brush);
    this.node.setAttribute("data-points", points);
  }
  drawAxes(y0, y1, height) {
    const { x, y, left, right, top, width, plotBottom } = this;
    for (const v of niceTicks(y0, y1, Math.max(2, (plotBottom - top) / 38))) {
      this.node.append(svg("line", { class: "grid-line", x1: left, x2: width - right, y1: y(v), y2: y(v) }));
      this.node.append(svg("text", { x: left - 8, y: y(v) + 4, "text-anchor": "end" }, number(v)));
    }
    for (const v of niceTicks(this.t0, this.t1, Math.max(3, (width - left) / 90))) {
      this.node.append(svg("line", { class: "grid-line", x1: x(v), x2: x(v), y1: top, y2: plotBottom }));
      this.node.append(svg("text", { x: x(v), y: height - 6, "text-anchor": "middle" }, number(v, 6) + " s"));
    }
    this.node.append(svg("line", { class: "axis", x1: left, x2: width - right, y1: plotBottom, y2: plotBottom }));
    this.node.append(svg("text", { class: "axis-name", x: 0, y: top + 3 }, this.unit || this.quantity));
    nameAxes(this.node, "time [s]", this.unit || this.quantity);
  }
  drawBands(inside) {
    const { x, y } = this;
    for (const b of this.bands) {
      let forward = "", back = "";
      for (let i = 0; i < b.t.length; ++i) {
        if (!finite(b.low[i]) || !finite(b.high[i])) continue;
        forward += `${forward ? "L" : "M"}${x(b.t[i]).toFixed(1)},${y(b.high[i]).toFixed(1)}`;
        back = `L${x(b.t[i]).toFixed(1)},${y(b.low[i]).toFixed(1)}` + back;
      }
      if (forward) inside.append(svg("path", { d: forward + back + "Z", fill: b.color, opacity: .13 }));
    }
  }
  /** The number of points. */
  drawCurves(inside) {
    let all = 0;
    for (const s of this.series) {
      const { d, points } = pathThrough(s.t.length, i => finite(s.y[i]) && [this.x(s.t[i]), this.y(s.y[i])]);
      inside.append(svg("path", { class: "curve", d, stroke: s.color, "stroke-width": s.width || 1.5, ...(s.dash ? { "stroke-dasharray": s.dash } : {}) }));
      all += points;
    }
    return all;
  }
  /** The number of stretches. */
  drawRibbons() {
    const { x, left, right, width } = this;
    let drawn = 0;
    this.ribbons.forEach((r, i) => {
      const at = this.plotBottom + 5 + 15 * i;
      for (const [from, to, state, reason, shade = state] of r.stretches) {
        const a = Math.max(x(from), left), b = Math.min(x(to), width - right);
        if (b <= a) continue;
        const bar = svg("rect", { x: a, y: at, width: Math.max(b - a, 1), height: 9, fill: color(shade) });
        bar.append(svg("title", {}, `${state}${reason === "none" ? "" : ": " + reason.replaceAll("_", " ")}, ${number(from)} to ${number(to)} s`));
        this.node.append(bar);
        ++drawn;
      }
      this.node.append(svg("text", { x: left - 8, y: at + 8, "text-anchor": "end", fill: r.color, style: `fill:${r.color};font-size:10px` }, r.label));
    });
    return drawn;
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
