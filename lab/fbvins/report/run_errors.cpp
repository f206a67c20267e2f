// SPDX-License-Identifier: Apache-2.0
#include "fbvins/report/run_errors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fbvins/eval/nees.hpp"
#include "fbvins/geometry/heading.hpp"

namespace fbvins {
namespace {

/// Translation and yaw from the estimate to the truth.
Pose<W, W> yaw_between(const Pose<W, B>& truth, const Pose<W, B>& estimate) {
  const Quat about_z(Eigen::AngleAxisd(heading_between(estimate.q, truth.q), Vec3::UnitZ()));
  return {about_z, Vec3(truth.p - about_z * estimate.p)};
}

/// e^T P^-1 e; NaN unless P is positive definite.
double normalised(const Vec3& error, const Mat3& covariance) {
  const Eigen::LLT<Mat3> factor(covariance);
  if (factor.info() != Eigen::Success || !(covariance.diagonal().minCoeff() > 0)) return NAN;
  return error.dot(factor.solve(error));
}

void judge(const Odometry& o, const TrajectoryPoint& truth, const Pose<W, W>& truth_from_w, FrameError& error) {
  const Pose<W, W> w_from_truth = truth_from_w.inverse();
  const Pose<W, B> truth_in_w = w_from_truth * truth.T_WB;
  error.drift_m = o.T_WB.p - truth_in_w.p;
  error.nees = {NAN, NAN, NAN, NAN, NAN};
  if (const Result<PoseNees> pose = pose_nees(truth_in_w, o.T_WB, o.pose_covariance)) {
    error.nees.position = pose->position;
    error.nees.orientation = pose->orientation;
  }
  if (truth.v_WB) {
    error.velocity_error_mps = o.v_WB - w_from_truth.q * *truth.v_WB;
    error.nees.velocity = normalised(error.velocity_error_mps, o.velocity_covariance);
  }
  if (truth.bias) {
    error.bias_error =
        ImuBias{Vec3(o.bias.gyro_radps - truth.bias->gyro_radps), Vec3(o.bias.accel_mps2 - truth.bias->accel_mps2)};
    error.nees.gyro_bias = normalised(error.bias_error->gyro_radps, o.gyro_bias_covariance);
    error.nees.accel_bias = normalised(error.bias_error->accel_mps2, o.accel_bias_covariance);
  }
}

}  // namespace

std::optional<TrajectoryPoint> truth_at(const std::vector<TrajectoryPoint>& truth, Time t, double longest_s) {
  const auto after = std::lower_bound(truth.begin(), truth.end(), t, [](const TrajectoryPoint& p, Time x) { return p.t < x; });
  if (after == truth.end()) return std::nullopt;
  if (after->t == t) return *after;
  if (after == truth.begin() || (after->t - (after - 1)->t).seconds() > longest_s) return std::nullopt;
  const TrajectoryPoint &a = *(after - 1), &b = *after;
  const double share = (t - a.t).seconds() / (b.t - a.t).seconds();
  const auto mix = [&](const Vec3& x, const Vec3& y) { return Vec3(x + share * (y - x)); };
  TrajectoryPoint point{t, {a.T_WB.q.slerp(share, b.T_WB.q), mix(a.T_WB.p, b.T_WB.p)}, {}, {}};
  if (a.v_WB && b.v_WB) point.v_WB = mix(*a.v_WB, *b.v_WB);
  if (a.bias && b.bias)
    point.bias = ImuBias{mix(a.bias->gyro_radps, b.bias->gyro_radps), mix(a.bias->accel_mps2, b.bias->accel_mps2)};
  return point;
}

RunErrors run_errors(const RunFolder& run) {
  RunErrors errors;
  Trajectory<W> truth, estimate;
  for (const TrajectoryPoint& p : run.truth) truth.push_back({p.t, p.T_WB});
  for (const Odometry& o : run.odometry)
    if (o.health.has_pose()) estimate.push_back({o.t, o.T_WB});
  Result<Evaluation> evaluation = evaluate(truth, estimate, {});
  if (evaluation) errors.evaluation = *evaluation;
  else errors.no_evaluation = evaluation.error().message;

  std::optional<Pose<W, W>> truth_from_w;
  std::uint32_t resets = 0;
  for (std::size_t k = 0; k < run.odometry.size(); ++k) {
    const Odometry& o = run.odometry[k];
    if (!o.health.has_pose()) continue;
    const std::optional<TrajectoryPoint> point = truth_at(run.truth, o.t);
    if (!point) continue;
    if (!truth_from_w || o.reset_counter != resets) truth_from_w = yaw_between(point->T_WB, o.T_WB), resets = o.reset_counter;
    FrameError error;
    error.frame = k;
    error.truth = point->T_WB;
    error.aligned = errors.evaluation ? errors.evaluation->alignment * o.T_WB : o.T_WB;
    error.absolute_m = (error.aligned.p - error.truth.p).norm();
    error.absolute_deg = so3_log(error.aligned.q.conjugate() * error.truth.q).norm() * 180 / std::numbers::pi;
    judge(o, *point, *truth_from_w, error);
    errors.frames.push_back(error);
  }
  return errors;
}

}  // namespace fbvins
