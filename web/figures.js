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
    for (const id of ["position", "speed", "attitude", "sigma", "tilt"]) set(id, "–");
  }
  set("features", `${state.features ?? "–"} / ${state.landmarks}`);
}

export function showStatus({ counts, shutter_to_pose_ms: latency }) {
  set("latency", latency.count > 0 ? `${latency.p50.toFixed(1)} / ${latency.p99.toFixed(1)}` : "–");
  set("images", count(counts.images_estimated));
  set("dropped", count(counts.images_dropped) + (counts.images_incomplete > 0 ? ` (+${count(counts.images_incomplete)} half)` : ""));
  set("imu", `${count(counts.imu)} / ${count(counts.imu_late)}`);
  set("resets", count(counts.resets));
}

export function showMap(map) {
  document.getElementById("map-figure").hidden = false;
  set("map", `${count(map.keyframes)} / ${count(map.loops)}${map.localised ? "" : ", not localised yet"}`);
}

export function clearFigures() {
  for (const id of ["position", "speed", "distance", "attitude", "sigma", "tilt", "latency", "images", "dropped", "features", "imu", "resets", "map"]) set(id, "–");
}
