// SPDX-License-Identifier: Apache-2.0
// The camera's newest image, with its features coloured by age or by depth.
import { ageColour, depthColour, gradient, OLDEST_IMAGES, NEAREST_M, FARTHEST_M } from "./colours.js";

const element = id => document.getElementById(id);

export class CameraView {
  constructor() {
    this.canvas = element("image");
    this.pen = this.canvas.getContext("2d");
    this.by = "age";
    for (const by of ["age", "depth"]) element(`by-${by}`).addEventListener("click", () => this.colourBy(by));
    this.colourBy("age");
  }

  colourBy(by) {
    this.by = by;
    for (const other of ["age", "depth"]) element(`by-${other}`).setAttribute("aria-pressed", String(other === by));
    element("scale-bar").style.background = gradient(by);
    element("scale-low").textContent = by === "age" ? "new" : `${NEAREST_M} m`;
    element("scale-high").textContent = by === "age" ? `${OLDEST_IMAGES} images` : `${FARTHEST_M} m`;
    this.draw();
  }

  /// Decodes one image at a time; meanwhile only the newest one waits.
  async show(message) {
    this.waiting = message;
    if (this.decoding) return;
    this.decoding = true;
    while (this.waiting) {
      const newest = this.waiting;
      this.waiting = undefined;
      const picture = await createImageBitmap(new Blob([newest.rest], { type: "image/jpeg" })).catch(() => undefined);
      if (!picture) continue;
      this.picture = picture;
      this.features = newest;
      this.draw();
    }
    this.decoding = false;
  }

  clear() {
    this.picture = this.waiting = undefined;
    this.pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
  }

  draw() {
    if (!this.picture) return;
    const { canvas, pen, features } = this;
    canvas.width = features.width_px;
    canvas.height = features.height_px;
    pen.drawImage(this.picture, 0, 0, canvas.width, canvas.height);
    const radius = Math.max(3, canvas.width / 170);
    pen.lineWidth = radius / 2;
    for (let i = 0; i < features.count; ++i) {
      const [u, v, age, depth] = features.numbers.subarray(4 * i, 4 * i + 4);
      pen.strokeStyle = this.by === "age" ? ageColour(age) : depthColour(depth);
      pen.beginPath();
      pen.arc(u, v, radius, 0, 2 * Math.PI);
      pen.stroke();
    }
    canvas.dataset.features = features.count;
    canvas.setAttribute("aria-label", `Newest camera image with ${features.count} features, coloured by ${this.by}`);
  }
}
