// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/imu_camera_gather.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "fbvins/calibration/board_pose.hpp"
#include "fbvins/calibration/detections_file.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kFewestCorners = 8;
constexpr double kShortest_s = 8;
constexpr std::size_t kFewestViews = 40;
constexpr double kPoorFit = 2.5;               // of a pose, over the median
constexpr double kWorstFit_px = 4;             // median over the images of one camera
constexpr double kStray_sigmas = 6, kStray_px = 1;
constexpr double kMargin_s = 0.2;              // of the path before the first and after the last image
constexpr double kAlone_s = 2;                 // readings further than that from an image with the board are not used
constexpr double kWeakestTurning_radps = 0.1;  // spread about the second axis
constexpr double kBiasNode_s = 0.5;
constexpr double kDefaultSpacing_s = 0.02;
constexpr int kRowGroups = 16;
constexpr double kDegree = std::numbers::pi / 180;

Error error(std::string message) { return {ErrorCode::invalid_argument, std::move(message)}; }

template <class Values>
double median(Values values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

std::optional<Error> check_input(const ImuCameraInput& input) {
  if (input.cameras.empty() || static_cast<int>(input.cameras.size()) > kMostCameras)
    return error(fmt::format("{} cameras are given: one to {} can be calibrated", input.cameras.size(), kMostCameras));
  if (!input.T_CnC0.empty() && input.T_CnC0.size() != input.cameras.size())
    return error(fmt::format("{} cameras, but {} poses relative to the first one", input.cameras.size(), input.T_CnC0.size()));
  for (const BoardView& view : input.views) {
    if (view.camera < 0 || view.camera >= static_cast<int>(input.cameras.size()))
      return error(fmt::format("a view is of camera {}, but {} are given", view.camera, input.cameras.size()));
    for (const BoardCorner& corner : view.corners)
      if (corner.index < 0 || corner.index >= input.board.corner_count() || !corner.pixel.allFinite())
        return error(fmt::format("corner {} is seen, but the board has corners 0 to {}", corner.index, input.board.corner_count() - 1));
  }
  if (input.imu.size() < 2) return error("there are no IMU readings");
  for (std::size_t i = 0; i < input.imu.size(); ++i) {
    if (!input.imu[i].gyro_radps.allFinite() || !input.imu[i].accel_mps2.allFinite())
      return error(fmt::format("IMU reading {} is not a number", i));
    if (i > 0 && input.imu[i].t <= input.imu[i - 1].t) return error(fmt::format("IMU reading {} is not later than the one before", i));
  }
  return std::nullopt;
}

/// The poses of each camera, by time; some may be wrong.
Result<std::vector<std::vector<SeenPose>>> locate_all(const ImuCameraInput& input, Time reference) {
  std::vector<std::vector<SeenPose>> poses(input.cameras.size());
  std::vector<std::size_t> seen(input.cameras.size(), 0);
  for (const BoardView& view : input.views) {
    const auto c = static_cast<std::size_t>(view.camera);
    if (view.corners.size() < kFewestCorners) continue;
    ++seen[c];
    if (const auto pose = find_board_pose(input.cameras[c], input.board, view.corners))
      poses[c].push_back({view.camera, (view.t - reference).seconds(), pose->T_CnT.inverse(), pose->rms_px});
  }
  for (std::size_t c = 0; c < poses.size(); ++c) {
    if (seen[c] >= kFewestViews && 2 * poses[c].size() < seen[c])
      return error(fmt::format("the corners that camera {} sees do not lie as on this board: is it the right board file and the right lens?", c));
    if (poses[c].size() < kFewestViews)
      return error(fmt::format("camera {} shows the board in {} images with at least {} corners: {} are needed", c, poses[c].size(),
                               kFewestCorners, kFewestViews));
    std::sort(poses[c].begin(), poses[c].end(), [](const SeenPose& a, const SeenPose& b) { return a.t_s < b.t_s; });
    std::vector<double> fits;
    for (const SeenPose& pose : poses[c]) fits.push_back(pose.sigma_px);
    if (const double fit = median(fits); fit > kWorstFit_px)
      return error(fmt::format("the corners that camera {} sees do not lie as on this board ({:.1f} px off, in the median): is it the right "
                               "board file and the right lens?", c, fit));
  }
  return poses;
}

/// Those that fit as well as most: of a few corners or blurred ones a pose may be far off.
std::vector<std::vector<SeenPose>> good_ones(std::vector<std::vector<SeenPose>> poses) {
  for (std::vector<SeenPose>& camera : poses) {
    std::vector<double> fits;
    for (const SeenPose& pose : camera) fits.push_back(pose.sigma_px);
    const double limit_px = kPoorFit * median(fits);
    std::erase_if(camera, [&](const SeenPose& pose) { return pose.sigma_px > limit_px; });
  }
  return poses;
}

Result<TurnMatch> check_turns(const TurnMatch& match) {
  const double degrees = 1 / kDegree;
  if (match.gain > 0.7 * degrees && match.gain < 1.4 * degrees)
    return error(fmt::format("the gyroscope turns {:.1f} times as fast as the camera: it gives degrees/s, rad/s are needed", match.gain));
  if (match.gain > 1.25 || match.gain < 0.8)
    return error(fmt::format("the gyroscope turns {:.3g} times as fast as the camera: its unit or scale is wrong", match.gain));
  if (match.spread_radps(0) < 2 * kWeakestTurning_radps)
    return error(fmt::format("the rig was hardly turned ({:.1f}, {:.1f} and {:.1f} degrees/s about its axes): turn it quickly about all three",
                             match.spread_radps(0) * degrees, match.spread_radps(1) * degrees, match.spread_radps(2) * degrees));
  if (match.spread_radps(1) < kWeakestTurning_radps)
    return error(fmt::format("the rig was turned about one axis only ({:.1f} degrees/s about the next one): turn it about all three",
                             match.spread_radps(1) * degrees));
  return match;
}

/// Of a camera on the first one, from images of both at the same time; nullopt without such.
std::optional<Pose<C0, Cn>> seen_from_first(const std::vector<SeenPose>& first, const std::vector<SeenPose>& other) {
  std::vector<Pose<C0, Cn>> all;
  std::size_t i = 0;
  for (const SeenPose& pose : other) {
    while (i < first.size() && first[i].t_s < pose.t_s - 1e-4) ++i;
    if (i < first.size() && std::abs(first[i].t_s - pose.t_s) <= 1e-4)
      all.push_back((first[i].T_TC.inverse() * pose.T_TC).cast_frames<C0, Cn>());
  }
  if (all.size() < 5) return std::nullopt;
  // The one that is nearest to all others in each number: medians of position, and of turns against any one of them.
  const Quat q0 = all[all.size() / 2].q;
  Vec3 p, turn;
  for (int k = 0; k < 3; ++k) {
    std::vector<double> ps, turns;
    for (const auto& pose : all) ps.push_back(pose.p(k)), turns.push_back(so3_log(q0.conjugate() * pose.q)(k));
    p(k) = median(ps), turn(k) = median(turns);
  }
  return Pose<C0, Cn>((q0 * so3_exp(turn)).normalized(), p);
}

Result<std::vector<Pose<B, Cn>>> first_extrinsics(const ImuCameraInput& input, const std::vector<std::vector<SeenPose>>& poses,
                                                  const GyroIntegral& gyro, const TurnMatch& match) {
  std::vector<Pose<B, Cn>> T_BC = {{match.R_BC, Vec3(Vec3::Zero())}};
  const Pose<B, C0> first = T_BC[0].cast_frames<B, C0>();
  for (std::size_t c = 1; c < input.cameras.size(); ++c) {
    if (!input.T_CnC0.empty()) {
      T_BC.push_back(first * input.T_CnC0[c].inverse());
    } else if (const auto together = seen_from_first(poses[0], poses[c])) {
      T_BC.push_back(first * *together);
    } else {
      const auto own = match_turns_at(poses[c], gyro, match.time_offset_s);
      if (!own || own->agreement < 0.75)
        return error(fmt::format("camera {} does not turn as camera 0 and the IMU do: is it of the same recording?", c));
      T_BC.push_back({own->R_BC, Vec3(Vec3::Zero())});
    }
  }
  return T_BC;
}

/// Where the body was at the images, one pose an instant, on the IMU's clock.
std::vector<BodyPose> body_poses(const std::vector<std::vector<SeenPose>>& poses, const std::vector<Pose<B, Cn>>& T_BC, double offset_s) {
  std::map<long, SeenPose> by_time;  // in steps of 0.1 ms
  for (const auto& camera : poses)
    for (const SeenPose& pose : camera) {
      const auto [at, fresh] = by_time.emplace(std::lround(pose.t_s * 1e4), pose);
      if (!fresh && pose.sigma_px < at->second.sigma_px) at->second = pose;
    }
  std::vector<BodyPose> out;
  for (const auto& [step, pose] : by_time)
    out.push_back({pose.t_s + offset_s, pose.T_TC * T_BC[static_cast<std::size_t>(pose.camera)].inverse()});
  return out;
}

double rate_of(const std::vector<ImuSample>& imu) {
  std::vector<double> periods;
  for (std::size_t i = 0; i + 1 < imu.size(); ++i) periods.push_back((imu[i + 1].t - imu[i].t).seconds());
  return 1 / median(periods);
}

/// Corners of neighbouring rows, which are exposed nearly at once, where a line delay is estimated; else all.
std::vector<CalibrationView> views_of(const ImuCameraInput& input, const BoardView& view, double t_s, bool by_rows) {
  const int groups = by_rows ? kRowGroups : 1;
  const double height = std::max(1, input.cameras[static_cast<std::size_t>(view.camera)].height());
  std::vector<CalibrationView> out(static_cast<std::size_t>(groups), {view.camera, t_s, 0, 1, 1, {}});
  for (const BoardCorner& corner : view.corners) {
    const int group = std::clamp(static_cast<int>(corner.pixel.y() / height * groups), 0, groups - 1);
    out[static_cast<std::size_t>(group)].corners.push_back({corner.index, input.board.corner(corner.index), corner.pixel});
  }
  std::erase_if(out, [](const CalibrationView& v) { return v.corners.empty(); });
  for (CalibrationView& v : out) {
    for (const WeightedCorner& corner : v.corners) v.row += corner.pixel.y() / static_cast<double>(v.corners.size());
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

}  // namespace

Result<CalibrationStart> gather_imu_camera(const ImuCameraInput& input, const ImuCameraOptions& options) {
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
  auto T_BC = first_extrinsics(input, poses, gyro, *match);
  if (!T_BC) return T_BC.error();
  std::vector<BodyPose> body = body_poses(*located, *T_BC, match->time_offset_s);

  // The path covers what readings and images have in common; its time 0 is `begin_s` after the first reading.
  const double begin_s = std::max(gyro.first_s(), body.front().t_s - kMargin_s);
  const double end_s = std::min(gyro.last_s(), body.back().t_s + kMargin_s);
  if (end_s - begin_s < kShortest_s)
    return error(fmt::format("images of the board and readings have {:.1f} s in common: {:g} s at least, better a minute, are needed",
                             std::max(0.0, end_s - begin_s), kShortest_s));
  for (BodyPose& pose : body) pose.t_s -= begin_s;
  std::erase_if(body, [&](const BodyPose& p) { return p.t_s < 0 || p.t_s > end_s - begin_s; });
  CalibrationData data;
  data.cameras = input.cameras;
  for (const ImuSample& s : input.imu)
    if (const double t_s = (s.t - origin).seconds() - begin_s; t_s >= 0 && t_s <= end_s - begin_s)
      data.readings.push_back({t_s, s.gyro_radps, s.accel_mps2});
  body = agreeing_with_gyro(body, data.readings, match->gyro_bias_radps);
  if (body.size() < kFewestViews) return error("the board's poses do not follow the turns of the IMU: is it the right board file?");

  std::map<std::pair<int, std::int64_t>, const SeenPose*> fits;
  for (const auto& camera : *located)
    for (const SeenPose& pose : camera) fits[{pose.camera, std::llround(pose.t_s * 1e6)}] = &pose;
  std::vector<double> sigmas;
  for (const BoardView& view : input.views) {
    const double t_s = (view.t - origin).seconds(), at_s = t_s + match->time_offset_s - begin_s;
    const auto fit = fits.find({view.camera, std::llround(t_s * 1e6)});
    if (fit == fits.end() || at_s < 0.25 * kMargin_s || at_s > end_s - begin_s - 0.25 * kMargin_s) continue;
    sigmas.push_back(fit->second->sigma_px);
    for (CalibrationView& v : views_of(input, view, t_s - begin_s, options.line_delay)) {
      leave_out_strays(input.cameras[static_cast<std::size_t>(v.camera)], *fit->second, v);
      data.views.push_back(std::move(v));
    }
  }
  std::map<double, int> sharing;
  for (const CalibrationView& view : data.views) ++sharing[view.t_s];
  for (CalibrationView& view : data.views) view.sharing = sharing[view.t_s];
  for (CalibrationReading& r : data.readings) {
    const auto next = std::lower_bound(body.begin(), body.end(), r.t_s, [](const BodyPose& p, double t) { return p.t_s < t; });
    r.used = (next != body.end() && next->t_s - r.t_s < kAlone_s) || (next != body.begin() && r.t_s - std::prev(next)->t_s < kAlone_s);
  }

  const double rate_hz = rate_of(input.imu);
  const double spacing_s = options.knot_spacing_s > 0 ? options.knot_spacing_s : std::max(kDefaultSpacing_s, 2.0 / rate_hz);
  PoseSpline path = first_path(body, data.readings, match->gyro_bias_radps, spacing_s, end_s - begin_s);
  CalibrationState state{.path = std::move(path), .biases = {}, .T_BC = *std::move(T_BC), .axes = {}};
  state.intervals_per_bias = std::max(1, static_cast<int>(std::lround(kBiasNode_s / spacing_s)));
  state.biases.assign(static_cast<std::size_t>((state.path.intervals() - 1) / state.intervals_per_bias + 2),
                      {match->gyro_bias_radps, Vec3::Zero()});
  state.time_offset_s = match->time_offset_s;
  Vec3 force_T = Vec3::Zero();
  for (const CalibrationReading& r : data.readings) force_T += state.path.at(r.t_s).T_TB.q * r.accel_mps2 / static_cast<double>(data.readings.size());
  state.gravity_T = -force_T;
  if (force_T.norm() > 0.8 && force_T.norm() < 1.2)
    return error(fmt::format("gravity is measured as {:.2f}: the accelerometer gives g, m/s^2 are needed", force_T.norm()));

  CalibrationSetup setup;
  setup.corner_sigma_px = std::max(0.02, median(sigmas));
  setup.gyro_sigma_radps = input.noise.gyro_noise_density_radps_rthz * std::sqrt(rate_hz);
  setup.accel_sigma_mps2 = input.noise.accel_noise_density_mps2_rthz * std::sqrt(rate_hz);
  setup.gyro_walk_radps2_rthz = input.noise.gyro_random_walk_radps2_rthz;
  setup.accel_walk_mps3_rthz = input.noise.accel_random_walk_mps3_rthz;
  setup.gravity_mps2 = options.gravity_mps2;
  setup.T_CnC0 = input.T_CnC0;
  setup.camera_sigma_m = options.camera_sigma_m, setup.camera_sigma_rad = options.camera_sigma_rad;
  setup.free_axes = options.imu_axes, setup.free_line_delay = options.line_delay;
  const double gyro_sigma = setup.gyro_sigma_radps, accel_sigma = setup.accel_sigma_mps2;
  return CalibrationStart{origin + Duration::from_seconds(begin_s), std::move(data), std::move(state), std::move(setup), gyro_sigma,
                          accel_sigma, match->spread_radps};
}

}  // namespace fbvins
