// SPDX-License-Identifier: Apache-2.0
// Paths in space: a fixed view, or rotated with the mouse; comes after charts.js.
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
    let all = 0;
    for (const p of this.paths) {
      const { d, points } = pathThrough(p.x.length, i => finite(p.x[i]) && at(p.x[i], p.y[i], p.z[i]));
      all += points;
      this.node.append(svg("path", { class: "curve", d, stroke: p.color, "stroke-width": p.width || 1.6, opacity: p.opacity || 1 }));
      const first = p.x.findIndex(finite);
      if (first >= 0 && p.mark) {
        const [u, v] = at(p.x[first], p.y[first], p.z[first]);
        this.node.append(svg("circle", { cx: u, cy: v, r: 4, fill: color("card"), stroke: p.color, "stroke-width": 2 }));
      }
    }
    this.node.setAttribute("data-points", all);
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
