// SPDX-License-Identifier: Apache-2.0
// The calibration in a sender's hello: parse_socket_rig() and its reverse.
#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>

#include "fbvins/camera/camera_times.hpp"
#include "fbvins/camera/check_rig.hpp"
#include "fbvins/camera/lens_numbers.hpp"
#include "fbvins/live/socket_message.hpp"

namespace fbvins {
namespace {

constexpr double kLargestOffset_s = 10;
/// Matrices typed by hand carry three or four digits.
constexpr double kRotationTolerance = 1e-3;

Error wrong_rig(std::string sentence) { return {ErrorCode::malformed, "calibration: " + std::move(sentence)}; }

bool are_finite(const double* begin, std::size_t count) {
  return std::all_of(begin, begin + count, [](double x) { return std::isfinite(x); });
}

Result<Camera> camera_of(const FbvinsSocketCamera& c, int width_px, int height_px, const std::string& side) {
  const double* f = c.focal_px;
  const double* m = c.centre_px;
  const double* k = c.distortion;
  if (!are_finite(f, 2) || !are_finite(m, 2) || !are_finite(k, 4) || !(f[0] > 0 && f[1] > 0))
    return wrong_rig(fmt::format("the {} camera's intrinsics are not finite, with positive focal lengths", side));
  if (c.model == FBVINS_SOCKET_RADTAN)
    return Camera(PinholeRadtan{f[0], f[1], m[0], m[1], k[0], k[1], k[2], k[3]}, width_px, height_px);
  if (c.model == FBVINS_SOCKET_EQUIDISTANT)
    return Camera(KannalaBrandt{f[0], f[1], m[0], m[1], k[0], k[1], k[2], k[3]}, width_px, height_px);
  const bool double_sphere = c.model == FBVINS_SOCKET_DOUBLE_SPHERE;
  if (!double_sphere && c.model != FBVINS_SOCKET_EXTENDED_UNIFIED)
    return wrong_rig(fmt::format("the {} camera has no model {}", side, c.model));
  if (const std::string problem = outside_of_model(double_sphere ? "ds" : "eucm", {k[0], k[1]}); !problem.empty())
    return wrong_rig(fmt::format("of the {} camera {}", side, problem));
  if (double_sphere) return Camera(DoubleSphere{f[0], f[1], m[0], m[1], k[0], k[1]}, width_px, height_px);
  return Camera(ExtendedUnified{f[0], f[1], m[0], m[1], k[0], k[1]}, width_px, height_px);
}

Result<Pose<B, C0>> mounting_of(const FbvinsSocketCamera& camera, const std::string& side) {
  const double* m = camera.T_BC;
  Mat3 R;
  R << m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10];
  const Vec3 p(m[3], m[7], m[11]);
  if (!((R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff() < kRotationTolerance) || !(R.determinant() > 0) ||
      !are_finite(m, 12))
    return wrong_rig(fmt::format("the {} camera's T_BC is not a rotation and a translation", side));
  if (!(p.cwiseAbs().maxCoeff() < 1e3)) return wrong_rig(fmt::format("the {} camera is more than a kilometre away", side));
  return Pose<B, C0>{Quat(R).normalized(), p};
}

Result<void> check_figures(const FbvinsSocketRig& rig) {
  for (const double figure :
       {rig.gyro_noise_density_radps_rthz, rig.gyro_random_walk_radps2_rthz, rig.accel_noise_density_mps2_rthz,
        rig.accel_random_walk_mps3_rthz, rig.imu_rate_hz, rig.image_rate_hz})
    if (!(figure > 0 && std::isfinite(figure))) return wrong_rig("a noise density or a rate is not positive");
  if (!(std::abs(rig.time_offset_s) <= kLargestOffset_s)) return wrong_rig("the time offset is more than 10 s");
  return {};
}

/// Of each camera that the rig has.
Result<std::vector<CameraTimes>> times_of(const SocketRig& sent) {
  std::vector<CameraTimes> out(static_cast<std::size_t>(sent.cameras), {.time_offset_s = sent.pair.time_offset_s});
  if (!sent.times) return out;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const FbvinsSocketTimes& times = (*sent.times)[i];
    if (!(std::abs(times.time_offset_s) <= kLargestOffset_s) || !std::isfinite(times.line_delay_s))
      return wrong_rig(fmt::format("camera {}'s time offset is more than 10 s, or its line delay not finite", i));
    out[i] = {times.time_offset_s, times.line_delay_s};
  }
  return out;
}

FbvinsSocketCamera camera_message(const Camera& camera, const Pose<B, C0>& mounting) {
  FbvinsSocketCamera out{};
  // In the order of LensModel.
  constexpr std::uint32_t kModels[] = {FBVINS_SOCKET_RADTAN, FBVINS_SOCKET_EQUIDISTANT, FBVINS_SOCKET_DOUBLE_SPHERE,
                                       FBVINS_SOCKET_EXTENDED_UNIFIED};
  const std::array<double, 4> f = camera.intrinsics();
  const std::vector<double> k = camera.distortion();
  assert(camera.model().index() < std::size(kModels) && k.size() <= std::size(out.distortion));
  out.model = kModels[camera.model().index()];
  out.focal_px[0] = f[0], out.focal_px[1] = f[1], out.centre_px[0] = f[2], out.centre_px[1] = f[3];
  std::copy(k.begin(), k.end(), out.distortion);
  Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> T_BC(out.T_BC);
  T_BC.leftCols<3>() = mounting.q.toRotationMatrix();
  T_BC.col(3) = mounting.p;
  return out;
}

}  // namespace

bool same(const SocketRig& a, const SocketRig& b) {
  return a.cameras == b.cameras && std::memcmp(&a.pair, &b.pair, sizeof(a.pair)) == 0 &&
         std::memcmp(a.more.data(), b.more.data(), sizeof(a.more)) == 0 && a.depth.has_value() == b.depth.has_value() &&
         (!a.depth || std::memcmp(&*a.depth, &*b.depth, sizeof(*a.depth)) == 0) && a.depth_width_px == b.depth_width_px &&
         a.depth_height_px == b.depth_height_px && std::memcmp(&a.depth_camera, &b.depth_camera, sizeof(a.depth_camera)) == 0 &&
         a.times.has_value() == b.times.has_value() &&
         (!a.times || std::memcmp(a.times->data(), b.times->data(), sizeof(*a.times)) == 0);
}

Result<StereoRig> parse_socket_rig(const SocketRig& sent, int width_px, int height_px) {
  const FbvinsSocketRig& rig = sent.pair;
  std::vector<MountedCamera> cameras;
  for (int i = 0; i < sent.cameras; ++i) {
    const FbvinsSocketCamera& camera = i == 0 ? rig.left : i == 1 ? rig.right : sent.more[static_cast<std::size_t>(i - 2)];
    const std::string side = i == 0 ? "left" : i == 1 ? "right" : fmt::format("number {}", i);
    const auto lens = camera_of(camera, width_px, height_px, side);
    if (!lens) return lens.error();
    const auto T_BC = mounting_of(camera, side);
    if (!T_BC) return T_BC.error();
    cameras.push_back({*lens, *T_BC});
  }
  if (Result<void> good = check_figures(rig); !good) return good.error();
  const ImuNoise noise{rig.gyro_noise_density_radps_rthz, rig.accel_noise_density_mps2_rthz, rig.gyro_random_walk_radps2_rthz,
                       rig.accel_random_walk_mps3_rthz, rig.imu_rate_hz};
  const auto times = times_of(sent);
  if (!times) return times.error();
  StereoRig out = with_times(with_cameras({}, cameras), *times);
  out.imu_noise = noise;
  out.image_rate_hz = rig.image_rate_hz;
  if (const auto& d = sent.depth) {
    DepthSensor sensor{d->noise_at_1m_m, d->nearest_m, d->farthest_m, d->scale_sigma};
    if (sent.depth_width_px > 0) {
      const auto lens = camera_of(sent.depth_camera, sent.depth_width_px, sent.depth_height_px, "depth");
      if (!lens) return lens.error();
      const auto T_BC = mounting_of(sent.depth_camera, "depth");
      if (!T_BC) return T_BC.error();
      sensor.own = MountedCamera{*lens, *T_BC};
    }
    out = with_depth(out, sensor);
  }
  if (Result<void> good = check_rig(out, "calibration"); !good) return good.error();
  return out;
}

SocketRig socket_rig(const StereoRig& rig) {
  const auto message = [&](int camera) { return camera_message(rig.camera(camera), rig.T_BC(camera)); };
  SocketRig out{{message(0), rig.has_right() ? message(1) : FbvinsSocketCamera{}, rig.imu_noise.gyro_noise_density_radps_rthz,
                 rig.imu_noise.gyro_random_walk_radps2_rthz, rig.imu_noise.accel_noise_density_mps2_rthz,
                 rig.imu_noise.accel_random_walk_mps3_rthz, rig.imu_noise.rate_hz, rig.image_rate_hz, rig.time_offset_s},
                rig.camera_count()};
  for (int i = 2; i < rig.camera_count(); ++i) out.more[static_cast<std::size_t>(i - 2)] = message(i);
  if (has_rolling_shutter(rig) || !own_offsets(rig).all_zero()) {
    out.times.emplace();
    for (int i = 0; i < rig.camera_count(); ++i)
      (*out.times)[static_cast<std::size_t>(i)] = {rig.times(i).time_offset_s, rig.times(i).line_delay_s};
  }
  if (const auto& d = rig.depth) out.depth = FbvinsSocketDepth{d->noise_at_1m_m, d->nearest_m, d->farthest_m, d->scale_sigma};
  if (rig.depth && rig.depth->own) {
    const auto& [camera, T_BC] = *rig.depth->own;
    out.depth_camera = camera_message(camera, T_BC);
    out.depth_width_px = camera.width(), out.depth_height_px = camera.height();
  }
  return out;
}

}  // namespace fbvins
