// SPDX-License-Identifier: Apache-2.0
// Three small plots over the time of the flight.
import uPlot from "./uPlot.esm.js";

const MOST_POINTS = 6000;
const HEIGHT_PX = 150;
const REDRAW_MS = 250;
const AXIS = { stroke: "#93a4af", grid: { stroke: "#1f2a31", width: 1 }, ticks: { stroke: "#26333c", width: 1 }, font: "11px system-ui", size: 52 };

const number = digits => (plot, value) => value == null ? "–" : value.toFixed(digits);

function series(label, colour, digits, more = {}) {
  return { label, stroke: colour, width: 1.5, value: number(digits), points: { show: false }, ...more };
}

const PLOTS = {
  latency: [series("latency, ms", "#63b8f2", 1), series("dropped images", "#f0716c", 0, { scale: "dropped" })],
  sigma: [series("1σ, cm", "#e8b64f", 2)],
  features: [series("features", "#54c98f", 0), series("landmarks", "#ffc66b", 0)],
};

export class Plots {
  constructor() {
    this.columns = [[], [], [], [], [], []];  // t [s], latency [ms], dropped, features, landmarks, sigma [m]
    this.plots = {};
    for (const [name, list] of Object.entries(PLOTS)) {
      const place = document.getElementById(`plot-${name}`);
      const axes = [{ ...AXIS, size: 30, values: (plot, ticks) => ticks.map(t => `${+t.toFixed(1)} s`) }, AXIS];
      if (name === "latency") axes.push({ ...AXIS, side: 1, scale: "dropped", grid: { show: false }, size: 34 });
      const fromZero = { range: (plot, low, high) => [0, Math.max(high || 0, 1e-3) * 1.1] };
      this.plots[name] = new uPlot({
        width: place.clientWidth || 300, height: HEIGHT_PX, axes, cursor: { y: false },
        scales: { x: { time: false }, y: fromZero, dropped: { range: (plot, low, high) => [0, Math.max(high || 0, 5) * 1.1] } },
        series: [{ label: "t, s", value: number(1) }, ...list],
      }, this.data(name), place);
      new ResizeObserver(() => this.plots[name].setSize({ width: place.clientWidth, height: HEIGHT_PX })).observe(place);
    }
  }

  data(name) {
    const [t, latency, dropped, features, landmarks, sigma] = this.columns;
    return { latency: [t, latency, dropped], sigma: [t, sigma.map(s => s == null ? null : 100 * s)], features: [t, features, landmarks] }[name];
  }

  clear() { this.columns = this.columns.map(() => []); this.changed(); }

  /// [t_s, latency_ms, dropped, features, landmarks, sigma_m]; null where not known.
  add(row) {
    const times = this.columns[0];
    if (times.length && row[0] <= times.at(-1)) return;
    if (times.length >= MOST_POINTS) this.columns = this.columns.map(column => column.filter((_, i) => i % 2 === 0));
    row.forEach((value, i) => this.columns[i].push(value ?? null));
    this.changed();
  }

  changed() {
    this.timer ??= setTimeout(() => {
      this.timer = undefined;
      for (const [name, plot] of Object.entries(this.plots)) {
        plot.setData(this.data(name));
        if (!(plot.cursor.left >= 0)) plot.setLegend({ idx: this.columns[0].length - 1 });  // the newest values, unless the cursor is on the plot
      }
    }, REDRAW_MS);
  }
}
