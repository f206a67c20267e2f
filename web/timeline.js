// SPDX-License-Identifier: Apache-2.0
// Health since the start as a coloured strip, marks as flags, and the newest changes as text.
import { HEALTH } from "./colours.js";
import { STATES, clock, reasonWords } from "./words.js";

const MOST_CHANGES = 4000, LISTED = 6;

export class Timeline {
  constructor(canvas, list) {
    this.canvas = canvas;
    this.list = list;
    this.clear();
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  clear() {
    this.changes = [];  // { t_s, state, reason }
    this.marks = [];    // { t_s, text }
    this.end_s = 0;
    this.listChanges();
    this.draw();
  }

  add(t_s, state, reason) {
    this.end_s = Math.max(this.end_s, t_s);
    const last = this.changes.at(-1);
    if (last?.state !== state || last?.reason !== reason) {
      if (this.changes.length >= MOST_CHANGES) this.changes.shift();
      this.changes.push({ t_s, state, reason });
      this.listChanges();
    }
    this.drawSoon();
  }
  addMark(t_s, text) {
    this.marks.push({ t_s, text });
    this.end_s = Math.max(this.end_s, t_s);
    this.listChanges();
    this.drawSoon();
  }

  /// The health state at this time.
  stateAt(t_s) {
    let low = 0, high = this.changes.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.changes[middle].t_s <= t_s) low = middle + 1;
      else high = middle;
    }
    return this.changes[low - 1]?.state ?? "none";
  }

  listChanges() {
    const entries = [
      ...this.changes.map(c => ({ t_s: c.t_s, kind: c.state, text: STATES[c.state] + (c.reason === "none" ? "" : `: ${reasonWords(c.reason)}`) })),
      ...this.marks.map(m => ({ t_s: m.t_s, kind: "mark", text: m.text || "mark" })),
    ].sort((a, b) => b.t_s - a.t_s).slice(0, LISTED);
    this.list.replaceChildren(...entries.map(entry => {
      const item = document.createElement("li"), time = document.createElement("time");
      item.className = entry.kind;
      time.textContent = clock(entry.t_s);
      item.append(time, entry.text);
      return item;
    }));
  }

  drawSoon() { this.timer ??= setTimeout(() => { this.timer = undefined; this.draw(); }, 200); }

  draw() {
    const ratio = Math.min(devicePixelRatio, 2);
    const width = this.canvas.width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const height = this.canvas.height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    const pen = this.canvas.getContext("2d");
    const end_s = Math.max(this.total_s ?? this.end_s, 1e-3), x = t_s => t_s / end_s * width;
    pen.fillStyle = "#1c262d";
    pen.fillRect(0, 0, width, height);
    this.changes.forEach((change, i) => {
      pen.fillStyle = HEALTH[change.state] ?? HEALTH.none;
      const from = x(change.t_s), to = x(this.changes[i + 1]?.t_s ?? this.end_s);
      pen.fillRect(from, 0, Math.max(to - from, ratio), height);  // at least a pixel wide
    });
    pen.fillStyle = "#ffffff";
    for (const mark of this.marks) pen.fillRect(x(mark.t_s) - ratio, 0, 2 * ratio, height);
    this.canvas.setAttribute("aria-label", `Health over ${end_s.toFixed(0)} seconds: ${this.changes.length} states, ${this.marks.length} marks; the newest are listed below`);
  }
}
