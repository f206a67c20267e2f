// SPDX-License-Identifier: Apache-2.0
#include "apps/run_output.hpp"

#include <fmt/format.h>

#include <algorithm>

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
  for (const Mat3* m : {&o.velocity_covariance, &o.gyro_bias_covariance, &o.accel_bias_covariance})
    for (int i = 0; i < 3; ++i)
      for (int j = i; j < 3; ++j) row += fmt::format(",{:.9e}", (*m)(i, j));
  return row + "\n";
}

/// Seven columns, or all sixteen where the truth knows velocity and biases.
std::string truth_row(const TrajectoryPoint& point) {
  const Quat& q = point.T_WB.q;
  std::string row = fmt::format("{}", point.t.ns);
  const auto append = [&](const Vec3& v) { row += fmt::format(",{:.9f},{:.9f},{:.9f}", v.x(), v.y(), v.z()); };
  append(point.T_WB.p);
  row += fmt::format(",{:.9f},{:.9f},{:.9f},{:.9f}", q.w(), q.x(), q.y(), q.z());
  if (point.v_WB && point.bias) append(*point.v_WB), append(point.bias->gyro_radps), append(point.bias->accel_mps2);
  return row + "\n";
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

/// Calls row(tracked, odometry or null) for every frame, joined by id; both lists are in order of id.
template <class Row>
void for_each_frame(const RunRecord& record, const Row& row) {
  auto odometry = record.odometry.begin();
  for (const TrackedRecord& tracked : record.tracked) {
    while (odometry != record.odometry.end() && odometry->id < tracked.id) ++odometry;
    const bool found = odometry != record.odometry.end() && odometry->id == tracked.id;
    row(tracked, found ? &*odometry : nullptr);
  }
}

}  // namespace

Trajectory<W> RunRecord::poses() const {
  Trajectory<W> trajectory;
  for (const Odometry& o : odometry)
    if (o.health.has_pose()) trajectory.push_back({o.t, o.T_WB});
  return trajectory;
}

Result<void> write_text(const std::string& path, const std::string& text) {
  auto file = OutputFile::create(path);
  if (!file) return file.error();
  file->write(text);
  return file->close();
}

Result<void> write_trajectories(const RunRecord& record, const std::string& folder) {
  auto tum = TumWriter::create(folder + "/trajectory_tum.txt");
  if (!tum) return tum.error();
  auto csv = OdometryCsvWriter::create(folder + "/trajectory.csv");
  if (!csv) return csv.error();
  for (const Odometry& o : record.odometry) {
    if (o.health.has_pose()) tum->write(o.t, o.T_WB);
    csv->write(o);
  }
  if (Result<void> done = tum->close(); !done) return done;
  if (Result<void> done = csv->close(); !done) return done;
  std::string covariances = covariance_header();
  for (const Odometry& o : record.odometry) covariances += covariance_row(o);
  return write_text(folder + "/covariance.csv", covariances);
}

Result<void> write_truth(const RunRecord& record, const std::vector<TrajectoryPoint>& truth, const std::string& folder) {
  const auto earlier = [](const TrajectoryPoint& p, Time t) { return p.t < t; };
  std::string text = kTruthHeader;
  auto next = truth.begin();  // what lies before it is written or not wanted
  for (const Odometry& o : record.odometry) {
    const auto after = std::lower_bound(truth.begin(), truth.end(), o.t, earlier);
    const auto from = after == truth.begin() ? after : after - 1, to = after == truth.end() ? after : after + 1;
    for (auto p = std::max(next, from); p < to; ++p) text += truth_row(*p);
    next = std::max(next, to);
  }
  return write_text(folder + "/ground_truth.csv", text);
}

Result<void> write_statistics(const RunRecord& record, const std::string& folder) {
  std::string text = kStatisticsHeader;
  for_each_frame(record, [&](const TrackedRecord& tracked, const Odometry* odometry) {
    text += fmt::format("{},{},{},{}\n", tracked.t.ns, tracked.id.value, frontend_columns(tracked.stats),
                        estimator_columns(odometry ? odometry->stats : EstimatorStats{}));
  });
  return write_text(folder + "/statistics.csv", text);
}

Result<void> write_timing(const RunRecord& record, const std::string& folder) {
  std::string text = kTimingHeader;
  for_each_frame(record, [&](const TrackedRecord& tracked, const Odometry* odometry) {
    const FrontendStats& f = tracked.stats;
    const EstimatorStats e = odometry ? odometry->stats : EstimatorStats{};
    text += fmt::format("{},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f}\n", tracked.t.ns, tracked.id.value,
                        f.pyramid_ms, f.track_ms, f.stereo_ms, f.detect_ms, f.geometry_ms, f.boost_ms, e.prepare_ms, e.solve_ms,
                        e.marginalise_ms);
  });
  return write_text(folder + "/timing.csv", text);
}

}  // namespace fbvins::app
