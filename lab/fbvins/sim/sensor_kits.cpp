// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/sensor_kits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "fbvins/core/angle.hpp"

namespace fbvins {
namespace {

constexpr double kG_mps2 = 9.80665, kMilliG_mps2 = 1e-3 * kG_mps2, kMicroG_mps2 = 1e-6 * kG_mps2;

/// The sources of these figures are in docs/experiments/simulator.md, in the order of this table.
struct Kit {
  const char* name;
  // Cameras
  PinholeRadtan lens;
  int width, height;
  double baseline_m;                      ///< 0: one camera
  std::array<int, 3> right_down_forward;  ///< axes of the IMU, from 1, signed, along the camera's
  std::array<double, 3> place_m;          ///< of the first camera, in the IMU's axes
  double rate_hz;
  const char* intervals_ms;
  double readout_ms;  ///< from the first line to the last
  double max_exposure_ms, max_gain, gain_step_db;
  double time_offset_ms, stamp_noise_us;
  // IMU
  double imu_hz, imu_stamp_jitter_us;
  double gyro_noise_dps, accel_noise_micro_g;  ///< for each root of a Hz
  double gyro_bias_dps, accel_bias_milli_g;    ///< standard deviations
  double crooked, accel_crookedness;           ///< of scale and axes
  double gyro_range_dps, accel_range_g;
  double gyro_step_dps, accel_step_milli_g;
  // What its user has
  CalibrationErrorOptions calibration;
};

// clang-format off
constexpr Kit kKits[] = {
    {.name = "d435i",
     .lens = {385, 385, 320.4, 239.2, 0, 0, 0, 0}, .width = 640, .height = 480, .baseline_m = 0.05,
     .right_down_forward = {1, 2, 3}, .place_m = {-0.00552, 0.0051, 0.01174},
     .rate_hz = 30, .intervals_ms = "", .readout_ms = 0,
     .max_exposure_ms = 8.5, .max_gain = 15.5, .gain_step_db = 0.5, .time_offset_ms = -4, .stamp_noise_us = 50,
     .imu_hz = 200, .imu_stamp_jitter_us = 50, .gyro_noise_dps = 0.014, .accel_noise_micro_g = 150,
     .gyro_bias_dps = 0.5, .accel_bias_milli_g = 35, .crooked = 0.005, .accel_crookedness = 3,
     .gyro_range_dps = 1000, .accel_range_g = 4, .gyro_step_dps = 1 / 32.8, .accel_step_milli_g = 1000 / 512.0,
     .calibration = {.focal_share = 0.001, .centre_px = 0.5, .pair_share = 0.2, .mounting_deg = 0.3, .place_mm = 1, .imu_noise_factor = 2}},
    {.name = "d435i-colour",
     .lens = {615, 615, 322.1, 243.6, 0.11, -0.22, 0, 0}, .width = 640, .height = 480, .baseline_m = 0,
     .right_down_forward = {1, 2, 3}, .place_m = {0.0092, 0.0051, 0.01174},
     .rate_hz = 30, .intervals_ms = "33.33,50.0", .readout_ms = 30,
     .max_exposure_ms = 12, .max_gain = 8, .gain_step_db = 0.5, .time_offset_ms = -20, .stamp_noise_us = 50,
     .imu_hz = 200, .imu_stamp_jitter_us = 50, .gyro_noise_dps = 0.014, .accel_noise_micro_g = 150,
     .gyro_bias_dps = 0.5, .accel_bias_milli_g = 35, .crooked = 0.005, .accel_crookedness = 3,
     .gyro_range_dps = 1000, .accel_range_g = 4, .gyro_step_dps = 1 / 32.8, .accel_step_milli_g = 1000 / 512.0,
     .calibration = {.focal_share = 0.003, .centre_px = 1, .mounting_deg = 0.5, .place_mm = 2, .imu_noise_factor = 2,
                     .without_distortion = true, .without_line_delay = true}},
    {.name = "oak-d",
     .lens = {381, 381, 318.7, 201.9, -0.06, 0.03, 0, 0}, .width = 640, .height = 400, .baseline_m = 0.075,
     .right_down_forward = {-2, 1, 3}, .place_m = {0.011, 0.03, 0.004},
     .rate_hz = 30, .intervals_ms = "", .readout_ms = 0,
     .max_exposure_ms = 10, .max_gain = 16, .gain_step_db = 0.5, .time_offset_ms = -5, .stamp_noise_us = 100,
     .imu_hz = 200, .imu_stamp_jitter_us = 200, .gyro_noise_dps = 0.007, .accel_noise_micro_g = 160,
     .gyro_bias_dps = 0.5, .accel_bias_milli_g = 20, .crooked = 0.004, .accel_crookedness = 1.5,
     .gyro_range_dps = 2000, .accel_range_g = 8, .gyro_step_dps = 1 / 16.4, .accel_step_milli_g = 1000 / 4096.0,
     .calibration = {.focal_share = 0.001, .centre_px = 0.5, .pair_share = 0.2, .mounting_deg = 0.5, .place_mm = 2, .imu_noise_factor = 2}},
    {.name = "l515",
     .lens = {453.1, 453.3, 321.2, 176.3, 0.07, -0.10, 0, 0}, .width = 640, .height = 360, .baseline_m = 0,
     .right_down_forward = {1, 2, 3}, .place_m = {-0.012, 0.002, 0.002},
     .rate_hz = 30, .intervals_ms = "33.17,40.05,50.01,59.96", .readout_ms = 28,
     .max_exposure_ms = 12, .max_gain = 8, .gain_step_db = 0.5, .time_offset_ms = -50, .stamp_noise_us = 1,
     .imu_hz = 200.9, .imu_stamp_jitter_us = 2, .gyro_noise_dps = 0.014, .accel_noise_micro_g = 120,
     .gyro_bias_dps = 0.3, .accel_bias_milli_g = 15, .crooked = 0.005, .accel_crookedness = 1,
     .gyro_range_dps = 1000, .accel_range_g = 4, .gyro_step_dps = 0.1, .accel_step_milli_g = 1,
     .calibration = {.focal_share = 0.007, .centre_px = 1, .mounting_deg = 0.6, .place_mm = 2, .imu_noise_factor = 1,
                     .imu_rate_share = 0.095, .without_distortion = true, .without_line_delay = true}},
    {.name = "phone",
     .lens = {493, 493, 317.5, 238.4, 0.08, -0.15, 0, 0}, .width = 640, .height = 480, .baseline_m = 0,
     .right_down_forward = {-2, -1, -3}, .place_m = {0.02, 0.055, -0.005},
     .rate_hz = 30, .intervals_ms = "33.33,41.67", .readout_ms = 30,
     .max_exposure_ms = 10, .max_gain = 8, .gain_step_db = 0.1, .time_offset_ms = 19, .stamp_noise_us = 100,
     .imu_hz = 100, .imu_stamp_jitter_us = 100, .gyro_noise_dps = 0.0038, .accel_noise_micro_g = 90,
     .gyro_bias_dps = 0.7, .accel_bias_milli_g = 20, .crooked = 0.005, .accel_crookedness = 1,
     .gyro_range_dps = 1000, .accel_range_g = 8, .gyro_step_dps = 0.035, .accel_step_milli_g = 0.244,
     .calibration = {.focal_share = 0.003, .centre_px = 1, .mounting_deg = 0.5, .place_mm = 3, .imu_noise_factor = 2,
                     .without_line_delay = true}},
    {.name = "arducam-fc",
     .lens = {457, 457, 323.8, 196.5, -0.15, 0.06, 0, 0}, .width = 640, .height = 400, .baseline_m = 0,
     .right_down_forward = {2, 3, 1}, .place_m = {0.08, 0.0, 0.03},
     .rate_hz = 30, .intervals_ms = "", .readout_ms = 0,
     .max_exposure_ms = 8, .max_gain = 16, .gain_step_db = 0.5, .time_offset_ms = -25, .stamp_noise_us = 1500,
     .imu_hz = 200, .imu_stamp_jitter_us = 300, .gyro_noise_dps = 0.004, .accel_noise_micro_g = 100,
     .gyro_bias_dps = 0.5, .accel_bias_milli_g = 20, .crooked = 0.005, .accel_crookedness = 1.5,
     .gyro_range_dps = 2000, .accel_range_g = 16, .gyro_step_dps = 1 / 16.4, .accel_step_milli_g = 1000 / 2048.0,
     .calibration = {.focal_share = 0.002, .centre_px = 0.7, .mounting_deg = 1, .place_mm = 5, .imu_noise_factor = 2}},
};
// clang-format on

const Kit* find(const std::string& name) {
  const auto* at = std::ranges::find(kKits, name, &Kit::name);
  return at == std::end(kKits) ? nullptr : at;
}

Vec3 axis(int signed_axis) { return (signed_axis > 0 ? 1.0 : -1.0) * Vec3::Unit(std::abs(signed_axis) - 1); }

ImuNoise noise_of(const Kit& kit) {
  ImuNoise noise;
  noise.gyro_noise_density_radps_rthz = kit.gyro_noise_dps * kDegree;
  noise.accel_noise_density_mps2_rthz = kit.accel_noise_micro_g * kMicroG_mps2;
  noise.gyro_random_walk_radps2_rthz = 1.7e-5;
  noise.accel_random_walk_mps3_rthz = 8.3e-4;
  noise.rate_hz = kit.imu_hz;
  return noise;
}

void use(const Kit& kit, SimulationOptions& o) {
  o.image_rate_hz = kit.rate_hz;
  CameraModelOptions& camera = o.camera;
  camera.intervals_ms = kit.intervals_ms;
  camera.line_delay_us = 1e3 * kit.readout_ms / kit.height;
  camera.max_exposure_ms = kit.max_exposure_ms, camera.max_gain = kit.max_gain, camera.gain_step_db = kit.gain_step_db;
  camera.time_offset_ms = kit.time_offset_ms, camera.stamp_noise_us = kit.stamp_noise_us;
  camera.stamp_jitter_us = 0;  // pairs are triggered together
  ImuModelOptions& imu = o.imu;
  imu.turn_on_gyro_bias_radps = kit.gyro_bias_dps * kDegree;
  imu.turn_on_accel_bias_mps2 = kit.accel_bias_milli_g * kMilliG_mps2;
  imu.scale_error = imu.misalignment_rad = kit.crooked;
  imu.accel_crookedness = kit.accel_crookedness;
  imu.gyro_range_radps = kit.gyro_range_dps * kDegree, imu.accel_range_mps2 = kit.accel_range_g * kG_mps2;
  imu.gyro_step_radps = kit.gyro_step_dps * kDegree, imu.accel_step_mps2 = kit.accel_step_milli_g * kMilliG_mps2;
  imu.stamp_jitter_us = kit.imu_stamp_jitter_us;
  o.calibration_error = kit.calibration;
}

/// EuRoC's rig, whose IMU has the noise of its data sheet and steps of its registers.
void use_adis16448(SimulationOptions& o) {
  o.imu.gyro_step_radps = 0.04 * kDegree, o.imu.accel_step_mps2 = 0.833 * kMilliG_mps2;
  o.imu.gyro_range_radps = 1000 * kDegree, o.imu.accel_range_mps2 = 18 * kG_mps2;
  o.imu.scale_error = 0.003;
  o.calibration_error = {.imu_noise_factor = 0.72};
}

}  // namespace

std::vector<std::string> sensor_kits() {
  std::vector<std::string> names;
  for (const Kit& kit : kKits) names.emplace_back(kit.name);
  names.emplace_back("adis16448");
  return names;
}

Result<void> use_sensors(SimulationOptions& options, const std::string& name) {
  if (const Kit* kit = find(name)) {
    use(*kit, options);
  } else if (name == "adis16448") {
    use_adis16448(options);
  } else {
    std::string known;
    for (const std::string& one : sensor_kits()) known += fmt::format("{}{}", known.empty() ? "" : ", ", one);
    return Error{ErrorCode::invalid_argument, fmt::format("there are no sensors '{}'; there are {}", name, known)};
  }
  options.sensors = name;
  return {};
}

StereoRig kit_rig(const std::string& name) {
  StereoRig rig = euroc_rig();
  const Kit* kit = find(name);
  if (kit == nullptr) {
    if (name == "adis16448") {
      rig.imu_noise.gyro_noise_density_radps_rthz = 0.0135 * kDegree;
      rig.imu_noise.accel_noise_density_mps2_rthz = 230 * kMicroG_mps2;
    }
    return rig;
  }
  Mat3 R_BC;
  for (int i = 0; i < 3; ++i) R_BC.col(i) = axis(kit->right_down_forward[static_cast<std::size_t>(i)]);
  const Vec3 place = Eigen::Map<const Vec3>(kit->place_m.data());
  const Camera camera(kit->lens, kit->width, kit->height);
  rig.cameras = {{camera, {R_BC, place}}};
  if (kit->baseline_m > 0) rig.cameras.push_back({camera, {R_BC, Vec3(place + R_BC * Vec3(kit->baseline_m, 0, 0))}});
  rig.imu_noise = noise_of(*kit);
  return rig;
}

}  // namespace fbvins
