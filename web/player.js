// SPDX-License-Identifier: Apache-2.0
// Controls of a replay: play, pause, seek.
import { clock } from "./words.js";

const SEEK_MS = 100;
const element = id => document.getElementById(id);

export class Player {
  constructor(stream) {
    this.stream = stream;
    this.playing = true;
    element("play").addEventListener("click", () => stream.send({ do: this.playing ? "pause" : "play" }));
    element("seek").addEventListener("input", () => this.seekSoon());
    element("seek").addEventListener("change", () => { this.held = false; });
  }

  open(duration_s) {
    this.duration_s = duration_s;
    element("seek").max = duration_s;
    element("player").hidden = false;
  }

  /// No more often than the program can answer.
  seekSoon() {
    this.held = true;
    this.timer ??= setTimeout(() => {
      this.timer = undefined;
      this.stream.send({ do: "seek", t_s: Number(element("seek").value) });
    }, SEEK_MS);
  }

  show({ t_s, playing }) {
    this.playing = playing;
    element("play").textContent = playing ? "❚❚" : "▶";
    element("play").setAttribute("aria-label", playing ? "Pause" : "Play");
    this.at(t_s);
  }
  at(t_s) {
    if (this.duration_s === undefined) return;
    if (!this.held) element("seek").value = t_s;
    element("player-clock").textContent = `${clock(t_s, 0)} / ${clock(this.duration_s, 0)}`;
  }
}
