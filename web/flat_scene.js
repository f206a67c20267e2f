// SPDX-License-Identifier: Apache-2.0
// Stands in for the scene where the browser has no WebGL: the path and the newest pose from above, on a canvas of two dimensions.
import { HEALTH } from "./colours.js";

const MOST_PATH = 40_000;

export class FlatScene {
  constructor(canvas, onGrid) {
    this.canvas = canvas;
    this.onGrid = onGrid;
    this.pen = canvas.getContext("2d");
    this.whole = [];
    for (const name of ["showKeyframes", "showMapped", "showPoints", "fit"]) this[name] = () => {};
    new ResizeObserver(() => this.wake()).observe(canvas);
  }
  clear() { this.path = []; this.pose = undefined; this.wake(); }
  addPath([x, y], reset, health) {
    this.path.push({ x, y, reset, colour: HEALTH[health] ?? HEALTH.none });
    if (this.path.length > MOST_PATH) this.path.splice(0, MOST_PATH / 2);
  }
  pathChanged() { this.wake(); }
  showWhole(points) { this.whole = points.map(([, x, y, , reset]) => ({ x, y, reset, colour: "#3d4d58" })); this.wake(); }
  showPose([x, y], [w, qx, qy, z]) {
    this.pose = { x, y, ahead: [1 - 2 * (qy * qy + z * z), 2 * (qx * qy + w * z)] };  // the body's x axis, from above
    this.wake();
  }

  wake() { this.drawing ??= requestAnimationFrame(() => { this.drawing = undefined; this.draw(); }); }
  draw() {
    const { canvas, pen } = this, ratio = Math.min(devicePixelRatio, 2);
    const width = canvas.width = canvas.clientWidth * ratio, height = canvas.height = canvas.clientHeight * ratio;
    pen.fillStyle = "#10171b";
    pen.fillRect(0, 0, width, height);
    const all = [...this.whole, ...this.path, ...(this.pose ? [this.pose] : [])];
    if (all.length === 0 || width === 0) return;
    const ends = axis => all.reduce(([low, high], point) => [Math.min(low, point[axis]), Math.max(high, point[axis])], [Infinity, -Infinity]);
    const [left, right] = ends("x"), [near, far] = ends("y");
    const scale = 0.85 * Math.min(width / Math.max(right - left, 2), height / Math.max(far - near, 2));
    const place = ({ x, y }) => [width / 2 + scale * (x - (left + right) / 2), height / 2 - scale * (y - (near + far) / 2)];
    const cell = 10 ** Math.max(0, Math.ceil(Math.log10(20 * ratio / scale)));
    if (cell !== this.cell) this.onGrid(this.cell = cell);
    this.drawGrid(place, scale, cell, [left, right, near, far]);
    for (const points of [this.whole, this.path]) this.drawPath(points.map(point => ({ ...point, at: place(point) })), ratio);
    if (!this.pose) return;
    const [x, y] = place(this.pose), [ahead, aside] = this.pose.ahead;
    pen.fillStyle = pen.strokeStyle = "#ffffff";
    pen.beginPath();
    pen.arc(x, y, 4 * ratio, 0, 2 * Math.PI);
    pen.fill();
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(x + 16 * ratio * ahead, y - 16 * ratio * aside);
    pen.stroke();
  }
  drawPath(points, ratio) {
    this.pen.lineWidth = 1.5 * ratio;
    for (let i = 1; i < points.length; ++i) {
      if (points[i].reset !== points[i - 1].reset) continue;
      this.pen.strokeStyle = points[i].colour;
      this.pen.beginPath();
      this.pen.moveTo(...points[i - 1].at);
      this.pen.lineTo(...points[i].at);
      this.pen.stroke();
    }
  }
  drawGrid(place, scale, cell, [left, right, near, far]) {
    const reach = Math.max(this.canvas.width, this.canvas.height) / scale;
    this.pen.strokeStyle = "#2a3840";
    this.pen.lineWidth = 1;
    this.pen.beginPath();
    for (let k = Math.floor((left - reach) / cell); k * cell <= right + reach; ++k) {
      this.pen.moveTo(place({ x: k * cell, y: 0 })[0], 0);
      this.pen.lineTo(place({ x: k * cell, y: 0 })[0], this.canvas.height);
    }
    for (let k = Math.floor((near - reach) / cell); k * cell <= far + reach; ++k) {
      this.pen.moveTo(0, place({ x: 0, y: k * cell })[1]);
      this.pen.lineTo(this.canvas.width, place({ x: 0, y: k * cell })[1]);
    }
    this.pen.stroke();
  }
}
