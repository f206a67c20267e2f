// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_camera_collect.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "fbvins/calibration/imu_camera_poses.hpp"
#include "fbvins/calibration/refused.hpp"
#include "fbvins/core/angle.hpp"
#include "fbvins/core/median.hpp"
#include "fbvins/imu/reading_rate.hpp"

namespace fbvins {
namespace {

constexpr double kShortest_s = 8, kLongest_s = 4 * 3600;
constexpr double kStray_sigmas = 6, kStray_px = 1;
constexpr double kMargin_s = 0.2;              // of the path before the first and after the last image
constexpr double kAlone_s = 2;                 // readings further than that from an image with the board are not used
constexpr double kWeakestTurning_radps = 0.1;  // spread about the second axis
constexpr double kBiasNode_s = 0.5;
constexpr double kDefaultSpacing_s = 0.02;
constexpr int kRowGroups = 16;

/// Stamps of readings and images may differ by a unit, in files from elsewhere.
std::optional<Error> check_stamps(const std::vector<ImuSample>& imu, const std::vector<BoardView>& views) {
  if (views.empty()) return std::nullopt;
  const auto [first, last] =
      std::minmax_element(views.begin(), views.end(), [](const BoardView& a, const BoardView& b) { return a.t < b.t; });
  struct Stamps {
    const char* of;
    double first_s, length_s;
  };
  const Stamps images{"images", first->t.seconds(), (last->t - first->t).seconds()};
  const Stamps readings{"IMU's readings", imu.front().t.seconds(), (imu.back().t - imu.front().t).seconds()};
  for (const auto& [unit, factor] : {std::pair{"microseconds", 1e3}, std::pair{"milliseconds", 1e6}})
    for (const auto& [a, b] : {std::pair{images, readings}, std::pair{readings, images}})
      if (std::abs(factor * a.first_s - b.first_s) < 0.2 * b.first_s && factor * a.length_s > 0.3 * b.length_s &&
          factor * a.length_s < 3 * b.length_s)
        return refused(fmt::format("the stamps of the {} look like {}: nanoseconds are needed", a.of, unit));
  return std::nullopt;
}

/// Gravity is in the accelerometer's columns.
std::optional<Error> check_columns(const std::vector<ImuSample>& imu) {
  const auto count = static_cast<double>(imu.size());
  double gyro = 0, gyro_square = 0, accel = 0;
  for (const ImuSample& s : imu)
    gyro += s.gyro_radps.norm() / count, gyro_square += s.gyro_radps.squaredNorm() / count, accel += s.accel_mps2.norm() / count;
  const bool is_gravity = gyro > 8 && gyro < 12 && gyro_square - gyro * gyro < 9;
  if (!is_gravity || accel > 5) return std::nullopt;
  return refused(fmt::format(
      "gravity is in the gyroscope's readings ({:.1f} in the mean), not in the accelerometer's ({:.1f}): their columns are exchanged",
      gyro, accel));
}

std::optional<Error> check_unit(double gravity) {
  for (const auto& [unit, one] :
       {std::pair{"g", 1.0}, std::pair{"thousandths of g", 1000.0}, std::pair{"cm/s^2", 980.665}, std::pair{"mm/s^2", 9806.65}})
    if (std::abs(gravity / one - 1) < (one == 1 ? 0.2 : 0.01))
      return refused(fmt::format("gravity is measured as {:.4g}: the accelerometer gives {}, m/s^2 are needed", gravity, unit));
  return std::nullopt;
}

std::optional<Error> check_input(const ImuCameraInput& input) {
  if (input.cameras.empty() || static_cast<int>(input.cameras.size()) > kMostCameras)
    return refused(fmt::format("{} cameras are given: one to {} can be calibrated", input.cameras.size(), kMostCameras));
  if (!input.T_CnC0.empty() && input.T_CnC0.size() != input.cameras.size())
    return refused(fmt::format("{} cameras, but {} poses relative to the first one", input.cameras.size(), input.T_CnC0.size()));
  for (const BoardView& view : input.views) {
    if (view.camera < 0 || view.camera >= static_cast<int>(input.cameras.size()))
      return refused(fmt::format("a view is of camera {}, but {} are given", view.camera, input.cameras.size()));
    for (const BoardCorner& corner : view.corners)
      if (corner.index < 0 || corner.index >= input.board.corner_count() || !corner.pixel.allFinite())
        return refused(
            fmt::format("corner {} is seen, but the board has corners 0 to {}", corner.index, input.board.corner_count() - 1));
  }
  if (input.imu.size() < 2) return refused("there are no IMU readings");
  const double length_s = (input.imu.back().t - input.imu.front().t).seconds();
  if (!(length_s < kLongest_s))
    return refused(fmt::format("the stamps of the IMU's readings span {:.0f} hours", length_s / 3600));
  const ImuNoise& noise = input.noise;
  if (!(std::min({noise.gyro_noise_density_radps_rthz, noise.accel_noise_density_mps2_rthz, noise.gyro_random_walk_radps2_rthz,
                  noise.accel_random_walk_mps3_rthz}) > 0))
    return refused("a noise density or random walk of the IMU is not positive");
  for (std::size_t i = 0; i < input.imu.size(); ++i) {
    if (!input.imu[i].gyro_radps.allFinite() || !input.imu[i].accel_mps2.allFinite())
      return refused(fmt::format("IMU reading {} is not a number", i));
    if (i > 0 && input.imu[i].t <= input.imu[i - 1].t)
      return refused(fmt::format("IMU reading {} is not later than the one before", i));
  }
  if (auto wrong = check_stamps(input.imu, input.views)) return wrong;
  return check_columns(input.imu);
}

Result<TurnMatch> check_turns(const TurnMatch& match) {
  const double degrees = 1 / kDegree;
  if (match.gain > 0.7 * degrees && match.gain < 1.4 * degrees)
    return refused(
        fmt::format("the gyroscope turns {:.1f} times as fast as the camera: it gives degrees/s, rad/s are needed", match.gain));
  if (match.gain > 1.25 || match.gain < 0.8)
    return refused(fmt::format("the gyroscope turns {:.3g} times as fast as the camera: its unit or scale is wrong", match.gain));
  if (match.spread_radps(0) < 2 * kWeakestTurning_radps)
    return refused(fmt::format(
        "the rig was hardly turned ({:.1f}, {:.1f} and {:.1f} degrees/s about its axes): turn it quickly about all three",
        match.spread_radps(0) * degrees, match.spread_radps(1) * degrees, match.spread_radps(2) * degrees));
  if (match.spread_radps(1) < kWeakestTurning_radps)
    return refused(
        fmt::format("the rig was turned about one axis only ({:.1f} degrees/s about the next one): turn it about all three",
                    match.spread_radps(1) * degrees));
  return match;
}

/// Corners of neighbouring rows, which are exposed nearly at once, where a line delay is estimated; else all.
std::vector<CalibrationView> views_of(const ImuCameraInput& input, const BoardView& view, double t_s, bool by_rows) {
  const int groups = by_rows ? kRowGroups : 1;
  const double height = std::max(1, input.cameras[static_cast<std::size_t>(view.camera)].height());
  std::vector<CalibrationView> out(static_cast<std::size_t>(groups), {view.camera, t_s, 0, 1, 1, {}});
  for (const BoardCorner& corner : view.corners) {
    const int group = std::clamp(static_cast<int>(corner.pixel.y() / height * groups), 0, groups - 1);
    out[static_cast<std::size_t>(group)].corners.push_back(
        {corner.index, input.board.corner(corner.index), corner.pixel, corner.pixel.y() - 0.5 * height});
  }
  std::erase_if(out, [](const CalibrationView& v) { return v.corners.empty(); });
  for (CalibrationView& v : out) {
    for (const WeightedCorner& corner : v.corners) v.row += corner.row / static_cast<double>(v.corners.size());
    if (!by_rows) v.row = 0;
  }
  return out;
}

/// Corners that are far from where this image's own pose puts them.
void leave_out_strays(const Camera& camera, const SeenPose& pose, CalibrationView& view) {
  const Pose<Cn, T> T_CT = pose.T_TC.inverse();
  for (WeightedCorner& corner : view.corners) {
    const std::optional<Vec2> pixel = camera.project(T_CT * corner.p_T);
    corner.used = pixel && (*pixel - corner.pixel).norm() < kStray_sigmas * pose.sigma_px + kStray_px;
  }
}

/// What readings and images have in common, in seconds from the first reading on.
struct CommonTime {
  double begin_s, end_s;
  double length_s() const { return end_s - begin_s; }
  bool holds(double t_s, double margin_s = 0) const { return t_s >= margin_s && t_s <= length_s() - margin_s; }
};

/// `body` in order of time; seconds from the first reading on.
Result<CommonTime> common_time(const GyroIntegral& gyro, const std::vector<BodyPose>& body) {
  const CommonTime common{std::max(gyro.first_s(), body.front().t_s - kMargin_s),
                          std::min(gyro.last_s(), body.back().t_s + kMargin_s)};
  if (common.length_s() < kShortest_s)
    return refused(
        fmt::format("images of the board and readings have {:.1f} s in common: {:g} s at least, better a minute, are needed",
                    std::max(0.0, common.length_s()), kShortest_s));
  return common;
}

std::vector<CalibrationReading> readings_within(const ImuCameraInput& input, const CommonTime& common) {
  std::vector<CalibrationReading> out;
  for (const ImuSample& s : input.imu)
    if (const double t_s = (s.t - input.imu.front().t).seconds() - common.begin_s; common.holds(t_s))
      out.push_back({t_s, s.gyro_radps, s.accel_mps2});
  return out;
}

/// Views whose image has a pose and lies within the path; returns the standard deviations of their corners, px.
std::vector<double> gather_views(const ImuCameraInput& input, const CameraPoses& located, const CommonTime& common,
                                 const std::vector<double>& offsets_s, bool by_rows, CalibrationData& data) {
  std::map<std::pair<int, std::int64_t>, const SeenPose*> fits;
  for (const auto& camera : located)
    for (const SeenPose& pose : camera) fits[{pose.camera, std::llround(pose.t_s * 1e6)}] = &pose;
  std::vector<double> sigmas;
  for (const BoardView& view : input.views) {
    const double t_s = (view.t - input.imu.front().t).seconds();
    const auto fit = fits.find({view.camera, std::llround(t_s * 1e6)});
    const double offset_s = offsets_s[static_cast<std::size_t>(view.camera)];
    if (fit == fits.end() || !common.holds(t_s + offset_s - common.begin_s, 0.25 * kMargin_s)) continue;
    sigmas.push_back(fit->second->sigma_px);
    for (CalibrationView& v : views_of(input, view, t_s - common.begin_s, by_rows)) {
      leave_out_strays(input.cameras[static_cast<std::size_t>(v.camera)], *fit->second, v);
      data.views.push_back(std::move(v));
    }
  }
  std::map<double, int> sharing;
  for (const CalibrationView& view : data.views) ++sharing[view.t_s];
  for (CalibrationView& view : data.views) view.sharing = sharing[view.t_s];
  return sigmas;
}

/// Readings far from every pose are not used.
void leave_out_alone(const std::vector<BodyPose>& body, std::vector<CalibrationReading>& readings) {
  for (CalibrationReading& r : readings) {
    const auto next = std::lower_bound(body.begin(), body.end(), r.t_s, [](const BodyPose& p, double t) { return p.t_s < t; });
    r.used =
        (next != body.end() && next->t_s - r.t_s < kAlone_s) || (next != body.begin() && r.t_s - std::prev(next)->t_s < kAlone_s);
  }
}

CalibrationState first_state(PoseSpline path, double spacing_s, const std::vector<Pose<B, Cn>>& T_BC, const TurnMatch& match,
                             const std::vector<double>& offsets_s, const std::vector<CalibrationReading>& readings) {
  CalibrationState state{.path = std::move(path), .biases = {}, .T_BC = T_BC, .axes = {}};
  state.intervals_per_bias = std::max(1, static_cast<int>(std::lround(kBiasNode_s / spacing_s)));
  state.biases.assign(static_cast<std::size_t>((state.path.intervals() - 1) / state.intervals_per_bias + 2),
                      {match.gyro_bias_radps, Vec3::Zero()});
  state.time_offset_s = match.time_offset_s;
  for (const double offset_s : offsets_s) state.later_s.push_back(offset_s - match.time_offset_s);
  Vec3 force_T = Vec3::Zero();
  for (const CalibrationReading& r : readings)
    force_T += state.path.at(r.t_s).T_TB.q * r.accel_mps2 / static_cast<double>(readings.size());
  state.gravity_T = -force_T;
  return state;
}

CalibrationSetup setup_of(const ImuCameraInput& input, const ImuCameraOptions& options, double corner_sigma_px, double rate_hz) {
  CalibrationSetup setup;
  setup.corner_sigma_px = std::max(0.02, corner_sigma_px);
  setup.gyro_sigma_radps = input.noise.gyro_noise_density_radps_rthz * std::sqrt(rate_hz);
  setup.accel_sigma_mps2 = input.noise.accel_noise_density_mps2_rthz * std::sqrt(rate_hz);
  setup.gyro_walk_radps2_rthz = input.noise.gyro_random_walk_radps2_rthz;
  setup.accel_walk_mps3_rthz = input.noise.accel_random_walk_mps3_rthz;
  setup.gravity_mps2 = options.gravity_mps2;
  setup.T_CnC0 = input.T_CnC0;
  setup.camera_sigma_m = options.camera_sigma_m, setup.camera_sigma_rad = options.camera_sigma_rad;
  setup.free_axes = options.imu_axes, setup.free_line_delay = options.line_delay;
  setup.free_camera_offsets = options.camera_offsets;
  return setup;
}

/// Of each camera: camera 0's, or by the turns that its own images show.
Result<std::vector<double>> first_offsets(const CameraPoses& poses, const GyroIntegral& gyro, const TurnMatch& match,
                                          const ImuCameraOptions& options) {
  std::vector<double> offsets_s(poses.size(), match.time_offset_s);
  for (std::size_t c = 1; options.camera_offsets && c < poses.size(); ++c) {
    Result<TurnMatch> own = match_turns(poses[c], gyro, options.max_time_offset_s);
    if (own) own = check_turns(*own);
    if (!own) return refused(fmt::format("camera {} alone: {}", c, own.error().message));
    offsets_s[c] = own->time_offset_s;
  }
  return offsets_s;
}

}  // namespace

Result<CalibrationStart> collect_imu_camera(const ImuCameraInput& input, const ImuCameraOptions& options) {
  if (const auto bad = check_input(input)) return *bad;
  const Time origin = input.imu.front().t;
  const auto located = locate_all(input, origin);
  if (!located) return located.error();
  const auto poses = good_ones(*located);
  const GyroIntegral gyro(input.imu, origin);
  const Result<TurnMatch> found = match_turns(poses[0], gyro, options.max_time_offset_s);
  if (!found) return found.error();
  const Result<TurnMatch> match = check_turns(*found);
  if (!match) return match.error();
  const auto T_BC = first_extrinsics(input, poses, gyro, *match);
  if (!T_BC) return T_BC.error();
  const auto offsets_s = first_offsets(poses, gyro, *match, options);
  if (!offsets_s) return offsets_s.error();
  std::vector<BodyPose> body = body_poses(*located, *T_BC, *offsets_s);

  const Result<CommonTime> common = common_time(gyro, body);
  if (!common) return common.error();
  for (BodyPose& pose : body) pose.t_s -= common->begin_s;
  std::erase_if(body, [&](const BodyPose& p) { return !common->holds(p.t_s); });
  CalibrationData data{.cameras = input.cameras, .views = {}, .readings = readings_within(input, *common)};
  if (body.size() < kFewestBoardViews || data.readings.empty())
    return refused(
        fmt::format("the board is seen in {} images while the IMU is there: {} are needed", body.size(), kFewestBoardViews));
  body = agreeing_with_gyro(body, data.readings, match->gyro_bias_radps);
  if (body.size() < kFewestBoardViews)
    return refused("the board's poses do not follow the turns of the IMU: is it the right board file?");

  const std::vector<double> sigmas = gather_views(input, *located, *common, *offsets_s, options.line_delay, data);
  if (data.views.empty()) return refused("no image of the board lies within the readings of the IMU");
  leave_out_alone(body, data.readings);

  const double rate_hz = rate_hz_of(input.imu);
  const double spacing_s = std::max(kDefaultSpacing_s, 2.0 / rate_hz);
  CalibrationState state = first_state(first_path(body, data.readings, match->gyro_bias_radps, spacing_s, common->length_s()),
                                       spacing_s, *T_BC, *match, *offsets_s, data.readings);
  if (auto wrong = check_unit(state.gravity_T.norm())) return *wrong;

  CalibrationSetup setup = setup_of(input, options, median_of(sigmas), rate_hz);
  const double gyro_sigma = setup.gyro_sigma_radps, accel_sigma = setup.accel_sigma_mps2;
  return CalibrationStart{origin + Duration::from_seconds(common->begin_s),
                          std::move(data),
                          std::move(state),
                          std::move(setup),
                          gyro_sigma,
                          accel_sigma,
                          match->spread_radps};
}

}  // namespace fbvins
