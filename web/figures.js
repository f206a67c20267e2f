// SPDX-License-Identifier: Apache-2.0
// The figures of the page, each with its unit in the page itself.
import { count, rollPitchYaw, vehicleAngles } from "./words.js";

let vehicle = null;  // quaternion from the vehicle's axes (forward, right, down) to the IMU's; null: not known

/// How the IMU sits on the vehicle, where that is known: roll, pitch and yaw are the vehicle's then.
export function setVehicle(vehicle_to_imu_wxyz) {
  vehicle = vehicle_to_imu_wxyz ?? null;
  document.getElementById("attitude-of").textContent = `Roll, pitch, yaw of the ${vehicle ? "vehicle" : "IMU"}`;
}

function set(id, text) {
  const element = document.getElementById(id);
  if (element.textContent !== text) element.textContent = text;
}
const fixed = (numbers, digits) => numbers.map(x => Number.isFinite(x) ? x.toFixed(digits) : "–").join(", ");

export function showState(state) {
  if (state.position_m) {
    set("position", fixed(state.position_m, 2));
    set("speed", Math.hypot(...state.velocity_mps).toFixed(2));
    set("distance", state.distance_m.toFixed(1));
    set("attitude", fixed(vehicle ? vehicleAngles(state.orientation_wxyz, vehicle) : rollPitchYaw(state.orientation_wxyz), 1));
    set("sigma", fixed([100 * state.sigma_m], 1));
    set("tilt", `${fixed([state.tilt_sigma_rad * 180 / Math.PI], 2)}`);
  } else {
    for (const name of ["record", "link", "clocks"]) show(name, []);
  for (const id of ["position", "speed", "attitude", "sigma", "tilt"]) set(id, "–");
  }
  set("features", `${state.features ?? "–"} / ${state.landmarks}`);
}

export function showStatus({ counts, shutter_to_pose_ms: latency, outputs = [] }) {
  set("latency", latency.count > 0 ? `${latency.p50.toFixed(1)} / ${latency.p99.toFixed(1)}` : "–");
  set("images", count(counts.images_estimated));
  set("dropped", count(counts.images_dropped) + (counts.images_incomplete > 0 ? ` (+${count(counts.images_incomplete)} half)` : ""));
  set("imu", `${count(counts.imu)} / ${count(counts.imu_late)}`);
  set("resets", count(counts.resets));
  show("record", outputs.filter(o => "recording" in o).map(recordWords));
  const links = outputs.filter(o => "flight_controller" in o);
  show("link", links.map(linkWords));
  show("clocks", links.map(clockWords));
}

/// A figure that is there only where the flight has it; one line for each.
function show(name, lines) {
  document.getElementById(`${name}-figure`).hidden = lines.length === 0;
  set(name === "record" ? "record-words" : name, lines.join("; ") || "–");
}

function recordWords({ recording, file = "", written_mb, free_mb }) {
  if (!recording) return "not being recorded";
  return `${file.split("/").at(-1)}, ${written_mb.toFixed(1)} MB; ${bytes(free_mb)} free`;
}

/// A size given in MB; what has no end is not known.
function bytes(mb) { return mb > 1e9 ? "–" : mb < 10_000 ? `${mb.toFixed(0)} MB` : `${(mb / 1000).toFixed(0)} GB`; }

function linkWords({ connected, flight_controller, poses_sent, frames_dropped }) {
  const state = !connected ? "port not open" : !flight_controller ? "not heard" : "heard";
  return `${state}, ${count(poses_sent)} poses sent${frames_dropped > 0 ? `, ${count(frames_dropped)} messages lost` : ""}`;
}

function clockWords({ clock_known, clock_offset_s, round_trip_ms }) {
  return clock_known ? `${round_trip_ms.toFixed(1)} ms, ${clock_offset_s.toFixed(3)} s` : "not known: no poses are sent";
}

export function showMap(map) {
  document.getElementById("map-figure").hidden = false;
  set("map", `${count(map.keyframes)} / ${count(map.loops)}, ${map.localised ? "localised" : "not localised yet"}`);
}

export function clearFigures() {
  for (const id of ["position", "speed", "distance", "attitude", "sigma", "tilt", "latency", "images", "dropped", "features", "imu", "resets", "map"]) set(id, "–");
}
