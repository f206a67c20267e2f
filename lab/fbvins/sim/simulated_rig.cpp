// SPDX-License-Identifier: Apache-2.0
// The rigs of a simulation: as it is, and as the recording's calibration says.
#include <fmt/format.h>

#include <initializer_list>
#include <memory>
#include <vector>

#include "fbvins/core/angle.hpp"
#include "fbvins/io/kalibr.hpp"
#include "fbvins/sim/normal3.hpp"
#include "fbvins/sim/sensor_kits.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {
namespace {

/// Adds cameras like these of the rig, turned about the vertical of an upright rig, which is the left camera's -y, through a
/// point behind it.
void add_turned(StereoRig& rig, double degrees, std::initializer_list<int> cameras, double behind_m = 0.05) {
  std::vector<MountedCamera> all;
  for (int i = 0; i < rig.camera_count(); ++i) all.push_back(rig.mounted(i));
  const Vec3 axis = -(rig.T_BC0().q * Vec3::UnitY()), through = rig.T_BC0() * Vec3(0, 0, -behind_m);
  const Quat turn(Eigen::AngleAxisd(degrees * kDegree, axis));
  const Pose<B, B> turned(turn, Vec3(through - turn * through));
  for (const int i : cameras) all.push_back({rig.camera(i), turned * rig.T_BC(i)});
  rig = with_cameras(rig, all);
}

/// 200 degrees across a circle of 800 pixels, outside of which the image is black.
Camera fisheye() {
  constexpr double kRadius_px = 400;
  const Vec2 centre(423.5, 399.5);
  Image seen(848, 800, 0);
  for (int y = 0; y < seen.height(); ++y)
    for (int x = 0; x < seen.width(); ++x)
      if ((Vec2(x, y) - centre).norm() <= kRadius_px) seen.at(x, y) = 255;
  Camera camera(KannalaBrandt{229, 229, centre.x(), centre.y(), 0, 0, 0, 0}, seen.width(), seen.height());
  camera.set_mask(std::make_shared<const Mask>(seen));
  return camera;
}

/// As far to the right of the left camera, and slightly turned.
MountedCamera depth_camera(const Pose<B, C0>& T_BC0, double apart_m) {
  const Pose<C0, C0> T_CD(so3_exp(Vec3(0.012, -0.02, 0.008)), Vec3(apart_m, 0, 0));
  return {Camera(PinholeRadtan{382, 382, 318.4, 241.7, 0, 0, 0, 0}, 640, 480), T_BC0 * T_CD};
}

void put_lens(StereoRig& rig, const Camera& camera) {
  for (int i = 0; i < std::min(2, rig.camera_count()); ++i) rig.cameras[static_cast<std::size_t>(i)].camera = camera;
}

/// The kit with its IMU turned, so that the cameras look in the body as those of `rig`.
StereoRig in_axes_of(const StereoRig& rig, StereoRig kit) {
  const Pose<B, B> turn(Quat(rig.T_BC0().q * kit.T_BC0().q.conjugate()), Vec3::Zero());
  for (MountedCamera& mounted : kit.cameras) mounted.T_BC = turn * mounted.T_BC;
  return kit;
}

/// Share of the focal length, and of the principal point in px.
Vec3 lens_error(const CalibrationErrorOptions& error, Rng& rng) {
  const double focal = rng.normal(), x = rng.normal(), y = rng.normal();
  return {error.focal_share * focal, error.centre_px * x, error.centre_px * y};
}

/// The lens as a calibration has it. Other models than these keep what they are.
Camera miscalibrated(const Camera& camera, const CalibrationErrorOptions& error, const Vec3& by) {
  const double focal = 1 + by.x(), x_px = by.y(), y_px = by.z();
  if (camera.model_name() != "pinhole-radtan") return camera;
  const auto f = camera.intrinsics();
  std::vector<double> k = camera.distortion();
  if (error.without_distortion) std::fill(k.begin(), k.end(), 0.0);
  Camera out(PinholeRadtan{focal * f[0], focal * f[1], f[2] + x_px, f[3] + y_px, k[0], k[1], k[2], k[3]}, camera.width(),
             camera.height());
  out.set_mask(camera.mask());
  out.set_own_times(camera.own_times());
  return out;
}

}  // namespace

Result<StereoRig> simulated_rig(const SimulationOptions& o) {
  StereoRig rig = euroc_rig();
  if (!o.calibration.empty()) {
    Result<StereoRig> loaded = load_kalibr(o.calibration);
    if (!loaded) return loaded.error();
    rig = *loaded;
  }
  // A recorded trajectory is that of its own rig's body, in which the cameras look along the same axes.
  if (o.sensors != "none") rig = o.recorded.trajectory.empty() ? kit_rig(o.sensors) : in_axes_of(rig, kit_rig(o.sensors));
  if (!rig.has_right() && o.rig == "quad")
    return Error{ErrorCode::invalid_argument, fmt::format("rig=quad has two pairs of cameras, and {} has one camera", o.sensors)};
  if (o.rig == "mono") rig = with_one_camera(rig);
  if (o.rig == "fisheye") put_lens(rig, fisheye());
  if (o.rig == "back-to-back") {
    rig = with_one_camera(rig);
    put_lens(rig, fisheye());
    add_turned(rig, 180, {0});
  }
  if (o.rig == "quad") add_turned(rig, 180, {0, 1});
  if (o.rig == "sides") add_turned(rig, 90, {0}), add_turned(rig, -90, {0});
  if (o.rig == "trinocular") {
    std::vector<MountedCamera> three = rig.cameras;
    three.push_back({rig.left(), rig.T_BC0() * Pose<C0, C0>(Quat::Identity(), Vec3(0.05, -0.15, 0))});
    rig = with_cameras(rig, three);
  }
  if (o.rig == "fan") {
    rig = with_one_camera(rig);
    for (const double degrees : {40, -40, 80}) add_turned(rig, degrees, {0}, 0.1);
  }
  if (o.rig == "rgbd") {
    rig = with_depth(rig,
                     {.noise_at_1m_m = o.depth.noise_at_1m_m, .nearest_m = o.depth.nearest_m, .farthest_m = o.depth.farthest_m});
    if (o.depth.apart_m > 0) rig.depth->own = depth_camera(rig.T_BC0(), o.depth.apart_m);
  }
  for (int i = 1; o.camera.later_ms > 0 && i < rig.camera_count(); ++i)
    rig.cameras[static_cast<std::size_t>(i)].camera.set_own_times({.time_offset_s = 1e-3 * i * o.camera.later_ms});
  rig.image_rate_hz = o.image_rate_hz;
  rig.time_offset_s = o.camera.time_offset_ms * 1e-3;
  rig.line_delay_s = o.camera.line_delay_us * 1e-6;
  return rig;
}

StereoRig calibrated_rig(const SimulationOptions& o, StereoRig rig) {
  const CalibrationErrorOptions& error = o.calibration_error;
  if (error == CalibrationErrorOptions{} && o.sensors == "none") return rig;
  Rng rng(static_cast<std::uint64_t>(o.seed), 64);
  const Vec3 of_left = lens_error(error, rng);
  rig.cameras[0].camera = miscalibrated(rig.left(), error, of_left);
  if (rig.has_right()) {
    const Vec3 own = lens_error(error, rng);
    rig.cameras[1].camera =
        miscalibrated(rig.right(), error, error.pair_share < 1 ? Vec3(of_left + error.pair_share * own) : own);
  }
  const Pose<B, B> moved(so3_exp(normal3(rng, error.mounting_deg * kDegree)), normal3(rng, 1e-3 * error.place_mm));
  if (error.mounting_deg > 0 || error.place_mm > 0) {
    for (MountedCamera& camera : rig.cameras) camera.T_BC = moved * camera.T_BC;
    if (rig.depth && rig.depth->own) rig.depth->own->T_BC = moved * rig.depth->own->T_BC;
  }
  if (error.without_line_delay) rig.line_delay_s = 0;
  if (o.sensors != "none") rig.time_offset_s = 0;
  rig.imu_noise.gyro_noise_density_radps_rthz *= error.imu_noise_factor;
  rig.imu_noise.accel_noise_density_mps2_rthz *= error.imu_noise_factor;
  rig.imu_noise.rate_hz *= 1 + error.imu_rate_share;
  return rig;
}

}  // namespace fbvins
