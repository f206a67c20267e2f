// SPDX-License-Identifier: Apache-2.0
// The page of `fbvins live --web` and `fbvins view`: passes the stream's messages to the parts that show them.
import { CameraView } from "./camera.js";
import { clearFigures, setVehicle, showMap, showState, showStatus } from "./figures.js";
import { Player } from "./player.js";
import { Plots } from "./plots.js";
import { FlatScene } from "./flat_scene.js";
import { Scene } from "./scene.js";
import { Stream } from "./stream.js";
import { Timeline } from "./timeline.js";
import { STATES, clock, healthSentence } from "./words.js";

const NOTE_MS = 6000;
const element = id => document.getElementById(id);

const camera = new CameraView();
const plots = new Plots();
const timeline = new Timeline(element("timeline"), element("changes"));
const scene = makeScene();
let newest_s = -Infinity;  // time of the newest point of the path

function makeScene() {
  const onGrid = cell => { element("grid-words").textContent = `grid ${cell} m`; };
  let made;
  try {
    made = new Scene(element("scene"),
      scale => { element("ellipsoid-words").textContent = `position uncertainty, 3σ${scale > 1 ? `, drawn ×${scale}` : ""}`; }, onGrid);
  } catch {
    element("no-webgl").hidden = false;
    made = new FlatScene(element("scene"), onGrid);
  }
  made.clear();
  return made;
}

function showHealth(state, words, title = STATES[state] ?? "Connecting") {
  element("health").dataset.state = state;
  element("health-state").textContent = title;
  element("health-words").textContent = words;
}

function note(text, bad = false, lasts = true) {
  const place = element("note");
  place.textContent = text;
  place.classList.toggle("bad", bad);
  place.hidden = false;
  clearTimeout(note.timer);
  if (!lasts) note.timer = setTimeout(() => { place.hidden = true; }, NOTE_MS);
}

/// Shows the entries of the keys for what has been seen; keys name nothing that this flight has not.
function seen(...names) {
  for (const name of names) for (const entry of document.querySelectorAll(`[data-key="${name}"]`)) entry.hidden = false;
}

/// A button for what the flight can be asked to do; `never` says why it cannot, and is absent where there is no such command.
function offer(id, never, title) {
  element(id).hidden = never === undefined;
  element(id).disabled = never !== "";
  element(id).title = never || title;
}

/// Whether a record is being written is in the status.
function showRecording(outputs = []) {
  const recording = outputs.some(output => output.recording);
  element("record").textContent = recording ? "Stop record" : "Record";
  element("record").dataset.does = recording ? "stop_record" : "start_record";
}

function clear() {
  for (const entry of document.querySelectorAll("[data-key]")) entry.hidden = true;
  newest_s = -Infinity;
  for (const part of [camera, plots, timeline, scene]) part.clear();
  clearFigures();
}

const on = {
  hello(message) {
    clear();
    setVehicle(message.vehicle_to_imu_wxyz);
    document.title = `${message.replay ? "Replay" : "Live"}: ${message.source}`;
    const name = message.source.replace(/\/?([^/]*\/)*(?=[^/])/, "");  // without the folders
    const kind = /^\w+:/.exec(message.source)?.[0] ?? "";
    element("source").textContent = `${name.startsWith(kind) ? "" : kind}${name}${message.frontend ? `, ${message.frontend}` : ""}`;
    element("source").title = `${message.program}: ${message.source}`;
    element("mark").disabled = !message.can_mark;
    element("mark").hidden = message.replay;
    offer("save-map", message.commands.save_map, "Writes the map after the next keyframe");
    offer("load-map", message.commands.load_map, "Goes on with the map in the file; what this flight added since is forgotten");
    offer("record", message.commands.start_record, "Begins or ends a flight record");
    offer("reset", message.commands.reset, element("reset").title);
    showHealth("none", "No image has come yet.", "Waiting");
    if (!message.replay) return;
    timeline.total_s = message.duration_s;
    player.open(message.duration_s);
    scene.showWhole(message.whole_path);
    for (const [, x, y, z, reset] of message.whole_path) scene.addPath([x, y, z], reset, "none");
    scene.fit(false);
    scene.clear();
  },
  history(message) {
    for (const [t_s, state, reason] of message.health) { timeline.add(t_s, state, reason); seen(state); }
    for (const [t_s, text] of message.marks) { timeline.addMark(t_s, text); seen("mark"); }
    for (const row of message.series) plots.add(row);
    for (const [t_s, x, y, z, reset] of message.path) {
      scene.addPath([x, y, z], reset, timeline.stateAt(t_s));
      newest_s = t_s;
    }
    scene.pathChanged();
  },
  state(message) {
    const { t_s } = message;
    element("clock").textContent = clock(t_s);
    element("clock").dataset.image = message.image;
    player.at(t_s);
    showState(message);
    showHealth(message.health, healthSentence(message));
    timeline.add(t_s, message.health, message.reason);
    seen(message.health);
    plots.add([t_s, message.latency_ms, message.dropped, message.features, message.landmarks, message.sigma_m]);
    if (!message.position_m) return;
    if (t_s > newest_s) {
      scene.addPath(message.position_m, message.reset_counter, message.health);
      scene.pathChanged();
      newest_s = t_s;
    }
    scene.showPose(message.position_m, message.orientation_wxyz, message.position_covariance_m2);
    seen("ellipsoid");
    if (message.keyframes_m?.length) { scene.showKeyframes(message.keyframes_m); seen("keyframes"); }
  },
  status({ t_s, status }) {
    showStatus(status);
    showRecording(status.outputs);
    // Between images health changes when sensors are silent.
    if (status.health !== element("health").dataset.state) {
      showHealth(status.health, healthSentence({ ...status, sigma_m: NaN }));
      timeline.add(t_s, status.health, status.reason);
      seen(status.health);
    }
    if (status.problem) note(status.problem, true);
    else if (element("note").classList.contains("bad")) element("note").hidden = true;
  },
  map(message) {
    showMap(message);
    if (message.found) note("The map is known again.", false, false);
    if (message.corrected_m) scene.showMapped(message.corrected_m);
  },
  mark({ t_s, text }) {
    timeline.addMark(t_s, text);
    seen("mark");
    note(`Marked ${clock(t_s)}`, false, false);
  },
  note({ text, bad }) { note(text, bad, bad); },
  replay(message) { player.show(message); },
  rewound() { clear(); },
  image(message) { camera.show(message); },
  points(message) { scene.showPoints(message, true); if (message.count) seen("points"); },
  cloud(message) { scene.showPoints(message, false); if (message.count) seen("cloud"); },
  end() {
    on.ended = true;
    note("The flight has ended. This page shows its last state, and the next flight when the program runs again.");
  },
};

const stream = new Stream({
  open() { on.ended = false; element("note").hidden = true; },
  message(message) { on[message.type]?.(message); },
  lost() {
    if (on.ended) return;
    showHealth("none", "No connection to the program; trying again every two seconds.", "Not connected");
  },
  refused() { showHealth("none", "The program asks for a token.", "Not connected"); },
});
const player = new Player(stream);

element("mark").addEventListener("click", () => stream.send({ do: "mark", text: "" }));
element("save-map").addEventListener("click", () => { stream.send({ do: "save_map" }); note("The map will be saved after the next keyframe.", false, false); });
element("load-map").addEventListener("click", () => { stream.send({ do: "load_map" }); });
element("record").addEventListener("click", event => stream.send({ do: event.currentTarget.dataset.does ?? "start_record" }));
element("reset").addEventListener("click", () => {
  element("reset-dialog").returnValue = "";  // that of the time before
  element("reset-dialog").showModal();
});
element("reset-dialog").addEventListener("close", event => { if (event.currentTarget.returnValue === "yes") stream.send({ do: "reset" }); });
element("follow").addEventListener("click", event => {
  scene.follows = !scene.follows;
  event.currentTarget.setAttribute("aria-pressed", String(scene.follows));
});
for (const [id, fromAbove] of [["from-above", true], ["fit", false]]) {
  element(id).addEventListener("click", () => {
    scene.follows = false;
    element("follow").setAttribute("aria-pressed", "false");
    scene.fit(fromAbove);
  });
}
