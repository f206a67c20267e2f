// SPDX-License-Identifier: Apache-2.0
// The report of runs, drawn with fbvins/page/charts.js.
data.runs.forEach((r, i) => { r.color = runColor(i); r.label = `${r.dataset} · ${r.frontend}`; });
const names = new Set(data.runs.map(r => r.label));
if (names.size < data.runs.length) for (const r of data.runs) r.label = r.name;
document.getElementById("lead").textContent = data.runs.length
  ? `${data.runs.length === 1 ? "One run" : data.runs.length + " runs"}, fbvins ${[...new Set(data.runs.map(r => r.version))].join(", ")}. Drag over a plot to zoom all of them, double-click for the whole run; drag the 3D view to rotate it.`
  : "";
const HEALTH = [["good", "good"], ["degraded", "degraded"], ["lost", "lost"], ["not started", "initialising"]];
/** Only the states that a run was in. */
function healthLegend(runs) {
  const seen = new Set(runs.flatMap(r => r.health.map(([, , state]) => state)));
  return HEALTH.filter(([, state]) => seen.has(state)).map(([name, state]) => [name, color(state), true]);
}

function keyFigures(run) {
  const result = run.summary.result, timing = run.summary.timing, box = card(run.label), mark = el("span", { class: "swatch" });
  mark.style.background = run.color;
  box.firstChild.replaceWith(el("div", { class: "key" }, mark, el("h3", {}, run.label)));
  const list = el("div", { class: "figures" });
  if (run.table) list.append(figure(...meters(run.table.absolute_m.rmse), "position error, RMSE"), figure(...meters(run.table.absolute_m.max), "largest error"));
  list.append(figure((100 * result.coverage.share).toFixed(1), "%", "images with a pose"));
  list.append(figure(String(result.restarts), "", result.restarts === 1 ? "restart" : "restarts"));
  list.append(figure(number(timing.total_ms.mean), "ms", "CPU per stereo frame"));
  if (run.path_m) list.append(figure(number(run.path_m), "m", "path length"));
  box.append(list);
  return box;
}

function trajectories(parent, runs) {
  const withErrors = runs.filter(r => r.errors);
  const paths = withErrors.length
    ? [{ name: "truth", color: color("truth"), x: withErrors[0].errors.truth_x, y: withErrors[0].errors.truth_y, z: withErrors[0].errors.truth_z, width: 4, opacity: .55 },
       ...withErrors.map(r => ({ name: r.label, color: r.color, x: r.errors.aligned_x, y: r.errors.aligned_y, z: r.errors.aligned_z, mark: true }))]
    : runs.map(r => ({ name: r.label, color: r.color, x: r.odometry.p_x, y: r.odometry.p_y, z: r.odometry.p_z, mark: true }));
  const legend = paths.map(p => [p.name, p.color]), grid = el("div", { class: "grid" });
  for (const [title, view] of [["From above", "top"], ["From the side", "side"], ["3D", "3d"]]) {
    const box = card(title, "", view === "top" ? legend : null);
    grid.append(box);
    new SpaceChart(box, { paths, view });
  }
  parent.append(grid);
}

function errorsOverTime(parent, runs) {
  const box = card("Position error", "distance to the ground truth after SE3 alignment, and health", [...runs.map(r => [r.label, r.color]), ...healthLegend(runs)]);
  parent.append(box);
  new TimeChart(box, {
    unit: "m", height: 250, zero: true,
    series: runs.filter(r => r.errors).map(r => ({ name: r.label, color: r.color, t: r.errors.t, y: r.errors.absolute_m })),
    ribbons: runs.map(r => ({ stretches: r.health, label: r.frontend, color: r.color })),
  });
  const grid = el("div", { class: "grid two" }), angle = card("Orientation error", "angle to the ground truth after alignment");
  grid.append(angle);
  new TimeChart(angle, { unit: "°", zero: true, series: runs.filter(r => r.errors).map(r => ({ name: r.label, color: r.color, t: r.errors.t, y: r.errors.absolute_deg })) });
  const share = card("Distribution of the position error", "cumulative share of the poses; dashed: RMSE");
  grid.append(share);
  new XYChart(share, {
    xUnit: "m", yName: "share of the poses", yMax: 1, yFormat: v => Math.round(100 * v) + " %",
    series: runs.filter(r => r.errors).map(r => { const x = r.errors.absolute_m.filter(finite).sort((a, b) => a - b); return { name: r.label, color: r.color, x: [0, ...x], y: [0, ...x.map((_, i) => (i + 1) / x.length)] }; }),
    marks: runs.filter(r => r.table).map(r => ({ x: r.table.absolute_m.rmse, color: r.color })),
  });
  parent.append(grid);
}

/** Errors of three axes with the estimator's 3-sigma bounds. */
function withBounds(parent, run, title, unit, error, sigma, note) {
  if (!run.errors || !run.errors[error + "_x"]) return;
  const e = run.errors, box = card(title, note, ["x", "y", "z"].map((n, i) => [n, color("axis" + i)]));
  parent.append(box);
  const series = [], bands = [];
  ["x", "y", "z"].forEach((axis, i) => {
    series.push({ name: axis, color: color("axis" + i), t: e.t, y: e[`${error}_${axis}`], width: 1.25 });
    const s = e[`${sigma}_${axis}`];
    if (s) bands.push({ color: color("axis" + i), t: e.t, low: s.map(v => finite(v) ? -3 * v : null), high: s.map(v => finite(v) ? 3 * v : null) });
  });
  new TimeChart(box, { unit, series, bands, height: 170, quantile: 0.998 });
}

const STAGES = ["pyramid", "track", "stereo", "detect", "geometry", "boost", "prepare", "solve", "marginalise"];
function totalTime(run) { return run.timing.t.map((_, i) => STAGES.reduce((sum, s) => sum + (run.timing[s] && finite(run.timing[s][i]) ? run.timing[s][i] : 0), 0)); }

function insideOfRun(parent, run) {
  const column = el("div", { class: "stack" });
  const head = el("div", { class: "key" }), mark = el("span", { class: "swatch" });
  mark.style.background = run.color;
  head.style.marginBottom = "0";
  head.append(mark, el("h3", {}, run.label));
  column.append(head);
  parent.append(column);
  withBounds(column, run, "Drift", "m", "drift", "sp", "aligned at the first pose; shaded: 3σ");
  withBounds(column, run, "Velocity error", "m/s", "dv", "sv");
  withBounds(column, run, "Gyro bias error", "rad/s", "dbg", "sbg");
  withBounds(column, run, "Accelerometer bias error", "m/s²", "dba", "sba");
  if (!run.errors || !run.errors.dbg_x) {
    const bias = card("Gyro bias", "estimated; shaded: 3σ", ["x", "y", "z"].map((n, i) => [n, color("axis" + i)]));
    column.append(bias);
    const o = run.odometry, series = [], bands = [];
    ["x", "y", "z"].forEach((axis, i) => {
      series.push({ name: axis, color: color("axis" + i), t: o.t, y: o["bg_" + axis], width: 1.25 });
      const b = o["bg_" + axis], s = o["sbg_" + axis];
      bands.push({ color: color("axis" + i), t: o.t, low: b.map((v, k) => finite(v) ? v - 3 * s[k] : null), high: b.map((v, k) => finite(v) ? v + 3 * s[k] : null) });
    });
    new TimeChart(bias, { unit: "rad/s", series, bands, height: 170, quantile: 0.995 });
  }
  const f = run.features, counts = [["tracked", "tracked", "run0"], ["stereo", "seen by both cameras", "run2"], ["detected", "new", "run3"], ["outliers", "outliers", "lost"]].filter(([k]) => f[k] && f[k].some(v => v > 0));
  const features = card("Features", "", counts.map(([, n, c]) => [n, color(c)]));
  column.append(features);
  new TimeChart(features, { quantity: "count", zero: true, height: 170, series: counts.map(([k, n, c]) => ({ name: n, color: color(c), t: f.t, y: f[k], width: 1.25 })) });
  const shown = STAGES.filter(s => run.timing[s] && run.timing[s].some(v => v > 0));
  const palette = s => color("run" + STAGES.indexOf(s)), time = card("Time by stage", "CPU", shown.map(s => [s, palette(s)]));
  column.append(time);
  new TimeChart(time, { unit: "ms", zero: true, height: 170, quantile: 0.998, series: shown.map(s => ({ name: s, color: palette(s), t: run.timing.t, y: run.timing[s], width: 1.1 })) });
}

/** The additional part of fbvins fly: the paper's figure 3 and its table, errors and motor commands. */
const MODES = { waiting: "initialising", mission: "good", holding: "degraded", landing: "run2", descending: "lost", landed: "initialising" };
function flightSection(run) {
  const f = run.flight, c = f.curves, parent = section("Flight: " + run.label), sum = f.summary;
  const three = [["truth", "true_p", "truth", 3.5], ["estimate", "estimate_p", "run0", 1.4], ["setpoint", "setpoint_p", "run3", 1.2]].filter(([, k]) => c[k + "_x"]);
  const airborne = t => { const m = f.modes.find(([from, to]) => t >= from && t <= to); return m && m[2] !== "waiting" && m[2] !== "landed"; };
  const flown = k => c[k].map((v, i) => airborne(c.t[i]) ? v : null);
  const legend = three.map(([name, , col]) => [name, color(col)]), grid = el("div", { class: "grid" });
  const paths = three.map(([name, k, col, width]) => ({ name, color: color(col), x: flown(k + "_x"), y: flown(k + "_y"), z: flown(k + "_z"), width, opacity: name === "truth" ? .55 : 1, mark: name === "truth" }));
  for (const [title, view] of [["From above", "top"], ["From the side", "side"], ["3D", "3d"]]) {
    const box = card(title, "", view === "top" ? legend : null);
    grid.append(box);
    new SpaceChart(box, { paths, view });
  }
  parent.append(grid);
  if (sum.axes_m && sum.arrived) {
    const cm = v => (100 * v).toFixed(2) + " cm", box = card("Fixed-point flight", "as the paper's Tables 2 and 3");
    box.style.marginTop = "16px";
    box.append(table(["", "starting point", "ending point", "difference", "expected", "axial error"],
      Object.entries(sum.axes_m).map(([axis, a]) => [axis.toUpperCase() + "-axis", cm(a.start), cm(a.end), cm(a.difference), cm(a.expected), cm(a.error)])));
    parent.append(box);
  }
  const stack = el("div", { class: "stack", style: "margin-top:16px" });
  parent.append(stack);
  const ribbons = [{ stretches: f.modes.map(([from, to, mode, reason]) => [from, to, mode, reason, MODES[mode] || "lost"]), label: "mode", color: color("soft") },
                   { stretches: run.health, label: "health", color: color("soft") }];
  ["x", "y", "z"].forEach((axis, i) => {
    const box = card(`Position ${axis}`, i === 0 ? "in the mission's frame L" : "", i === 0 ? legend : null);
    stack.append(box);
    new TimeChart(box, { unit: "m", height: 170, ribbons: i === 2 ? ribbons : [], series: three.map(([name, k, col, width]) => ({ name, color: color(col), t: c.t, y: flown(`${k}_${axis}`), width: name === "truth" ? 2.5 : width })) });
  });
  const pairs = [["Estimate minus truth", "estimate_p", "true_p"], ["Truth minus setpoint", "true_p", "setpoint_p"]];
  for (const [title, a, b] of pairs) {
    const box = card(title, "", ["x", "y", "z"].map((n, i) => [n, color("axis" + i)]));
    stack.append(box);
    new TimeChart(box, { unit: "m", height: 150, quantile: 0.99, series: ["x", "y", "z"].map((n, i) => {
      const u = flown(`${a}_${n}`), v = flown(`${b}_${n}`);
      return { name: n, color: color("axis" + i), t: c.t, y: u.map((x, k) => finite(x) && finite(v[k]) ? x - v[k] : null), width: 1.25 };
    }) });
  }
  const effort = card("Control effort", "commands of the four motors", [1, 2, 3, 4].filter(i => c["command_" + i]).map(i => ["motor " + i, runColor(i - 1)]));
  stack.append(effort);
  new TimeChart(effort, { quantity: "share of full", height: 170, zero: true, quantile: 0.998, series: [1, 2, 3, 4].filter(i => c["command_" + i]).map(i => ({ name: "motor " + i, color: runColor(i - 1), t: c.t, y: c["command_" + i], width: 1 })) });
}

function benchSection(bench) {
  for (const t of bench.tables || []) {
    const s = section(t.title);
    if (t.note) s.append(el("p", { class: "note", style: "margin:-6px 0 12px" }, t.note));
    const box = el("div", { class: "card" });
    box.append(table(t.head, t.rows, t.texts || 1));
    s.append(box);
  }
  if (bench.consistency && bench.consistency.length) {
    const s = section("Consistency (NEES)");
    s.append(el("p", { class: "note", style: "margin:-6px 0 12px" }, "Normalised estimation error squared, mean over the flights at each instant; 3 is consistent, more is overconfident. Dashed: 95 % bounds of the mean of that many flights (chi-square)."));
    const grid = el("div", { class: "grid two" });
    s.append(grid);
    const kinds = [["position", "run0"], ["orientation", "run1"], ["velocity", "run2"], ["gyro_bias", "run3"], ["accel_bias", "run4"]];
    for (const c of bench.consistency) {
      const shown = kinds.filter(([k]) => c[k]), box = card(c.name, `${c.flights} flights`, shown.map(([k, col]) => [k.replace("_", " "), color(col)]));
      grid.append(box);
      const bound = v => ({ name: "bound", color: color("faint"), t: [c.t[0], c.t[c.t.length - 1]], y: [v, v], dash: "5 4", width: 1 });
      new TimeChart(box, { quantity: "NEES", zero: true, height: 190, quantile: 0.99, series: [...shown.map(([k, col]) => ({ name: k.replace("_", " "), color: color(col), t: c.t, y: c[k] })), bound(c.low), bound(c.high)] });
    }
  }
}

if (data.bench) benchSection(data.bench);
const datasets = [...new Set(data.runs.map(r => r.dataset))];
if (data.runs.length) {
  const s = section("Key figures"), grid = el("div", { class: "grid" });
  s.append(grid);
  for (const r of data.runs) grid.append(keyFigures(r));
  if (data.runs.some(r => r.table)) {
    const box = card("Absolute error of the position", "metres, aligned with SE3: the paper's Table 1");
    box.style.marginTop = "16px";
    box.id = "table1";
    box.append(errorTable(data.runs, "absolute_m"));
    s.append(box);
    const more = el("div", { class: "grid two", style: "margin-top:16px" });
    for (const [title, note, q] of [["Relative error over a metre", "metres", "per_metre_m"], ["Absolute error of the orientation", "degrees", "absolute_deg"]]) {
      const b = card(title, note);
      b.append(errorTable(data.runs, q));
      more.append(b);
    }
    s.append(more);
  }
}
for (const r of data.runs) if (r.flight) flightSection(r);
for (const name of datasets) {
  const runs = data.runs.filter(r => r.dataset === name);
  const s = section(datasets.length > 1 ? name : "Trajectory and errors");
  const all = el("div", { class: "stack" });
  s.append(all);
  trajectories(all, runs);
  if (runs.some(r => r.errors)) errorsOverTime(all, runs);
  const inside = section(datasets.length > 1 ? `${name}: inside the estimator` : "Inside the estimator"), columns = el("div", { class: "grid two" });
  inside.append(columns);
  for (const r of runs) insideOfRun(columns, r);
}
if (data.runs.length) {
  const s = section("Time and configuration"), grid = el("div", { class: "grid two" });
  s.append(grid);
  const times = data.runs.map(totalTime), limit = Math.max(...times.map(t => [...t].sort((a, b) => a - b)[Math.floor(0.99 * (t.length - 1))] || 1)) * 1.25;
  const box = card("CPU time per stereo frame", "share of the frames", data.runs.map(r => [r.label, r.color]));
  grid.append(box);
  new XYChart(box, { xUnit: "ms", yName: "share of the frames", bars: true, xMax: limit, yFormat: v => Math.round(100 * v) + " %", series: data.runs.map((r, i) => ({ name: r.label, color: r.color, ...histogram(times[i], limit) })) });
  const nees = data.runs.filter(r => r.nees && Object.keys(r.nees).length);
  if (nees.length) {
    const kinds = [...new Set(nees.flatMap(r => Object.keys(r.nees)))], consistency = card("Consistency (NEES)", "normalised estimation error squared, mean over the run; 3 is consistent, more is overconfident");
    consistency.append(table(["", ...kinds], nees.map(r => [{ text: r.label, swatch: r.color }, ...kinds.map(k => number(r.nees[k]))])));
    grid.append(consistency);
  }
  for (const r of data.runs) {
    const details = el("details", {}, el("summary", {}, `Effective configuration of ${r.label}`), el("pre", {}, r.config));
    s.append(el("div", { class: "card", style: "margin-top:16px" }, details));
  }
}
