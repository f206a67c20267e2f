// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "fbvins/camera/opencv_lens.hpp"
#include "fbvins/realsense/realsense_camera.hpp"

namespace fbvins {
namespace {

// Data sheet of the D435i's IMU (BMI055): 0.014 degrees/s/sqrt(Hz) and 150 micro-g/sqrt(Hz). It states no random walks; those of
// ImuNoise's defaults are kept, which are of a better sensor: give your own by --imu-calibration.
constexpr double kGyroNoise_radps_rthz = 2.44e-4, kAccelNoise_mps2_rthz = 1.47e-3;

Result<Camera> camera_of(const rs2_intrinsics& lens, const std::string& which) {
  const float* k = lens.coeffs;
  if (lens.model == RS2_DISTORTION_KANNALA_BRANDT4)
    return Camera(KannalaBrandt{lens.fx, lens.fy, lens.ppx, lens.ppy, k[0], k[1], k[2], k[3]}, lens.width, lens.height);
  // The infrared images of the D400 family are rectified: whatever the model is called, its coefficients are zero.
  const bool straight = std::all_of(std::begin(lens.coeffs), std::end(lens.coeffs), [](float c) { return c == 0; });
  if (!straight && lens.model != RS2_DISTORTION_BROWN_CONRADY)
    return Error{ErrorCode::unsupported, fmt::format("{}: its distortion ({}) is not supported; calibrate with Kalibr", which,
                                                     rs2_distortion_to_string(lens.model))};
  return opencv_camera({lens.fx, lens.fy, lens.ppx, lens.ppy}, {std::begin(lens.coeffs), std::end(lens.coeffs)}, lens.width,
                       lens.height);
}

/// In the library's convention: the rotation column by column, p_to = R * p_from + t.
template <class To, class From>
Pose<To, From> pose_of(const rs2_extrinsics& e) {
  Mat3 R;
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) R(row, column) = e.rotation[3 * column + row];
  return {Quat(R).normalized(), Vec3(e.translation[0], e.translation[1], e.translation[2])};
}

/// Standard deviation of a disparity, as the maker's guide to tuning has it for a textured wall.
constexpr double kDisparity_px = 0.08;
/// Of all distances: within the data sheet's 2 % at 2 m, which includes what a projector cannot mend.
constexpr double kScale = 0.01;

DepthSensor depth_sensor(const Camera& depth, double baseline_m) {
  return {.noise_at_1m_m = kDisparity_px / (depth.focal_px() * std::max(baseline_m, 1e-3)), .scale_sigma = kScale};
}

/// Depths are measured in the left camera, where both streams have one size.
bool registered(const Camera& left, const Camera& depth, const Pose<C0, C0>& T_CD) {
  constexpr double kSame_px = 0.01, kSame_m = 1e-4;
  const auto a = left.intrinsics(), b = depth.intrinsics();
  bool same = left.width() == depth.width() && left.height() == depth.height() && T_CD.p.norm() < kSame_m &&
              T_CD.q.vec().norm() < kSame_m;
  for (std::size_t i = 0; i < a.size(); ++i) same &= std::abs(a[i] - b[i]) < kSame_px;
  return same && left.distortion() == depth.distortion();
}

}  // namespace

Result<StereoRig> realsense_rig(const rs2::video_stream_profile& left, const rs2::video_stream_profile& second,
                                const rs2::motion_stream_profile& gyro, double baseline_m) {
  const bool depth = second.stream_type() == RS2_STREAM_DEPTH;
  StereoRig rig;
  const auto left_camera = camera_of(left.get_intrinsics(), "left infrared");
  if (!left_camera) return left_camera.error();
  const auto second_camera = camera_of(second.get_intrinsics(), depth ? "depth" : "right infrared");
  if (!second_camera) return second_camera.error();
  rig.cameras = {{*left_camera, pose_of<B, C0>(left.get_extrinsics_to(gyro))}};
  if (depth) {
    rig = with_depth(rig, depth_sensor(*second_camera, baseline_m));
    const Pose<C0, C0> T_CD = pose_of<C0, C0>(second.get_extrinsics_to(left));
    if (!registered(*left_camera, *second_camera, T_CD)) rig.depth->own = MountedCamera{*second_camera, rig.T_BC0() * T_CD};
  } else {
    rig.cameras.push_back({*second_camera, pose_of<B, C0>(second.get_extrinsics_to(gyro))});
  }
  rig.imu_noise.gyro_noise_density_radps_rthz = kGyroNoise_radps_rthz;
  rig.imu_noise.accel_noise_density_mps2_rthz = kAccelNoise_mps2_rthz;
  rig.imu_noise.rate_hz = gyro.fps();
  rig.image_rate_hz = left.fps();
  return rig;
}

}  // namespace fbvins
