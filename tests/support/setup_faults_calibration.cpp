// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "fbvins/camera/scaled_lens.hpp"
#include "fbvins/doctor/lens_change.hpp"
#include "tests/support/setup_fault_lists.hpp"

namespace fbvins::setup_fault {
namespace {

SetupFault calibration_turned(std::string name, const Vec3& axis, double degrees) {
  return {std::move(name),
          FindingKind::imu_camera_rotation,
          degrees,
          kRotationTolerance_deg,
          [axis, degrees](StereoRig& rig) {
            const auto T_C0C1 = rig.T_BC0().inverse() * rig.T_BC1();
            rig.cameras[0].T_BC = {Mat3(turn(axis, degrees) * rig.T_BC0().R()), rig.T_BC0().p};
            rig.cameras[1].T_BC = (rig.T_BC0() * T_C0C1).cast_frames<B, C0>();
          },
          {},
          {}};
}
SetupFault right_turned(std::string name, const Vec3& axis, double degrees) {
  return {std::move(name),
          FindingKind::right_camera_turned,
          degrees,
          std::max(kTenth * degrees, 0.05),
          [axis, degrees](StereoRig& rig) {
            rig.cameras[1].T_BC = {Mat3(rig.T_BC1().R() * turn(axis, degrees)), rig.T_BC1().p};
          },
          {},
          {}};
}
SetupFault focal(std::string name, bool left, bool right, double factor) {
  const double percent = 100 * (factor - 1);
  return {std::move(name),
          FindingKind::focal_length,
          percent,
          kTenth * std::abs(percent),
          [=](StereoRig& rig) {
            if (left) rig.cameras[0].camera = changed(rig.left(), {.log_focal = std::log(factor)});
            if (right) rig.cameras[1].camera = changed(rig.right(), {.log_focal = std::log(factor)});
          },
          {},
          {}};
}
SetupFault baseline(std::string name, double factor, const StereoRig& rig) {
  const double wrong_mm = 1e3 * rig.T_C1C0().p.norm() * (factor - 1);
  return {std::move(name),
          FindingKind::baseline_length,
          wrong_mm,
          kTenth * std::abs(wrong_mm),
          [factor](StereoRig& r) { r.cameras[1].T_BC.p = r.T_BC0().p + factor * (r.T_BC1().p - r.T_BC0().p); },
          {},
          {}};
}
void forget_distortion(Camera& camera) {
  auto model = camera.model();
  std::visit([](auto& m) { m = {m.fx, m.fy, m.cx, m.cy}; }, model);
  camera = camera.with_lens(model);
}
SetupFault changed_by(std::string name, FindingKind kind, std::function<void(StereoRig&)> change, double size = 0,
                      double tolerance = 0) {
  return {std::move(name), kind, size, tolerance, std::move(change), {}, {}};
}

std::vector<SetupFault> inverted() {
  const auto left = [](const StereoRig& r) { return r.T_BC0().inverse().cast_frames<B, C0>(); };
  const auto right = [](const StereoRig& r) { return r.T_BC(1).inverse().cast_frames<B, C0>(); };
  constexpr FindingKind kKind = FindingKind::extrinsics_inverted;
  return {
      changed_by("both transforms to the IMU inverted", kKind,
                 [=](StereoRig& r) { r.cameras[0].T_BC = left(r), r.cameras[1].T_BC = right(r); }),
      changed_by("left transform to the IMU inverted, the right camera beside it", kKind,
                 [=](StereoRig& r) {
                   const auto T_C0C1 = r.T_BC0().inverse() * r.T_BC1();
                   r.cameras[0].T_BC = left(r);
                   r.cameras[1].T_BC = (r.T_BC0() * T_C0C1).cast_frames<B, C0>();
                 }),
      changed_by("right transform to the IMU inverted", kKind, [=](StereoRig& r) { r.cameras[1].T_BC = right(r); }),
      changed_by("transform from camera to camera inverted", kKind,
                 [](StereoRig& r) { r.cameras[1].T_BC = (r.T_BC0() * r.T_C1C0().cast_frames<C0, C1>()).cast_frames<B, C0>(); }),
  };
}

std::vector<SetupFault> of_another_kind() {
  const auto sized = [](double factor) {
    return [factor](StereoRig& r) {
      r.cameras[0].camera = with_scaled_lens(r.left(), factor), r.cameras[1].camera = with_scaled_lens(r.right(), factor);
    };
  };
  const auto noise = [](double factor) {
    return [factor](StereoRig& r) {
      r.imu_noise.gyro_noise_density_radps_rthz *= factor, r.imu_noise.accel_noise_density_mps2_rthz *= factor;
      r.imu_noise.gyro_random_walk_radps2_rthz *= factor, r.imu_noise.accel_random_walk_mps3_rthz *= factor;
    };
  };
  return {
      changed_by("lenses of a calibration at half the size", FindingKind::calibration_size, sized(0.5)),
      changed_by("lenses of a calibration at twice the size", FindingKind::calibration_size, sized(2)),
      changed_by("lenses exchanged", FindingKind::swapped_images,
                 [](StereoRig& r) {
                   const LensModel left = r.left().model();
                   r.cameras[0].camera = r.left().with_lens(r.right().model()), r.cameras[1].camera = r.right().with_lens(left);
                 }),
      changed_by(
          "cameras 10 cm from where they are on the IMU", FindingKind::imu_camera_position,
          [](StereoRig& r) { r.cameras[0].T_BC.p += Vec3(0.06, 0, 0.08), r.cameras[1].T_BC.p += Vec3(0.06, 0, 0.08); }, 10, 3),
      changed_by(
          "time offset of the calibration 50 ms off", FindingKind::time_offset, [](StereoRig& r) { r.time_offset_s += 0.05; },
          -50, kTimeTolerance_ms),
      changed_by("IMU's noise 100 times too large", FindingKind::imu_noise, noise(100)),
      changed_by("IMU's noise 100 times too small", FindingKind::imu_noise, noise(0.01)),
      changed_by(
          "left principal point off by (-25, 10)", FindingKind::principal_point,
          [](StereoRig& r) {
            r.cameras[0].camera = changed(r.left(), {.centre_px = {-25, 10}});
          },
          std::hypot(25, 10), kTenth * std::hypot(25, 10)),
      changed_by(
          "mounting wrong by 4 degrees and baseline 12 % too long", FindingKind::imu_camera_rotation,
          [](StereoRig& r) {
            calibration_turned("", Vec3::UnitX(), 4).rig(r);
            r.cameras[1].T_BC.p = r.T_BC0().p + 1.12 * (r.T_BC1().p - r.T_BC0().p);
          },
          4, kRotationTolerance_deg),
  };
}

}  // namespace

std::vector<SetupFault> of_the_calibration(const StereoRig& rig) {
  std::vector<SetupFault> all{
      calibration_turned("mounting wrong by 5 degrees about y", Vec3::UnitY(), 5),
      calibration_turned("mounting wrong by 2 degrees about z", Vec3::UnitZ(), 2),
      calibration_turned("mounting wrong by 90 degrees about x", Vec3::UnitX(), 90),
      right_turned("right camera turned 1 degree about x", Vec3::UnitX(), 1),
      right_turned("right camera turned 1.5 degrees about z", Vec3::UnitZ(), 1.5),
      focal("left focal length 5 % too long", true, false, 1.05),
      focal("right focal length 4 % too short", false, true, 0.96),
      focal("both focal lengths 8 % too long", true, true, 1.08),
      {"right principal point off by (20, 12)",
       FindingKind::principal_point,
       std::hypot(20, 12),
       0.1 * std::hypot(20, 12),
       [](StereoRig& r) {
         r.cameras[1].camera = changed(r.right(), {.centre_px = {20, 12}});
       },
       {},
       {}},
      {"left lens without distortion",
       FindingKind::distortion,
       0,
       0,
       [](StereoRig& r) { forget_distortion(r.cameras[0].camera); },
       {},
       {}},
      {"both lenses without distortion",
       FindingKind::distortion,
       0,
       0,
       [](StereoRig& r) { forget_distortion(r.cameras[0].camera), forget_distortion(r.cameras[1].camera); },
       {},
       {}},
      {"right lens without distortion",
       FindingKind::distortion,
       0,
       0,
       [](StereoRig& r) { forget_distortion(r.cameras[1].camera); },
       {},
       {}},
      baseline("baseline 9 % too short", 0.91, rig),
      baseline("baseline 10 % too long", 1.10, rig),
      baseline("baseline twice as long", 2, rig),
      {"rate of the IMU twice as high", FindingKind::imu_stamps, 0, 0, [](StereoRig& r) { r.imu_noise.rate_hz *= 2; }, {}, {}},
  };
  for (std::vector<SetupFault>& more : std::array{inverted(), of_another_kind()})
    for (SetupFault& fault : more) all.push_back(std::move(fault));
  return all;
}

}  // namespace fbvins::setup_fault
