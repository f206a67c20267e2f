// SPDX-License-Identifier: Apache-2.0
// The newest image of a camera, with its features coloured by age or by depth. Where there are several cameras, one is chosen.
import { ageColour, depthColour, gradient, OLDEST_IMAGES, NEAREST_M, FARTHEST_M } from "./colours.js";
import { PictureDecoder } from "./picture_decoder.js";

const element = id => document.getElementById(id);

export class CameraView {
  constructor() {
    this.canvas = element("image");
    this.pen = this.canvas.getContext("2d");
    this.by = "age";
    this.camera = 0;
    this.newest = {};  // messages, by camera
    this.decoder = new PictureDecoder((picture, message) => {
      if (message.camera !== this.camera) return;  // another one was chosen meanwhile
      [this.picture, this.features] = [picture, message];
      this.draw();
    });
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

  /// Of the chosen camera; the newest image of each other one is kept until that is chosen.
  show(message) {
    if (!(message.camera in this.newest)) this.offer(message.camera);
    this.newest[message.camera] = message;
    if (message.camera === this.camera) this.decoder.decode(message);
  }

  /// A button for each camera, from the second one on.
  offer(camera) {
    const cameras = [...Object.keys(this.newest).map(Number), camera].sort((a, b) => a - b);
    if (cameras.length < 2) {
      if (element("camera-choice").hidden) this.camera = camera;  // what was chosen before a replay jumped stays
      return;
    }
    element("camera-choice").hidden = false;
    element("camera-choice").replaceChildren(...cameras.map(number => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = number;
      button.setAttribute("aria-label", `Camera ${number}`);
      button.dataset.camera = number;
      button.addEventListener("click", () => this.choose(number));
      return button;
    }));
    this.choose(this.camera);
  }

  choose(camera) {
    this.camera = camera;
    element("camera-title").textContent = `Camera ${camera}`;
    for (const button of element("camera-choice").children)
      button.setAttribute("aria-pressed", String(Number(button.dataset.camera) === camera));
    if (this.newest[camera]) this.decoder.decode(this.newest[camera]);
  }

  clear() {
    this.picture = undefined;
    this.decoder.clear();
    this.newest = {};
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
    canvas.dataset.camera = features.camera;
    canvas.setAttribute("aria-label", `Newest image of camera ${features.camera} with ${features.count} features, coloured by ${this.by}`);
  }
}
