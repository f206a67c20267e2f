// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/gyro_alignment.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "fbvins/core/median.hpp"
#include "fbvins/geometry/so3.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

/// Images so far apart are compared: an offset shows by the change of the rate between them.
constexpr double kApart_s = 0.09;
constexpr double kMostApart_s = 0.3;
constexpr std::size_t kMostPairs = 150, kMostPlanes = 40, kFewestPlanes = 12;
/// Of a rate by orientations, to both sides: above the vibration of an airframe, below its motion.
constexpr Duration kRateOver{8'000'000};
constexpr Duration kMargin = Duration{static_cast<std::int64_t>(1e9 * GyroAlignment::kLargestOffset_s)} + kRateOver;
constexpr int kIterations = 6;
constexpr double kHuber_sigmas = 2;
/// A track nearer to the direction of the translation than this angle counts as if it were as far, rad.
constexpr double kEpipole = 0.1;
/// Offsets from which the search begins: closer together than a quarter of the fastest motion of a hand, 5 Hz.
constexpr double kStarts_s[] = {0, -0.04, 0.04, -0.08, 0.08};
/// From here on the minimum is known.
constexpr double kSettled_s = 0.002;
/// The tracks of two images share what is left of the readings' noise and of the lens: the covariance of independent ones is too
/// small by this factor (docs/experiments/sensors.md).
constexpr double kShared = 4;
/// And residuals of real tracks are so small a part of what a track's standard deviation allows, at least.
constexpr double kLeastRms = 0.4;
/// A pair shows when its image was taken where its tracks say it to this, alone. Where nothing is wrong, pairs of real images are off by
/// the second in the median.
constexpr double kLateShows_s = 0.004, kLateUsual_s = 0.0007;
constexpr std::size_t kFewestLate = 10;

using Vec8 = GyroAlignmentEstimate::Vec;

/// Of each stamp, by what the pairs are off by: two stamps each. The median hides single images that are late.
double stamp_sigma(std::vector<double> late_s, std::vector<double> known_s2, double rms) {
  if (late_s.size() < kFewestLate) return 0;
  for (double& late : late_s) late = std::abs(late);
  const double sigma = 1.4826 * median(late_s), usual = 1.4826 * kLateUsual_s;
  return std::sqrt(std::max(0.0, sigma * sigma - usual * usual - rms * rms * median(known_s2)) / 2);
}

Vec8 information(const GyroAlignmentPrior& p) {
  Vec8 sigma;
  sigma << Vec3::Constant(p.gyro_bias_radps), p.time_offset_s, p.line_delay_s, Vec3::Constant(p.rotation_rad);
  return sigma.array().square().inverse();
}

}  // namespace

void GyroAlignment::add_readings(const ImuSegment& segment) {
  if (segment.empty() || segment.longest_gap.seconds() > 0.05) {
    turned_.clear(), views_.clear(), pairs_.clear();
    paired_ = 0;
    last_rate_.reset();
    if (segment.empty()) return;
  }
  // The ends are interpolated; those between are the sensor's own.
  for (std::size_t k = 1; k + 1 < segment.samples.size(); ++k) {
    const ImuSample& s = segment.samples[k];
    const Time t = s.t + segment.time_offset;
    if (!turned_.empty() && t <= turned_.back().t) continue;
    if (last_rate_) {
      const double dt = (t - turned_.back().t).seconds();
      turned_.push_back({t, (turned_.back().q * so3_exp(Vec3(0.5 * dt * (*last_rate_ + s.gyro_radps)))).normalized()});
    } else {
      turned_.push_back({t, Quat::Identity()});
    }
    last_rate_ = s.gyro_radps;
  }
}

Quat GyroAlignment::orientation(Time t) const {
  const auto after = std::lower_bound(turned_.begin(), turned_.end(), t, [](const Rotation& r, Time at) { return r.t < at; });
  if (after == turned_.begin()) return after->q;
  if (after == turned_.end()) return turned_.back().q;
  const auto before = std::prev(after);
  const double x = (t - before->t).seconds() / (after->t - before->t).seconds();
  return before->q.slerp(x, after->q);
}

Vec3 GyroAlignment::rate(Time t) const {
  return so3_log((orientation(t - kRateOver).conjugate() * orientation(t + kRateOver)).normalized()) / (2 * kRateOver.seconds());
}

void GyroAlignment::add(const TrackedFrame& frame, Duration given) {
  add_readings(frame.imu);
  View view{frame.t + given + frame.offsets.of(0), {}};
  for (const TrackedFeature& f : frame.features) {
    if (!f.left || f.cameras.left != 0) continue;
    const Vec3 ray = f.left->normalised.homogeneous();
    const double sigma = 1 / (std::sqrt(std::abs(f.left->sqrt_information.determinant())) * ray.norm());
    view.sights.push_back({f.id, R_BC_ * ray.normalized(), sigma, f.left->pixel.y() - middle_row_px_});
  }
  std::ranges::sort(view.sights, {}, &Sight::id);
  views_.push_back(std::move(view));
  make_pairs();
}

/// Pairs of images whose readings are here, at whatever offset.
void GyroAlignment::make_pairs() {
  while (paired_ < views_.size()) {
    const View& b = views_[paired_];
    if (turned_.empty() || turned_.back().t < b.t + kMargin) break;
    std::size_t i = paired_;
    while (i > 0 && (b.t - views_[i].t).seconds() < kApart_s) --i;
    const View& a = views_[i];
    const double apart_s = (b.t - a.t).seconds();
    if (apart_s >= kApart_s && apart_s < kMostApart_s && turned_.front().t <= a.t - kMargin) {
      Pair pair{a.t, b.t, {}};
      auto s = a.sights.begin();
      for (const Sight& seen : b.sights) {
        while (s != a.sights.end() && s->id < seen.id) ++s;
        if (s == a.sights.end()) break;
        if (s->id == seen.id)
          pair.planes.push_back({s->ray_B, seen.ray_B, std::hypot(s->sigma, seen.sigma), s->rows, seen.rows});
      }
      if (pair.planes.size() > kMostPlanes) {  // spread over all
        std::vector<Plane> some;
        for (std::size_t k = 0; k < kMostPlanes; ++k) some.push_back(pair.planes[k * pair.planes.size() / kMostPlanes]);
        pair.planes = std::move(some);
      }
      if (pair.planes.size() >= kFewestPlanes) pairs_.push_back(std::move(pair));
      if (pairs_.size() > kMostPairs) pairs_.pop_front();
    }
    ++paired_;
    while (paired_ > 1 && (views_[paired_ - 1].t - views_[1].t).seconds() > kMostApart_s) views_.pop_front(), --paired_;
  }
  const Time first = pairs_.empty() ? (views_.empty() ? Time{} : views_.front().t) : pairs_.front().from;
  while (turned_.size() > 2 && turned_[1].t < first - kMargin - kMargin) turned_.pop_front();
}

/// Point-to-plane equations of one pair, the direction of its translation eliminated (Y2-Y4).
void GyroAlignment::add_pair(const Pair& pair, const Vec8& x, Normal& out) const {
  const Time from = pair.from + Duration::from_seconds(x(3)), to = pair.to + Duration::from_seconds(x(3));
  const double dt = (pair.to - pair.from).seconds();
  const Vec3 bias = x.head<3>(), mounting = x.tail<3>();
  const double line_delay_s = line_delay_s_ + x(4);
  const Vec3 rate_a = rate(from) - bias, rate_b = rate(to) - bias;
  const Quat raw = (orientation(from).conjugate() * orientation(to)).normalized();
  const Mat3 by_bias = -dt * so3_right_jacobian(so3_log(raw));
  const Mat3 R = (raw * so3_exp(Vec3(by_bias * bias))).toRotationMatrix();
  const Mat3 M = so3_exp(mounting).toRotationMatrix();
  std::vector<Vec3> a, b, n;
  Mat3 spread = Mat3::Zero(), by_noise = 1e-6 * Mat3::Identity();
  for (const Plane& p : pair.planes) {
    a.push_back(so3_exp(Vec3(line_delay_s * p.rows_a * rate_a)) * (M * p.a));
    b.push_back(so3_exp(Vec3(line_delay_s * p.rows_b * rate_b)) * (M * p.b));
    n.push_back(a.back().cross(R * b.back()) / p.sigma);
    const double weight = 1 / std::max(1.0, n.back().squaredNorm() / 25);
    spread += weight * n.back() * n.back().transpose();
    by_noise += weight * (Mat3::Identity() - a.back() * a.back().transpose());
  }
  // The least share of what noise would spread the normals by, and not the least spread, which is always along the view.
  const Vec3 t = Eigen::GeneralizedSelfAdjointEigenSolver<Mat3>(spread, by_noise).eigenvectors().col(0).normalized();
  const Vec3 e = t.unitOrthogonal(), f = t.cross(e);
  Eigen::Matrix<double, 3, 8> turn;  // of R by the unknowns
  turn << by_bias, rate_b - R.transpose() * rate_a, Vec3::Zero(), Mat3::Identity() - R.transpose();
  Mat2 V = 1e-12 * Mat2::Identity();
  Vec2 w = Vec2::Zero();
  Eigen::Matrix<double, 8, 2> X = Eigen::Matrix<double, 8, 2>::Zero();
  double H_late = 0, g_late = 0;
  Vec2 X_late = Vec2::Zero();
  for (std::size_t k = 0; k < a.size(); ++k) {
    const Plane& p = pair.planes[k];
    const double to_plane = p.sigma * std::max(kEpipole, t.cross(a[k]).norm());
    const double r = t.dot(n[k]) * p.sigma / to_plane;
    const RobustValue robust = huber(r * r, kHuber_sigmas);
    Vec8 J = (-(t.cross(a[k])).transpose() * R * hat(b[k]) * turn / to_plane).transpose();
    J(4) += (t.dot(p.rows_a * rate_a.cross(a[k]).cross(R * b[k])) + t.dot(a[k].cross(R * (p.rows_b * rate_b.cross(b[k]))))) / to_plane;
    const double J_late = -t.cross(a[k]).dot(R * b[k].cross(rate_b)) / to_plane;
    const Vec2 d = p.sigma / to_plane * Vec2(e.dot(n[k]), f.dot(n[k]));
    H_late += robust.weight * J_late * J_late, g_late += robust.weight * r * J_late, X_late += robust.weight * J_late * d;
    out.H += robust.weight * J * J.transpose(), out.g += robust.weight * r * J;
    V += robust.weight * d * d.transpose(), w += robust.weight * r * d;
    X += robust.weight * J * d.transpose();
    out.cost += robust.weight * r * r;
    ++out.rows;
  }
  const Mat2 V_inverse = V.inverse();
  const Eigen::Matrix<double, 8, 2> gain = X * V_inverse;
  H_late -= X_late.dot(V_inverse * X_late), g_late -= X_late.dot(V_inverse * w);
  if (H_late > 1 / (kLateShows_s * kLateShows_s)) out.late_s.push_back(-g_late / H_late), out.known_s2.push_back(1 / H_late);
  out.H -= gain * X.transpose();
  out.g -= gain * w;
  out.rows -= 2;
}

GyroAlignment::Normal GyroAlignment::linearise(const Vec8& x) const {
  Normal out;
  for (const Pair& pair : pairs_) add_pair(pair, x, out);
  return out;
}

GyroAlignmentEstimate GyroAlignment::solve_from(double time_offset_s) const {
  const Vec8 prior = information(prior_);
  GyroAlignmentEstimate out;
  out.pairs = static_cast<int>(pairs_.size());
  out.x(3) = time_offset_s;
  for (int i = 0; i < kIterations; ++i) {
    Normal normal = linearise(out.x);
    out.rms = std::sqrt(normal.cost / std::max(1, normal.rows));
    out.stamp_sigma_s = stamp_sigma(std::move(normal.late_s), std::move(normal.known_s2), out.rms);
    const double rms = std::max(kLeastRms, out.rms), scale = 1 / (kShared * rms * rms);
    const GyroAlignmentEstimate::Mat H = scale * normal.H + GyroAlignmentEstimate::Mat(prior.asDiagonal());
    const Eigen::LDLT<GyroAlignmentEstimate::Mat> ldlt(H);
    const Vec8 step = -ldlt.solve(scale * normal.g + prior.cwiseProduct(out.x));
    out.covariance = ldlt.solve(GyroAlignmentEstimate::Mat::Identity());
    if (!step.allFinite()) break;
    out.x += step;
    out.x(3) = std::clamp(out.x(3), -kLargestOffset_s, kLargestOffset_s);
    if (std::abs(step(3)) < 2e-5 && step.head<3>().norm() < 1e-4) break;
  }
  return out;
}

std::optional<GyroAlignmentEstimate> GyroAlignment::solve() {
  if (pairs_.empty()) return std::nullopt;
  std::optional<GyroAlignmentEstimate> best;
  for (const double start : kStarts_s) {
    const GyroAlignmentEstimate found = solve_from(last_offset_s_ + start);
    if (!best || found.rms < best->rms) best = found;
    if (settled_) break;
  }
  last_offset_s_ = best->time_offset_s();
  settled_ = best->time_offset_sigma_s() < kSettled_s;
  return best;
}

}  // namespace fbvins
