// SPDX-License-Identifier: Apache-2.0
// The page of a calibration, drawn with fbvins/page/charts.js.

// --- an image, divided into cells, with arrows ------------------------------------------------------------------------
class ImageChart {
  /** size: of the image, px; cells: {columns, rows}; shades: a value a cell, null: none; arrows: {u, v, du, dv}, px;
      longest: the arrow's length in px that is drawn as long as a cell is wide; none is drawn longer than two. */
  constructor(parent, { size, cells, shades, full, unit, arrows, longest }) {
    Object.assign(this, { size, cells, shades, full, unit, arrows, longest });
    this.node = svg("svg", { role: "img", style: "overflow:hidden" });
    parent.append(this.node);
    charts.push(this);
  }
  draw() {
    const width = Math.max(240, this.node.parentElement.clientWidth - 36), left = 44, right = 12, top = 16, bottom = 34;
    const scale = (width - left - right) / this.size[0], height = top + bottom + scale * this.size[1];
    const x = u => left + u * scale, y = v => top + v * scale;
    this.node.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.node.replaceChildren();
    nameAxes(this.node, "u [px]", "v [px]");
    let points = 0;
    const wide = this.size[0] / this.cells.columns, high = this.size[1] / this.cells.rows;
    (this.shades || []).forEach((value, i) => {
      const u = i % this.cells.columns * wide, v = Math.floor(i / this.cells.columns) * high;
      const cell = svg("rect", { x: x(u) + 0.5, y: y(v) + 0.5, width: wide * scale - 1, height: high * scale - 1,
        ...(value ? { fill: color("accent"), "fill-opacity": 0.06 + 0.84 * Math.min(1, value / this.full) } : { fill: "none", stroke: color("lost"), "stroke-width": 0.7, "stroke-dasharray": "2 2" }) });
      cell.append(svg("title", {}, value ? `${number(value)} ${this.unit}` : "none"));
      this.node.append(cell);
      ++points;
    });
    this.node.append(svg("rect", { x: left, y: top, width: width - left - right, height: scale * this.size[1], fill: "none", stroke: color("line") }));
    for (const u of niceTicks(0, this.size[0], Math.max(3, width / 110))) this.node.append(svg("text", { x: x(u), y: height - bottom + 15, "text-anchor": "middle" }, number(u, 5)));
    for (const v of niceTicks(0, this.size[1], 5)) this.node.append(svg("text", { x: left - 6, y: y(v) + 4, "text-anchor": "end" }, number(v, 5)));
    this.node.append(svg("text", { class: "axis-name", x: width - right, y: height - 3, "text-anchor": "end" }, "u [px]"));
    this.node.append(svg("text", { class: "axis-name", x: 0, y: 10 }, "v [px]"));
    if (this.arrows) points += this.drawArrows(x, y, wide * scale);
    this.node.setAttribute("data-points", points);
  }
  drawArrows(x, y, cell) {
    const a = this.arrows, stretch = cell / this.longest;
    let d = "";
    a.u.forEach((u, i) => {
      if (!finite(a.du[i])) return;
      const k = Math.min(stretch, 2 * cell / Math.hypot(a.du[i], a.dv[i])), along = [k * a.du[i], k * a.dv[i]], from = [x(u), y(a.v[i])], to = [from[0] + along[0], from[1] + along[1]];
      const tip = s => [to[0] - 0.3 * along[0] + s * 0.18 * along[1], to[1] - 0.3 * along[1] - s * 0.18 * along[0]];
      const at = p => p[0].toFixed(1) + "," + p[1].toFixed(1);
      d += `M${at(from)}L${at(to)}M${at(tip(1))}L${at(to)}L${at(tip(-1))}`;
    });
    this.node.append(svg("path", { d, fill: "none", stroke: color("run1"), "stroke-width": 1.1 }));
    return a.u.length;
  }
}

// --- a symmetric matrix ----------------------------------------------------------------------------------------------
class MatrixChart {
  /** names; rows: the lower triangle with the diagonal, from -1 to 1. */
  constructor(parent, { names, rows }) {
    Object.assign(this, { names, rows });
    this.node = svg("svg", { role: "img" });
    parent.append(this.node);
    charts.push(this);
  }
  draw() {
    const n = this.names.length, width = Math.max(240, this.node.parentElement.clientWidth - 36), left = 84, below = 84;
    const cell = Math.min(24, (width - left) / n), height = n * cell + below;
    const each = Math.max(1, Math.ceil(11 / cell));     // labels that do not touch one another
    this.node.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.node.replaceChildren();
    nameAxes(this.node, "parameter", "parameter");
    for (let i = 0; i < n; ++i) {
      for (let j = 0; j < i; ++j) {
        const value = this.rows[i][j];
        if (!finite(value)) continue;
        const square = svg("rect", { x: left + j * cell, y: i * cell, width: cell - 0.6, height: cell - 0.6, fill: color(value < 0 ? "run1" : "accent"), "fill-opacity": Math.abs(value) });
        square.append(svg("title", {}, `${this.names[i]} and ${this.names[j]}: ${number(value)}`));
        this.node.append(square);
      }
      this.node.append(svg("rect", { x: left + i * cell, y: i * cell, width: cell - 0.6, height: cell - 0.6, fill: color("line") }));
      if (i % each) continue;
      this.node.append(svg("text", { x: left - 6, y: (i + 0.5) * cell + 4, "text-anchor": "end" }, this.names[i]));
      const at = [left + (i + 0.5) * cell + 4, n * cell + 6];
      this.node.append(svg("text", { x: at[0], y: at[1], "text-anchor": "end", transform: `rotate(-90 ${at})` }, this.names[i]));
    }
    this.node.setAttribute("data-points", n * n);
  }
}

// --- parts of the page -------------------------------------------------------------------------------------------------
const percentile = (values, share) => { const v = values.filter(finite).sort((a, b) => a - b); return v[Math.floor(share * (v.length - 1))] || 0; };
const AXES = ["x", "y", "z"];
const cameraColor = k => runColor(k);

function keyFigures(parent) {
  const grid = el("div", { class: "grid" });
  parent.append(grid);
  data.cameras.forEach((c, k) => {
    const box = card(`${c.name}, ${c.model}`, `${c.size[0]} x ${c.size[1]}`), list = el("div", { class: "figures" });
    list.append(figure(number(c.rms_px), "px", "residual of a coordinate, RMS"), figure((100 * c.coverage).toFixed(0), "%", "of the image holds corners"),
      figure(String(c.views), "", "images"), figure(String(c.corners), "", "corners"), figure(String(c.left_out), "", "corners left out"));
    box.append(list);
    grid.append(box);
  });
  if (!data.imu) return;
  const box = card("IMU", `${number(data.imu.duration_s)} s`), list = el("div", { class: "figures" });
  list.append(figure(number(data.imu.gyro_rms_sigmas), "σ", "gyroscope's residuals, RMS"), figure(number(data.imu.accel_rms_sigmas), "σ", "accelerometer's residuals, RMS"),
    figure(number(1000 * data.imu.time_offset_s), "ms", "time offset"), figure(String(data.imu.readings), "", "readings"), figure(String(data.imu.readings_refused), "", "readings refused"));
  box.append(list);
  grid.append(box);
}

function weakness(parent) {
  const box = card("Poorly determined", data.weak.length ? "one standard deviation, and what would be wanted" : "");
  box.id = "weak";
  const size = (value, unit) => number(value, 2) + (unit === "degrees" ? "°" : " " + unit);
  if (data.weak.length) box.append(table(["what", "record this", "known to", "wanted"], data.weak.map(([what, sigma, aim, unit, advice]) => [what, advice, size(sigma, unit), size(aim, unit)]), 2));
  else box.append(el("p", { class: "note" }, "Nothing: all that was asked for is determined as well as the odometry needs it."));
  parent.append(box);
  if (!data.remarks.length) return;
  const remarks = card("Remarks"), list = el("ul", { class: "note" });
  for (const remark of data.remarks) list.append(el("li", {}, remark));
  remarks.append(list);
  remarks.style.marginTop = "16px";
  parent.append(remarks);
}

function whereInTheImage(parent, c) {
  const cells = c.cells, grid = el("div", { class: "grid two" });
  parent.append(grid);
  const most = Math.max(...cells.corners);
  const coverage = card("Coverage", `corners in each part of the image, up to ${most}; red: none`);
  grid.append(coverage);
  new ImageChart(coverage, { size: c.size, cells, shades: cells.corners, full: percentile(cells.corners, 0.95) || 1, unit: "corners" });
  const worst = Math.max(...cells.certainty_px.filter(finite));
  const certainty = card("Where the lens is uncertain", `standard deviation of a ray's place, up to ${number(worst, 2)} px; red: no ray. A turn of the whole camera does not count`);
  grid.append(certainty);
  new ImageChart(certainty, { size: c.size, cells, shades: cells.certainty_px, full: worst, unit: "px" });
  const lengths = cells.du.map((du, i) => cells.corners[i] ? Math.hypot(du, cells.dv[i]) : null), longest = percentile(lengths, 0.95) || 1;
  const wide = c.size[0] / cells.columns, high = c.size[1] / cells.rows, seen = cells.corners.map((n, i) => i).filter(i => cells.corners[i] > 0);
  const means = card("Mean residual, by place", `detected minus predicted; as long as a cell: ${number(longest, 2)} px. A pattern is a wrong lens model or a bent board`);
  grid.append(means);
  new ImageChart(means, { size: c.size, cells, longest, arrows: { u: seen.map(i => (i % cells.columns + 0.5) * wide), v: seen.map(i => (Math.floor(i / cells.columns) + 0.5) * high), du: seen.map(i => cells.du[i]), dv: seen.map(i => cells.dv[i]) } });
  const single = percentile(c.arrows.du.map((du, i) => Math.hypot(du, c.arrows.dv[i])), 0.95) || 1;
  const some = card("Single residuals", `${c.arrows.u.length} of ${c.corners}; as long as a cell: ${number(single, 2)} px`);
  grid.append(some);
  new ImageChart(some, { size: c.size, cells, longest: single, arrows: c.arrows });
}

function byDistance(parent, c) {
  const grid = el("div", { class: "grid two" }), legend = [["RMS", color("run0")], ["mean, outwards", color("run1")], ["noise of a corner", color("faint")]];
  grid.style.marginTop = "16px";
  parent.append(grid);
  for (const [title, key, xUnit, xName] of [["Residuals by distance from the centre", "by_radius", "px", "distance from the principal point"], ["Residuals by angle of incidence", "by_angle", "°", "angle between ray and axis"]]) {
    const b = c[key], box = card(title, "", legend);
    grid.append(box);
    new XYChart(box, { xUnit, xName, yName: "px", series: [{ name: "RMS", color: color("run0"), x: b.x, y: b.rms_px }, { name: "outwards", color: color("run1"), x: b.x, y: b.outwards_px },
      { name: "noise", color: color("faint"), x: [0, Math.max(...b.x)], y: [data.noise_px, data.noise_px], dash: "5 4" }] });
  }
}

/** The share of a normal distribution's values in each step of a histogram of their sizes. */
const normal = (limit, bins) => Array.from({ length: bins }, (_, i) => { const z = (i + 0.5) * limit / bins; return { x: z, y: 2 * limit / bins * Math.exp(-z * z / 2) / Math.sqrt(2 * Math.PI) }; });
function distribution(parent, title, groups) {
  const limit = 5, bins = 40, box = card(title, "share of the values; the last step holds all beyond", [...groups.map(([name, c]) => [name, c]), ["normal", color("faint")]]);
  const expected = normal(limit, bins);
  parent.append(box);
  new XYChart(box, { xUnit: "σ", xName: "size of the residual", yName: "share", bars: true, xMax: limit, yFormat: v => Math.round(100 * v) + " %",
    series: [...groups.map(([name, c, values]) => ({ name, color: c, ...histogram(values.filter(finite).map(Math.abs), limit, bins) })), { name: "normal", color: color("faint"), dash: "5 4", x: expected.map(p => p.x), y: expected.map(p => p.y) }] });
}

function overTime() {
  const s = section("Residuals of the corners"), stack = el("div", { class: "stack" });
  s.append(stack);
  const box = card("Residuals by time", "RMS of each image; peaks are blurred or badly stamped images", data.cameras.map((c, k) => [c.name, cameraColor(k)]));
  stack.append(box);
  new TimeChart(box, { unit: "px", zero: true, quantile: 0.999, series: data.cameras.map((c, k) => ({ name: c.name, color: cameraColor(k), t: c.by_time.t, y: c.by_time.rms_px, width: 1.1 })) });
  distribution(stack, "Distribution", data.cameras.map((c, k) => [c.name, cameraColor(k), [...c.arrows.du, ...c.arrows.dv].map(v => v / data.noise_px)]));
}

function imuSection() {
  const s = section("IMU"), stack = el("div", { class: "stack" }), r = data.imu.residuals, b = data.imu.biases, legend = AXES.map((n, i) => [n, color("axis" + i)]);
  s.append(stack);
  for (const [title, key] of [["Residuals of the gyroscope", "gyro"], ["Residuals of the accelerometer", "accel"]]) {
    const box = card(title, "in standard deviations of the noise given", legend);
    stack.append(box);
    new TimeChart(box, { unit: "σ", height: 170, series: AXES.map((n, i) => ({ name: n, color: color("axis" + i), t: r.t, y: r[`${key}_${n}`], width: 0.9 })) });
  }
  distribution(stack, "Distribution", [["gyroscope", color("run0"), AXES.flatMap(n => r["gyro_" + n])], ["accelerometer", color("run1"), AXES.flatMap(n => r["accel_" + n])]]);
  for (const [title, key, unit] of [["Gyroscope's bias", "bg", "rad/s"], ["Accelerometer's bias", "ba", "m/s²"]]) {
    const box = card(title, "shaded: 3σ", legend);
    stack.append(box);
    new TimeChart(box, { unit, height: 170, series: AXES.map((n, i) => ({ name: n, color: color("axis" + i), t: b.t, y: b[`${key}_${n}`] })),
      bands: AXES.map((n, i) => ({ color: color("axis" + i), t: b.t, low: b[`${key}_${n}`].map((v, k) => v - 3 * b[`s${key}_${n}`][k]), high: b[`${key}_${n}`].map((v, k) => v + 3 * b[`s${key}_${n}`][k]) })) });
  }
}

function correlations(parent, title, parameters, rows) {
  const names = parameters.map(p => p[0]), pairs = [];
  rows.forEach((row, i) => row.forEach((value, j) => { if (j < i && Math.abs(value) >= 0.9) pairs.push([names[i], names[j], value]); }));
  pairs.sort((a, b) => Math.abs(b[2]) - Math.abs(a[2]));
  const box = card(title, "blue: together, orange: against one another", []);
  new MatrixChart(box, { names, rows });
  parent.append(box);
  const list = card("Parameters that trade off", pairs.length ? "correlations of 0.9 and more: their own deviations are large, what they do together is known better" : "");
  list.append(pairs.length ? table(["", "", "correlation"], pairs.slice(0, 20).map(([a, b, v]) => [a, b, v.toFixed(3).replace("-", "−")]), 2) : el("p", { class: "note" }, "No correlation of 0.9 or more."));
  parent.append(list);
}

function parameters() {
  const s = section("Parameters"), stack = el("div", { class: "stack" });
  s.append(stack);
  const groups = [["Cameras", data.parameters, data.correlation], ["Cameras on the IMU", data.imu_parameters, data.imu_correlation]].filter(g => g[1]);
  for (const [title, values, rows] of groups) {
    const box = card(title, title === "Cameras" ? "p, r: T_camN_cam0" : "p, theta: T_imu_camN");
    box.append(table(["parameter", "value", "σ", "unit"], values.map(([name, value, sigma, unit]) => [name, value.toPrecision(7).replace("-", "−"), number(sigma, 2), unit])));
    stack.append(box);
    const grid = el("div", { class: "grid two" });
    stack.append(grid);
    correlations(grid, `Correlations: ${title.toLowerCase().replace("imu", "IMU")}`, values, rows);
  }
}

function models() {
  const tried = data.cameras.filter(c => c.held_out);
  if (!tried.length) return;
  const s = section("Lens models"), box = card("Held-out error", "px, of views that the model was not fitted to"), names = [...new Set(tried.flatMap(c => c.held_out.map(([m]) => m)))];
  box.append(table(["", ...tried.map(c => c.name)], names.map(m => [m, ...tried.map(c => number((c.held_out.find(([n]) => n === m) || [])[1], 4))])));
  s.append(box);
}

document.getElementById("lead").textContent = `fbvins ${data.version}; ${data.stamps_used} of ${data.stamps} stamps used, noise of a corner ${number(data.noise_px)} px. Drag over a plot to zoom all of them, double-click for the whole run.`;
const first = section("Key figures");
keyFigures(first);
weakness(section("What to record"));
for (const c of data.cameras) {
  const s = section(`${c.name}: ${c.model}`);
  whereInTheImage(s, c);
  byDistance(s, c);
}
overTime();
if (data.imu) imuSection();
models();
parameters();
