// SPDX-License-Identifier: Apache-2.0
// The calibration in a sender's hello: parse_socket_rig() and its reverse.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <string>
#include <variant>
#include <vector>

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

struct Lens {
  std::uint32_t model;
  const char* name;  ///< as Camera::model_name() has it
  std::size_t coefficients;
};
/// In the order of LensModel.
constexpr Lens kLenses[] = {{FBVINS_SOCKET_RADTAN, "pinhole-radtan", 4},    {FBVINS_SOCKET_EQUIDISTANT, "pinhole-equidistant", 4},
                            {FBVINS_SOCKET_DOUBLE_SPHERE, "ds", 2},         {FBVINS_SOCKET_EXTENDED_UNIFIED, "eucm", 2},
                            {FBVINS_SOCKET_OMNI_RADTAN, "omni-radtan", 5},  {FBVINS_SOCKET_RADTAN5, "pinhole-radtan5", 5},
                            {FBVINS_SOCKET_RATIONAL, "pinhole-rational", 8}};
static_assert(std::size(kLenses) == std::variant_size_v<LensModel>);

/// `number`: the camera's among those of SocketRig::lenses.
Result<Camera> camera_of(const SocketRig& sent, const FbvinsSocketCamera& c, std::size_t number, int width_px, int height_px,
                         const std::string& side) {
  const double* f = c.focal_px;
  const double* m = c.centre_px;
  const auto lens = std::ranges::find(kLenses, c.model, &Lens::model);
  if (lens == std::end(kLenses)) return wrong_rig(fmt::format("the {} camera has no model {}", side, c.model));
  if (lens->coefficients > 4 && !sent.lenses)
    return wrong_rig(fmt::format("the {} camera's model {} has {} coefficients, which come in more_distortion, since version 1.8",
                                 side, lens->name, lens->coefficients));
  std::vector<double> k(c.distortion, c.distortion + 4);
  if (sent.lenses) k.insert(k.end(), (*sent.lenses)[number].begin(), (*sent.lenses)[number].end());
  k.resize(std::max(lens->coefficients, std::size_t{4}));
  if (!are_finite(f, 2) || !are_finite(m, 2) || !are_finite(k.data(), k.size()) || !(f[0] > 0 && f[1] > 0))
    return wrong_rig(fmt::format("the {} camera's intrinsics are not finite, with positive focal lengths", side));
  k.resize(lens->coefficients);
  if (const std::string problem = outside_of_model(lens->name, k); !problem.empty())
    return wrong_rig(fmt::format("of the {} camera {}", side, problem));
  return Camera(*lens_of(lens->name, {f[0], f[1], m[0], m[1]}, k), width_px, height_px);
}

Mat3 matrix_of(const double (&m)[9]) { return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(m); }

ImuIntrinsics axes_of(const FbvinsSocketImuAxes& sent) {
  return {matrix_of(sent.gyro),
          matrix_of(sent.accel),
          matrix_of(sent.gyro_by_force),
          {.gyro_radps = Vec3(sent.gyro_bias_radps), .accel_mps2 = Vec3(sent.accel_bias_mps2)}};
}

FbvinsSocketImuAxes axes_message(const ImuIntrinsics& axes) {
  FbvinsSocketImuAxes out{};
  using Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const auto put = [](const Mat3& from, double(&to)[9]) { Eigen::Map<Rows>{to} = from; };
  put(axes.gyro, out.gyro), put(axes.accel, out.accel), put(axes.gyro_by_force, out.gyro_by_force);
  Eigen::Map<Vec3>{out.gyro_bias_radps} = axes.bias.gyro_radps;
  Eigen::Map<Vec3>{out.accel_bias_mps2} = axes.bias.accel_mps2;
  return out;
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

/// Its coefficients from the fifth on go to `more`.
FbvinsSocketCamera camera_message(const Camera& camera, const Pose<B, C0>& mounting, std::array<double, 4>& more) {
  FbvinsSocketCamera out{};
  const std::array<double, 4> f = camera.intrinsics();
  const std::vector<double> k = camera.distortion();
  out.model = kLenses[camera.model().index()].model;
  out.focal_px[0] = f[0], out.focal_px[1] = f[1], out.centre_px[0] = f[2], out.centre_px[1] = f[3];
  for (std::size_t i = 0; i < k.size(); ++i) (i < 4 ? out.distortion[i] : more[i - 4]) = k[i];
  Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> T_BC(out.T_BC);
  T_BC.leftCols<3>() = mounting.q.toRotationMatrix();
  T_BC.col(3) = mounting.p;
  return out;
}

}  // namespace

bool same(const SocketRig& a, const SocketRig& b) {
  const auto alike = [](const auto& x, const auto& y) { return std::memcmp(&x, &y, sizeof(x)) == 0; };
  const auto both = [&](const auto& x, const auto& y) { return x.has_value() == y.has_value() && (!x || alike(*x, *y)); };
  return a.cameras == b.cameras && alike(a.pair, b.pair) && alike(a.more, b.more) && both(a.depth, b.depth) &&
         a.depth_width_px == b.depth_width_px && a.depth_height_px == b.depth_height_px &&
         alike(a.depth_camera, b.depth_camera) && both(a.times, b.times) && both(a.lenses, b.lenses) && both(a.axes, b.axes);
}

Result<StereoRig> parse_socket_rig(const SocketRig& sent, int width_px, int height_px) {
  const FbvinsSocketRig& rig = sent.pair;
  std::vector<MountedCamera> cameras;
  for (int i = 0; i < sent.cameras; ++i) {
    const FbvinsSocketCamera& camera = i == 0 ? rig.left : i == 1 ? rig.right : sent.more[static_cast<std::size_t>(i - 2)];
    const std::string side = i == 0 ? "left" : i == 1 ? "right" : fmt::format("number {}", i);
    const auto lens = camera_of(sent, camera, static_cast<std::size_t>(i), width_px, height_px, side);
    if (!lens) return lens.error();
    const auto T_BC = mounting_of(camera, side);
    if (!T_BC) return T_BC.error();
    cameras.push_back({*lens, *T_BC});
  }
  if (Result<void> good = check_figures(rig); !good) return good.error();
  ImuNoise noise{rig.gyro_noise_density_radps_rthz, rig.accel_noise_density_mps2_rthz, rig.gyro_random_walk_radps2_rthz,
                 rig.accel_random_walk_mps3_rthz, rig.imu_rate_hz};
  if (sent.axes) noise.axes = axes_of(*sent.axes);
  const auto times = times_of(sent);
  if (!times) return times.error();
  StereoRig out = with_times(with_cameras({}, cameras), *times);
  out.imu_noise = noise;
  out.image_rate_hz = rig.image_rate_hz;
  if (const auto& d = sent.depth) {
    DepthSensor sensor{d->noise_at_1m_m, d->nearest_m, d->farthest_m, d->scale_sigma};
    if (sent.depth_width_px > 0) {
      const auto lens = camera_of(sent, sent.depth_camera, kMostCameras, sent.depth_width_px, sent.depth_height_px, "depth");
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
  std::array<std::array<double, 4>, kMostCameras + 1> lenses{};
  const auto message = [&](int camera) {
    return camera_message(rig.camera(camera), rig.T_BC(camera), lenses[static_cast<std::size_t>(camera)]);
  };
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
    out.depth_camera = camera_message(camera, T_BC, lenses.back());
    out.depth_width_px = camera.width(), out.depth_height_px = camera.height();
  }
  const auto has_more = [](const Camera& camera) { return camera.distortion().size() > 4; };
  bool more = rig.depth && rig.depth->own && has_more(rig.depth->own->camera);
  for (int i = 0; i < rig.camera_count(); ++i) more |= has_more(rig.camera(i));
  if (more) out.lenses = lenses;
  if (rig.imu_noise.axes != ImuIntrinsics{}) out.axes = axes_message(rig.imu_noise.axes);
  return out;
}

void put_rig(const SocketRig& rig, FbvinsSocketHello& hello) {
  hello.flags |= FBVINS_SOCKET_HAS_RIG;
  hello.rig = rig.pair;
  if (rig.times) {
    hello.flags |= FBVINS_SOCKET_HAS_TIMES;
    std::ranges::copy(*rig.times, hello.times);
  }
  if (rig.lenses) {
    hello.flags |= FBVINS_SOCKET_HAS_LENSES;
    for (std::size_t i = 0; i < rig.lenses->size(); ++i) std::ranges::copy((*rig.lenses)[i], hello.more_distortion[i]);
  }
  if (rig.axes) {
    hello.flags |= FBVINS_SOCKET_HAS_IMU_AXES;
    hello.imu_axes = *rig.axes;
  }
  if (rig.cameras == 2) return;
  hello.flags |= FBVINS_SOCKET_HAS_CAMERAS;
  hello.cameras = static_cast<std::uint32_t>(rig.cameras);
  std::ranges::copy(rig.more, hello.more);
  if (!rig.depth) return;
  hello.flags |= FBVINS_SOCKET_HAS_DEPTH;
  hello.depth = *rig.depth;
  if (rig.depth_width_px == 0) return;
  hello.flags |= FBVINS_SOCKET_HAS_DEPTH_CAMERA;
  hello.depth_camera = rig.depth_camera;
  hello.depth_width_px = static_cast<std::uint32_t>(rig.depth_width_px);
  hello.depth_height_px = static_cast<std::uint32_t>(rig.depth_height_px);
}

}  // namespace fbvins
