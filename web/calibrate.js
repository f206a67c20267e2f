// SPDX-License-Identifier: Apache-2.0
// The page of `fbvins calibrate --source --web`: live images with corners and coverage, what to do next, and progress.
import { PictureDecoder } from "./picture_decoder.js";
import { Stream } from "./stream.js";

const element = id => document.getElementById(id);
const views = [];  // one CameraPanel a camera

function set(id, text) {
  const place = element(id);
  if (place.textContent !== text) place.textContent = text;
}

function add(parent, tag, name, text = "") {
  const made = parent.appendChild(document.createElement(tag));
  made.className = name;
  made.textContent = text;
  return made;
}

/// A camera's newest image; cells of it in which no corner has been are darkened.
class CameraPanel {
  constructor(index) {
    const panel = add(element("cameras"), "section", "panel");
    panel.dataset.camera = index;
    const bar = add(panel, "div", "bar");
    add(bar, "h2", "", `cam${index}`);
    this.words = add(bar, "small", "", "no image yet");
    this.index = index;
    this.canvas = panel.appendChild(document.createElement("canvas"));
    this.canvas.setAttribute("role", "img");
    this.pen = this.canvas.getContext("2d");
    this.decoder = new PictureDecoder((picture, message) => {
      [this.picture, this.message] = [picture, message];
      this.draw();
    });
  }

  show(message) { this.decoder.decode(message); }

  cover(camera) {
    this.coverage = camera;
    const seen = camera.corners.filter(corners => corners > 0).length;
    this.words.textContent = `${camera.views} views, ${Math.round(100 * seen / Math.max(1, camera.corners.length))} % of the image seen`;
    this.draw();
  }

  draw() {
    const { canvas, pen, message, coverage } = this;
    const width = message?.width_px ?? coverage?.width_px, height = message?.height_px ?? coverage?.height_px;
    if (!width) return;
    canvas.width = width;
    canvas.height = height;
    if (this.picture) pen.drawImage(this.picture, 0, 0, width, height);
    if (coverage?.corners.length) {
      const w = width / coverage.columns, h = height / coverage.rows;
      pen.fillStyle = "#d8623c66";
      coverage.corners.forEach((corners, cell) => {
        if (corners === 0) pen.fillRect((cell % coverage.columns) * w, Math.floor(cell / coverage.columns) * h, w, h);
      });
    }
    if (!message) return;
    const radius = Math.max(2.5, width / 200);
    pen.fillStyle = "#54e08f";
    for (let i = 0; i < message.count; ++i) {
      pen.beginPath();
      pen.arc(message.numbers[4 * i], message.numbers[4 * i + 1], radius, 0, 2 * Math.PI);
      pen.fill();
    }
    canvas.dataset.corners = message.count;
    canvas.setAttribute("aria-label", `Newest image of cam${this.index} with ${message.count} corners of the board`);
  }
}

function panel(index) {
  while (views.length <= index) views.push(new CameraPanel(views.length));
  return views[index];
}

const digits = x => !Number.isFinite(x) ? "–" : x >= 100 ? x.toFixed(0) : x.toPrecision(2);

function showParts(parts) {
  const list = element("parts");
  element("nothing").hidden = parts.length > 0;
  while (list.children.length > parts.length) list.lastChild.remove();
  while (list.children.length < parts.length) {
    const item = add(list, "li", "");
    add(item, "span", "name");
    add(item, "span", "amount");
    const meter = item.appendChild(document.createElement("meter"));
    [meter.min, meter.max, meter.low, meter.high, meter.optimum] = [0, 1, 0.5, 0.999, 1];
  }
  parts.forEach((part, i) => {
    const [name, figures, meter] = list.children[i].children;
    name.textContent = part.what;
    figures.textContent = `${digits(part.sigma)} of ${digits(part.aim)} ${part.unit}`;
    meter.value = Number.isFinite(part.sigma) ? Math.min(1, part.aim / Math.max(part.sigma, 1e-12)) : 0;
    meter.title = `${part.what}: one standard deviation ${figures.textContent}`;
    list.children[i].classList.toggle("reached", part.sigma <= part.aim);
  });
}

const sentence = text => text ? text[0].toUpperCase() + text.slice(1) + (/[.!?]$/.test(text) ? "" : ".") : "";

const on = {
  hello(message) {
    document.title = `Calibration: ${message.source}`;
    set("source", message.source);
    element("source").title = message.program;
  },
  calibration(message) {
    element("next").dataset.stage = message.stage;
    set("action", sentence(message.action) || "Waiting for images.");
    set("reason", sentence(message.reason));
    set("duration", `${message.duration_s.toFixed(0)} s`);
    set("counts", `${message.images} images, ${message.readings} readings${message.noise_px ? `, corners to ${message.noise_px.toFixed(2)} px` : ""}`);
    showParts(message.parts);
    message.cameras.forEach((camera, k) => panel(k).cover(camera));
  },
  image(message) { panel(message.camera).show(message); },
};

function note(text) {
  const place = element("note");
  place.textContent = text;
  place.hidden = !text;
}

new Stream({
  message: message => on[message.type]?.(message),
  open: () => note(""),
  lost: () => note(element("next").dataset.stage === "recording" ? "The connection is lost; it is tried again." : "The program has ended."),
});
