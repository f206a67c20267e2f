// SPDX-License-Identifier: Apache-2.0
// States and reasons in plain words, and the format of figures.

export const STATES = {
  good: "Good", degraded: "Degraded", lost: "Lost", initialising: "Starting",
};

const REASONS = {
  none: "",
  waiting_for_motion_or_rest: "waiting until the vehicle rests or moves enough",
  too_few_features: "the images show too few features",
  alignment_refused: "the start did not fit together; trying again",
  few_tracks: "few features can be followed",
  no_tracks: "no feature can be followed",
  no_images: "no images come",
  imu_gap: "the IMU is silent",
  implausible_bias: "the IMU's bias became implausible",
  implausible_speed: "the speed became implausible",
  solver_failed: "the solver failed",
  one_camera: "only one camera delivers",
  frontend_fault: "the frontend returned impossible features",
  contradiction: "camera and IMU contradict each other",
  cameras_disagree: "the two cameras contradict each other",
  imu_clipped: "the IMU is at the end of its range",
  imu_vibration: "strong vibration spoils the IMU's readings",
  correction_pending: "the pose is being corrected",
  range_disagrees: "the rangefinder disagrees: it is not used",
  velocity_disagrees: "the sensor of velocity disagrees: it is not used",
  pressure_disagrees: "the barometer disagrees: it is not used",
};

export function reasonWords(reason) { return REASONS[reason] ?? reason.replaceAll("_", " "); }

export function healthSentence(state) {
  const without = state.without_cameras ?? [];
  const scale = state.scale_sigma > 0 ? ` Scale known to ±${(300 * state.scale_sigma).toFixed(1)} % (3σ).` : "";
  const why = reasonWords(state.reason) + (without.length ? `, without camera ${without.join(", ")}` : "");
  switch (state.health) {
    case "good": return `Position known to ±${length(3 * state.sigma_m)} (3σ).${scale}`;
    case "degraded": return `${sentence(why || "worse than it could be")} Position ±${length(3 * state.sigma_m)} (3σ).${scale}`;
    case "lost": return `${sentence(why || "no trustworthy pose")} There is no pose; it starts again.`;
    default: return sentence(why || "no pose yet");
  }
}

function sentence(words) { return words.charAt(0).toUpperCase() + words.slice(1) + "."; }

/// A length in cm or m.
export function length(metres) {
  if (!Number.isFinite(metres)) return "–";
  if (metres < 0.1) return `${(100 * metres).toFixed(1)} cm`;
  return metres < 1 ? `${(100 * metres).toFixed(0)} cm` : `${metres.toFixed(1)} m`;
}

/// Minutes and seconds.
export function clock(seconds, digits = 1) {
  const whole = Math.max(0, Math.floor(seconds * 10 ** digits) / 10 ** digits);
  const minutes = Math.floor(whole / 60);
  const rest = (whole - 60 * minutes).toFixed(digits);
  return `${minutes}:${rest.padStart(digits ? 3 + digits : 2, "0")}`;
}

/// Whole numbers with thin spaces between groups of three digits.
export function count(number) { return String(number ?? "–").replace(/\B(?=(\d{3})+$)/g, "\u202f"); }

/// Degrees about x, y, z of a body whose attitude is this quaternion: yaw about z, then pitch about y, then roll about x.
export function rollPitchYaw([w, x, y, z]) {
  const degrees = 180 / Math.PI;
  const roll = Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y));
  const pitch = Math.asin(Math.max(-1, Math.min(1, 2 * (w * y - z * x))));
  const yaw = Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
  return [roll, pitch, yaw].map(angle => angle * degrees);
}

/// Product of quaternions w, x, y, z.
function product([w, x, y, z], [v, i, j, k]) {
  return [w * v - x * i - y * j - z * k, w * i + x * v + y * k - z * j, w * j - x * k + y * v + z * i, w * k + x * j - y * i + z * v];
}

/// Degrees by which a vehicle is rolled to the right, pitched up and turned to the right, seen from the frame of the path (z up): its attitude
/// is that of its axes forward, right, down in a frame turned upside down. Both quaternions take to the frame of the path and to the IMU.
export function vehicleAngles(imu_wxyz, vehicle_to_imu_wxyz) {
  return rollPitchYaw(product([0, 1, 0, 0], product(imu_wxyz, vehicle_to_imu_wxyz)));
}
