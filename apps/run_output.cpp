// SPDX-License-Identifier: Apache-2.0
#include "apps/run_output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <limits>
#include <mutex>
#include <utility>

#include "fbvins/core/atomic_file.hpp"
#include "fbvins/io/trajectory.hpp"

namespace fbvins::app {
namespace {

constexpr const char* kStatisticsHeader =
    "#timestamp [ns],frame,tracked,detected,stereo,lost_flow,lost_check,lost_epipolar,matches,match_inliers,raw_matches,raw_match_inliers,expected,recognised,brightness_left,brightness_right,"
    "median_motion [px],window_frames,landmarks,known_landmarks,observations,iterations,outliers,initial_cost,final_cost,keyframe,standstill\n";
constexpr const char* kTimingHeader =
    "#timestamp [ns],frame,pyramid [ms],track [ms],stereo [ms],detect [ms],geometry [ms],boost [ms],prepare [ms],solve [ms],marginalise [ms]\n";

constexpr const char* kTruthHeader =
    "#timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z [],v_x [m s^-1],v_y [m s^-1],v_z [m s^-1],"
    "b_gyro_x [rad s^-1],b_gyro_y [rad s^-1],b_gyro_z [rad s^-1],b_accel_x [m s^-2],b_accel_y [m s^-2],b_accel_z [m s^-2]\n";

std::string covariance_header() {
  std::string header = "#timestamp [ns]";
  for (const char* what : {"v", "b_gyro", "b_accel"})
    for (const char* axes : {"x_x", "x_y", "x_z", "y_y", "y_z", "z_z"}) header += fmt::format(",cov_{}_{}", what, axes);
  return header + "\n";
}

std::string covariance_row(const Odometry& o) {
  std::string row = fmt::format("{}", o.t.ns);
  if (!o.health.has_pose()) {
    for (int i = 0; i < 3 * 6; ++i) row += ",nan";
    return row + "\n";
  }
  for (const Mat3* m : {&o.velocity_covariance, &o.gyro_bias_covariance, &o.accel_bias_covariance})
    for (int i = 0; i < 3; ++i)
      for (int j = i; j < 3; ++j) row += fmt::format(",{:.9e}", (*m)(i, j));
  return row + "\n";
}

constexpr const char* kGaugeHeader =
    "#timestamp [ns],p_GB_x [m],p_GB_y [m],p_GB_z [m],q_GB_w [],q_GB_x [],q_GB_y [],q_GB_z [],"
    "v_GB_x [m s^-1],v_GB_y [m s^-1],v_GB_z [m s^-1],q_LG_w [],q_LG_x [],q_LG_y [],q_LG_z [],"
    "up_sigma [rad],tilt_sigma [rad],level\n";

std::string gauge_row(const Odometry& o) {
  const GaugeState& g = o.gauge;
  const auto text = [](const auto&... x) {
    std::string out;
    ((out += fmt::format(",{:.9f}", x)), ...);
    return out;
  };
  const Pose<G, B>& T = g.T_GB;
  return fmt::format("{}{}{}{}{}{},{}\n", o.t.ns, text(T.p.x(), T.p.y(), T.p.z()), text(T.q.w(), T.q.x(), T.q.y(), T.q.z()),
                     text(g.v_GB.x(), g.v_GB.y(), g.v_GB.z()), text(g.q_LG.w(), g.q_LG.x(), g.q_LG.y(), g.q_LG.z()),
                     text(g.up_sigma_rad, o.tilt_sigma_rad), o.level ? 1 : 0);
}

std::string frontend_columns(const FrontendStats& s) {
  return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}", s.tracked, s.detected, s.stereo, s.lost_flow, s.lost_check,
                     s.lost_epipolar, s.matches.found, s.matches.inliers, s.raw_matches.found, s.raw_matches.inliers, s.expected,
                     s.recognised, s.mean_brightness_left, s.mean_brightness_right, s.median_motion_px);
}

std::string estimator_columns(const EstimatorStats& s) {
  return fmt::format("{},{},{},{},{},{},{},{},{},{}", s.frames_in_window, s.landmarks, s.known_landmarks, s.observations,
                     s.iterations, s.outliers, s.initial_cost, s.final_cost, s.keyframe ? 1 : 0, s.standstill ? 1 : 0);
}

std::string statistics_row(const TrackedRecord& tracked, const EstimatorStats& e) {
  return fmt::format("{},{},{},{}\n", tracked.t.ns, tracked.id.value, frontend_columns(tracked.stats), estimator_columns(e));
}

std::string timing_row(const TrackedRecord& tracked, const EstimatorStats& e) {
  const FrontendStats& f = tracked.stats;
  return fmt::format("{},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f}\n", tracked.t.ns, tracked.id.value,
                     f.pyramid_ms, f.track_ms, f.stereo_ms, f.detect_ms, f.geometry_ms, f.boost_ms, e.prepare_ms, e.solve_ms,
                     e.marginalise_ms);
}

/// The stamp and seven columns, or sixteen if the truth has velocity and biases.
std::string truth_row(const TrajectoryPoint& point) {
  const Quat& q = point.T_WB.q;
  std::string row = fmt::format("{}", point.t.ns);
  const auto append = [&](const Vec3& v) { row += fmt::format(",{:.9f},{:.9f},{:.9f}", v.x(), v.y(), v.z()); };
  append(point.T_WB.p);
  row += fmt::format(",{:.9f},{:.9f},{:.9f},{:.9f}", q.w(), q.x(), q.y(), q.z());
  if (point.v_WB && point.bias) append(*point.v_WB), append(point.bias->gyro_radps), append(point.bias->accel_mps2);
  return row + "\n";
}

}  // namespace

Trajectory<W> RunRecord::poses() const {
  Trajectory<W> trajectory;
  for (const Odometry& o : odometry)
    if (o.health.has_pose()) trajectory.push_back({o.t, o.T_WB});
  return trajectory;
}

std::vector<Time> RunRecord::images() const {
  std::vector<Time> stamps;
  for (const Odometry& o : odometry) stamps.push_back(o.t);
  return stamps;
}

struct RunWriter::State {
  TumWriter tum;
  OdometryCsvWriter csv;
  OutputFile covariance, gauge, statistics, timing;
  std::mutex mutex;                            ///< guards the next one
  std::deque<TrackedRecord> without_odometry;  ///< frames whose odometry has not come yet

  std::vector<TrackedRecord> take_until(FrameId last) {
    const std::lock_guard lock(mutex);
    const auto end = std::ranges::find_if(without_odometry, [&](const TrackedRecord& tracked) { return last < tracked.id; });
    std::vector<TrackedRecord> taken(without_odometry.begin(), end);
    without_odometry.erase(without_odometry.begin(), end);
    return taken;
  }

  void write(const TrackedRecord& tracked, const EstimatorStats& stats) {
    statistics.write(statistics_row(tracked, stats));
    timing.write(timing_row(tracked, stats));
  }
};

Result<RunWriter> RunWriter::create(const std::string& folder) {
  auto tum = TumWriter::create(folder + "/trajectory_tum.txt");
  if (!tum) return tum.error();
  auto csv = OdometryCsvWriter::create(folder + "/trajectory.csv");
  if (!csv) return csv.error();
  auto covariance = OutputFile::create(folder + "/covariance.csv");
  if (!covariance) return covariance.error();
  auto gauge = OutputFile::create(folder + "/gauge.csv");
  if (!gauge) return gauge.error();
  auto statistics = OutputFile::create(folder + "/statistics.csv");
  if (!statistics) return statistics.error();
  auto timing = OutputFile::create(folder + "/timing.csv");
  if (!timing) return timing.error();
  covariance->write(covariance_header());
  gauge->write(kGaugeHeader);
  statistics->write(kStatisticsHeader);
  timing->write(kTimingHeader);
  return RunWriter(std::unique_ptr<State>(new State{std::move(*tum),
                                                    std::move(*csv),
                                                    std::move(*covariance),
                                                    std::move(*gauge),
                                                    std::move(*statistics),
                                                    std::move(*timing),
                                                    {},
                                                    {}}));
}

RunWriter::RunWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
RunWriter::RunWriter(RunWriter&&) noexcept = default;
RunWriter& RunWriter::operator=(RunWriter&&) noexcept = default;
RunWriter::~RunWriter() = default;

void RunWriter::add(const TrackedRecord& tracked) {
  const std::lock_guard lock(state_->mutex);
  state_->without_odometry.push_back(tracked);
}

/// A frame that the estimator skipped gets a row with zeros in the estimator's columns. The disk is waited for without the mutex,
/// which the frontend's thread takes, too.
void RunWriter::add(const Odometry& o) {
  if (o.health.has_pose()) {
    state_->tum.write(o.t, o.T_WB);
    state_->gauge.write(gauge_row(o));
  }
  state_->csv.write(o);
  state_->covariance.write(covariance_row(o));
  for (const TrackedRecord& tracked : state_->take_until(o.id))
    state_->write(tracked, tracked.id == o.id ? o.stats : EstimatorStats{});
}

Result<void> RunWriter::close() {
  for (const TrackedRecord& tracked : state_->take_until({std::numeric_limits<std::int64_t>::max()})) state_->write(tracked, {});
  Result<void> first;
  for (Result<void> done : {state_->tum.close(), state_->csv.close(), state_->covariance.close(), state_->gauge.close(),
                            state_->statistics.close(), state_->timing.close()})
    if (first && !done) first = done;
  return first;
}

Result<void> write_run(const RunRecord& record, const std::string& folder) {
  auto writer = RunWriter::create(folder);
  if (!writer) return writer.error();
  for (const TrackedRecord& tracked : record.tracked) writer->add(tracked);
  for (const Odometry& o : record.odometry) writer->add(o);
  return writer->close();
}

Result<void> write_truth(const std::vector<Time>& images, const std::vector<TrajectoryPoint>& truth, const std::string& folder) {
  const auto earlier = [](const TrajectoryPoint& p, Time t) { return p.t < t; };
  std::string text = kTruthHeader;
  auto next = truth.begin();  // points before it are written or not needed
  for (const Time image : images) {
    const auto after = std::lower_bound(truth.begin(), truth.end(), image, earlier);
    const auto from = after == truth.begin() ? after : after - 1, to = after == truth.end() ? after : after + 1;
    for (auto p = std::max(next, from); p < to; ++p) text += truth_row(*p);
    next = std::max(next, to);
  }
  return write_file_atomically(folder + "/ground_truth.csv", text);
}

}  // namespace fbvins::app
