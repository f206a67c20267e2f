// SPDX-License-Identifier: Apache-2.0
#include "fbvins/boards/board_flight.hpp"

#include <fmt/format.h>

#include <cmath>
#include <future>

#include "fbvins/calibration/board_image.hpp"
#include "fbvins/calibration/simulated_board.hpp"
#include "fbvins/calibration/target_file.hpp"
#include "fbvins/core/angle.hpp"
#include "fbvins/core/atomic_file.hpp"
#include "fbvins/sim/euroc_writer.hpp"
#include "fbvins/sim/imu_model.hpp"

namespace fbvins {
namespace {

constexpr std::int64_t kStart_ns = 1'000'000'000'000;

/// A number from 0 to 1 of a lattice point.
double hashed(int a, int b, int c) {
  auto h = static_cast<std::uint32_t>(a) * 0x9E3779B1u ^ static_cast<std::uint32_t>(b) * 0x85EBCA77u ^
           static_cast<std::uint32_t>(c) * 0xC2B2AE3Du;
  h = (h ^ (h >> 15u)) * 0x2C1B3C6Du;
  return ((h ^ (h >> 13u)) & 0xFFFFu) / 65535.0;
}

double smooth_noise(double u, double v, int wall) {
  const double fu = std::floor(u), fv = std::floor(v), x = u - fu, y = v - fv, sx = x * x * (3 - 2 * x), sy = y * y * (3 - 2 * y);
  const auto at = [&](int i, int j) { return hashed(static_cast<int>(fu) + i, static_cast<int>(fv) + j, wall); };
  return (1 - sy) * ((1 - sx) * at(0, 0) + sx * at(1, 0)) + sy * ((1 - sx) * at(0, 1) + sx * at(1, 1));
}

/// A plain room: the wall behind the board, two at the sides, floor and ceiling, a far one; cloudy grey.
double room(const Vec3& origin_T, const Vec3& direction_T) {
  const double low[3] = {-2, -1.6, -0.03}, high[3] = {2.8, 1.6, 4};
  double nearest = 1e9;
  int wall = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double to = direction_T[axis] > 0 ? high[axis] : low[axis], along = (to - origin_T[axis]) / direction_T[axis];
    if (along > 0 && along < nearest) nearest = along, wall = 2 * axis + (direction_T[axis] > 0);
  }
  const Vec3 p = origin_T + nearest * direction_T;
  const int axis = wall / 2;
  const double u = p[(axis + 1) % 3], v = p[(axis + 2) % 3];
  return 60 + 15 * wall + 50 * smooth_noise(3 * u, 3 * v, wall) + 20 * smooth_noise(17 * u, 17 * v, wall + 8);
}

/// Poses of the board at four instants of the exposure, about its middle.
BoardCamera::Instants poses(const SplineTrajectory& hand, const Pose<W, T>& T_WT, const Pose<B, Cn>& T_BC, double middle_s,
                            double exposure_s) {
  constexpr int kInstants = 4;
  BoardCamera::Instants out;
  for (int i = 0; i < kInstants; ++i)
    out.push_back((hand.pose(middle_s + exposure_s * ((i + 0.5) / kInstants - 0.5)) * T_BC).inverse() * T_WT);
  return out;
}

Result<BoardPattern> pattern_of(const BoardFlightOptions& options) {
  Result<BoardPattern> pattern = BoardPattern::create(options.board, kKalibrBorder);  // as `fbvins target` prints it
  const int tags = options.board.kind == BoardKind::aprilgrid ? options.board.columns * options.board.rows : 0;
  for (const int tag : options.missing_tags) {
    if (tag < 0 || tag >= tags)
      return Error{ErrorCode::invalid_argument, fmt::format("the board has no tag {}: {}", tag, options.board.describe())};
    if (pattern) pattern->leave_out(tag);
  }
  return pattern;
}

/// Number k, 2 or 3: beside the pair, turned outwards; in `cameras` and `T_CnC0` the second.
SimulatedRig further_camera(const Camera& left, int k) {
  std::vector<double> own = lens_parameters(left.model());
  own[0] *= 1 - 0.003 * k, own[1] *= 1 - 0.003 * k, own[2] -= 3 * k, own[3] += 2 * k;
  const double side = k % 2 == 0 ? 1 : -1;
  return {{left, Camera(with_parameters(left.model(), own.data()), left.width(), left.height())},
          {{}, {so3_exp(Vec3(0.01, -0.1 * side, 0.02)), Vec3(0.055 + 0.11 * side, 0.06, 0.01)}}};
}

/// Nothing of an IMU whose readings are as they should be.
std::string imu_truth(const SimulatedImu& imu) {
  if (imu.gyro_axes.isIdentity(0) && imu.accel_axes.isIdentity(0)) return "";
  const auto rows = [](const Mat3& m) {
    const Mat3 transposed = m.transpose();
    return fmt::format("[{:.9f}]", fmt::join(transposed.data(), transposed.data() + 9, ", "));
  };
  return fmt::format("gyro_axes: {}\naccel_axes: {}\n", rows(imu.gyro_axes), rows(imu.accel_axes));
}

}  // namespace

Result<StereoRig> board_flight_rig(const BoardFlightOptions& options) {
  if (options.cameras < 1 || options.cameras > 4)
    return Error{ErrorCode::invalid_argument, "a board is simulated for 1 to 4 cameras"};
  for (const Camera& left : example_cameras()) {
    if (left.model_name() != options.lens) continue;
    const SimulatedRig cameras = simulated_stereo(left);
    Mat3 R_BC;
    R_BC << 0, -1, 0, 1, 0, 0, 0, 0, 1;
    const Pose<B, C0> T_BC0{Quat(R_BC) * so3_exp(Vec3(0.02, -0.03, 0.015)), Vec3(-0.0216, -0.0647, 0.0098)};
    std::vector<MountedCamera> mounted{{left, T_BC0}};
    for (int k = 1; k < options.cameras; ++k) {
      const SimulatedRig one = k == 1 ? cameras : further_camera(left, k);
      mounted.push_back({one.cameras[1], T_BC0 * one.T_CnC0[1].inverse().cast_frames<C0, C0>()});
    }
    for (std::size_t k = 1; k < mounted.size(); ++k)
      mounted[k].camera.set_own_times({1e-3 * options.later_ms * static_cast<double>(k), 0});
    StereoRig rig = with_cameras({}, mounted);
    rig.image_rate_hz = options.image_rate_hz;
    rig.time_offset_s = 1e-3 * options.time_offset_ms, rig.line_delay_s = 1e-6 * options.line_delay_us;
    return rig;
  }
  return Error{ErrorCode::invalid_argument,
               fmt::format("'{}' is no lens model: {}", options.lens, fmt::join(lens_names(), ", "))};
}

Result<void> simulate_board(const BoardFlightOptions& options, const std::string& folder,
                            const std::function<void(int done, int all)>& progress) {
  const Result<StereoRig> rig = board_flight_rig(options);
  if (!rig) return rig.error();
  const Result<BoardPattern> pattern = pattern_of(options);
  if (!pattern) return pattern.error();
  Result<EurocFolder> recording = create_simulated_recording(folder, *rig);
  if (!recording) return recording.error();
  const auto seed = static_cast<std::uint64_t>(options.seed);
  const SplineTrajectory hand = hand_before_board(options.board, rig->left().focal_px() / rig->left().width(), rig->T_BC0(),
                                                  options.seconds + 1, seed, options.motion);
  const Pose<W, T> T_WT = hanging_board(options.board);
  std::vector<BoardCamera> cameras;
  for (int k = 0; k < rig->camera_count(); ++k) cameras.emplace_back(rig->camera(k), *pattern, room);
  const double exposure_s = 1e-3 * options.exposure_ms;
  const int count = static_cast<int>(options.seconds * options.image_rate_hz);
  for (int i = 0; i < count; ++i) {
    const double middle_s = 0.5 + i / options.image_rate_hz;
    const double light = 1 + 0.15 * std::sin(0.7 * middle_s);
    const BoardImageOptions look{25 * light, 205 * light, options.blur_px, options.noise};
    const auto take = [&](int k) {
      Rng rng(seed, k < 2 ? static_cast<std::uint64_t>(2 * i + k + 1)
                          : static_cast<std::uint64_t>(k) << 32 | static_cast<std::uint64_t>(i));
      const Pose<B, Cn> T_BC = rig->T_BC(k).cast_frames<B, Cn>();
      const auto at = [&](double later_s) {
        return poses(hand, T_WT, T_BC, middle_s + rig->camera(k).own_times().time_offset_s + later_s, exposure_s);
      };
      const BoardCamera& camera = cameras[static_cast<std::size_t>(k)];
      if (rig->line_delay_s == 0) return std::make_shared<const Image>(camera.render(at(0), look, rng));
      const auto of_row = [&](int row) { return at((row - 0.5 * rig->camera(k).height()) * rig->line_delay_s); };  // U4
      return std::make_shared<const Image>(camera.render(of_row, look, rng));
    };
    std::vector<std::future<std::shared_ptr<const Image>>> others;
    for (int k = 1; k < rig->camera_count(); ++k) others.push_back(std::async(std::launch::async, take, k));
    const Time stamp{kStart_ns + std::llround(1e9 * (middle_s - rig->time_offset_s))};
    StereoFrame frame{stamp, {take(0)}};
    for (auto& other : others) frame.images.push_back(other.get());
    if (Result<void> done = recording->add(std::move(frame), stamp); !done) return done;
    if (progress) progress(i + 1, count);
  }
  ImuModelOptions imu;
  imu.scale_error = options.imu_scale, imu.misalignment_rad = options.imu_axes_deg * kDegree;
  imu.vibration_accel_mps2 = imu.vibration_gyro_radps = imu.rumble_accel_mps2_rthz = imu.rumble_gyro_radps_rthz = 0;
  const SimulatedImu readings = simulate_imu(hand, rig->imu_noise, imu, Time{kStart_ns}, seed + 1);
  if (Result<void> done = finish_recording(*recording, readings); !done) return done;
  const std::string truth =
      fmt::format("lens: {}\ntime_offset_s: {}\nseed: {}\nexposure_ms: {}\nblur_px: {}\nnoise: {}\n", options.lens,
                  rig->time_offset_s, options.seed, options.exposure_ms, options.blur_px, options.noise) +
      imu_truth(readings);
  if (Result<void> done = write_file_atomically(folder + "/simulation.yaml", truth); !done) return done;
  return write_file_atomically(folder + "/target.yaml", target_to_yaml(options.board));
}

}  // namespace fbvins
