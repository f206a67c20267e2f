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
constexpr std::size_t kMostPairs = 150, kMostTracks = 40, kFewestTracks = 12;
/// Of a rate by orientations, to both sides: above the vibration of an airframe, below its motion.
constexpr Duration kRateOver{8'000'000};
constexpr Duration kMargin = Duration{static_cast<std::int64_t>(1e9 * GyroAlignment::kLargestOffset_s)} + kRateOver;
/// Full steps swing to and fro: the tracks' weights follow the directions of parallax, which follow the unknowns.
constexpr int kIterations = 10;
constexpr double kShare = 0.6;
constexpr double kLeastStep_s = 2e-5, kLeastStep_radps = 1e-4;
constexpr double kHuber_sigmas = 2;
/// What is assumed of parallax: that of each track differs from the mean by so many times the mean, which is more than in any room, so that
/// the mean counts only where parallax is small; none is larger than the second, rad.
constexpr double kDepths = 3, kMostParallax = 0.5;
constexpr int kParallaxIterations = 4;
/// Offsets from which the search begins: closer together than a quarter of the fastest motion of a hand, 5 Hz.
constexpr double kStarts_s[] = {0, -0.04, 0.04, -0.08, 0.08};
/// With more pairs a search costs too much for one image; the last solution is improved.
constexpr std::size_t kMostSearched = 24;
/// From here on the minimum is known.
constexpr double kSettled_s = 0.002;
/// The tracks of two images share what is left of the readings' noise and of the lens: the covariance of independent ones is too
/// small by this factor (docs/experiments/sensors.md).
constexpr double kShared = 2;
/// And residuals of real tracks are so small a part of what a track's standard deviation allows, at least.
constexpr double kLeastRms = 0.4;
/// A pair shows when its image was taken where its tracks say it to this, alone. Where nothing is wrong, pairs of real images are off by
/// the second in the median.
constexpr double kLateShows_s = 0.004, kLateUsual_s = 0.0007;
constexpr std::size_t kFewestLate = 10;
/// Relative standard deviation of the variance by the median of n differences: this over the root of n. It is subtracted.
constexpr double kSurely = 2.3;

using Vec8 = GyroAlignmentEstimate::Vec;

/// Of each stamp. A pair shows the noise of its two stamps, and so does the pair that begins where it ends, of the stamp between them
/// with the other sign: the difference has six times the variance of one. What lasts longer than a pair, as a gyroscope that drifts,
/// is in neither. The median hides single images that are late.
double stamp_sigma(const std::vector<LateImage>& late) {
  std::vector<double> difference_s, known_s2;
  auto before = late.begin();
  for (const LateImage& l : late) {
    while (before->to < l.from) ++before;
    if (before->to != l.from) continue;
    difference_s.push_back(std::abs(l.s - before->s));
    known_s2.push_back(1.5 * (l.known_s2 + before->known_s2));  // of the image between, twice the noise
  }
  if (difference_s.size() < kFewestLate) return 0;
  const double sigma = 1.4826 * median(difference_s), usual = 1.4826 * kLateUsual_s;
  const double surely = 1 - kSurely / std::sqrt(static_cast<double>(difference_s.size()));
  return std::sqrt(std::max(0.0, surely * sigma * sigma - usual * usual - median(known_s2)) / 6);
}

/// The body between two images.
struct Turn {
  Mat3 R;                               ///< by the readings
  Eigen::Matrix<double, 3, 8> by_unknowns;
  Mat3 mounting;
  Vec3 rate_a, rate_b;
  double line_delay_s;
};

/// What the direction of a track in the second image is off by, in the plane across it, and what that depends on (Y1-Y3).
struct Equation {
  Vec3 expected, normal;  ///< direction without parallax, and across it and what was seen
  Vec2 off;
  Eigen::Matrix<double, 2, 3> by_parallax;
  Eigen::Matrix<double, 2, 8> J;
  Vec2 by_late;
  double variance;
  Mat2 information = Mat2::Zero();  ///< with its robust weight
};

Equation equation_of(const SeenTwice& track, const Turn& turn) {
  const Vec3 a = so3_exp(Vec3(turn.line_delay_s * track.rows_a * turn.rate_a)) * (turn.mounting * track.a);
  const Vec3 b = so3_exp(Vec3(turn.line_delay_s * track.rows_b * turn.rate_b)) * (turn.mounting * track.b);
  Equation q;
  q.expected = turn.R.transpose() * a;
  q.normal = q.expected.cross(b);
  q.by_parallax.row(0) = q.expected.unitOrthogonal();
  q.by_parallax.row(1) = q.expected.cross(q.by_parallax.row(0).transpose());
  q.off = q.by_parallax * b;
  const Eigen::Matrix<double, 2, 3> by_turn = -q.by_parallax * hat(q.expected);
  q.J = by_turn * turn.by_unknowns;
  q.J.col(4) +=
      q.by_parallax * (track.rows_b * turn.rate_b.cross(b) - turn.R.transpose() * (track.rows_a * turn.rate_a.cross(a)));
  q.by_late = by_turn * turn.rate_b;
  q.variance = track.sigma * track.sigma;
  return q;
}

Mat2 covariance(const Equation& q, const Vec2& shift) {
  return q.variance * Mat2::Identity() + kDepths * kDepths * shift * shift.transpose();
}

struct ParallaxNormal {
  Mat3 V;
  Vec3 w;
};

/// By weights of this parallax.
ParallaxNormal weigh(std::vector<Equation>& equations, const Vec3& parallax) {
  ParallaxNormal out{1 / (kMostParallax * kMostParallax) * Mat3::Identity(), Vec3::Zero()};
  for (Equation& q : equations) {
    const Vec2 shift = q.by_parallax * parallax, r = q.off + shift;
    q.information = covariance(q, shift).inverse();
    q.information *= huber(r.dot(q.information * r), kHuber_sigmas).weight;
    out.V += q.by_parallax.transpose() * q.information * q.by_parallax;
    out.w += q.by_parallax.transpose() * (q.information * q.off);
  }
  return out;
}

Vec3 fit_parallax(std::vector<Equation>& equations, Vec3 parallax) {
  for (int i = 0; i < kParallaxIterations; ++i) {
    const auto [V, w] = weigh(equations, parallax);
    parallax = -V.ldlt().solve(w);
  }
  return parallax;
}

/// Negative logarithm of the likelihood.
double unlikeliness(const std::vector<Equation>& equations, const Vec3& parallax) {
  double out = 0;
  for (const Equation& q : equations) {
    const Vec2 shift = q.by_parallax * parallax, r = q.off + shift;
    const Mat2 P = covariance(q, shift);
    out += huber(r.dot(P.inverse() * r), kHuber_sigmas).cost + 0.5 * std::log(P.determinant());
  }
  return out;
}

/// Where parallax is large, its direction lies in the plane of both directions of every track: the least share of what noise would
/// spread the planes' normals by, and not the least spread, which is always along the view.
Vec3 by_planes(const std::vector<Equation>& equations) {
  Mat3 spread = Mat3::Zero(), by_noise = 1e-6 * Mat3::Identity();
  for (const Equation& q : equations) {
    const Vec3 n = q.normal / std::sqrt(q.variance);
    const double weight = 1 / std::max(1.0, n.squaredNorm() / 25);
    spread += weight * n * n.transpose();
    by_noise += weight * (Mat3::Identity() - q.expected * q.expected.transpose());
  }
  const Vec3 t = Eigen::GeneralizedSelfAdjointEigenSolver<Mat3>(spread, by_noise).eigenvectors().col(0).normalized();
  double along = 0, most = 1e-9;
  for (const Equation& q : equations) {
    const Vec2 by_t = q.by_parallax * t;
    along -= by_t.dot(q.off), most += by_t.squaredNorm();
  }
  return along / most * t;
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
          pair.tracks.push_back({s->ray_B, seen.ray_B, std::hypot(s->sigma, seen.sigma), s->rows, seen.rows});
      }
      if (pair.tracks.size() > kMostTracks) {  // spread over all
        std::vector<SeenTwice> some;
        for (std::size_t k = 0; k < kMostTracks; ++k) some.push_back(pair.tracks[k * pair.tracks.size() / kMostTracks]);
        pair.tracks = std::move(some);
      }
      if (pair.tracks.size() >= kFewestTracks) pairs_.push_back(std::move(pair));
      if (pairs_.size() > kMostPairs) pairs_.pop_front();
    }
    ++paired_;
    while (paired_ > 1 && (views_[paired_ - 1].t - views_[1].t).seconds() > kMostApart_s) views_.pop_front(), --paired_;
  }
  const Time first = pairs_.empty() ? (views_.empty() ? Time{} : views_.front().t) : pairs_.front().from;
  while (turned_.size() > 2 && turned_[1].t < first - kMargin - kMargin) turned_.pop_front();
}

/// The equations of one pair, the parallax that its tracks have in common eliminated (Y4).
void GyroAlignment::add_pair(const Pair& pair, const Vec8& x, Normal& out) const {
  const Time from = pair.from + Duration::from_seconds(x(3)), to = pair.to + Duration::from_seconds(x(3));
  const Vec3 bias = x.head<3>();
  const Quat raw = (orientation(from).conjugate() * orientation(to)).normalized();
  const Mat3 by_bias = -(pair.to - pair.from).seconds() * so3_right_jacobian(so3_log(raw));
  Turn turn;
  turn.R = (raw * so3_exp(Vec3(by_bias * bias))).toRotationMatrix();
  turn.mounting = so3_exp(Vec3(x.tail<3>())).toRotationMatrix();
  turn.rate_a = rate(from) - bias, turn.rate_b = rate(to) - bias;
  turn.line_delay_s = line_delay_s_ + x(4);
  turn.by_unknowns << by_bias, turn.rate_b - turn.R.transpose() * turn.rate_a, Vec3::Zero(), Mat3::Identity() - turn.R.transpose();

  std::vector<Equation> equations;
  for (const SeenTwice& track : pair.tracks) equations.push_back(equation_of(track, turn));
  const Vec3 from_none = fit_parallax(equations, Vec3::Zero()), from_planes = fit_parallax(equations, by_planes(equations));
  const bool planes = unlikeliness(equations, from_planes) < unlikeliness(equations, from_none);
  const auto [V, w] = weigh(equations, planes ? from_planes : from_none);
  Eigen::Matrix<double, 8, 3> X = Eigen::Matrix<double, 8, 3>::Zero();
  Vec3 X_late = Vec3::Zero();
  double H_late = 0, g_late = 0, cost = 0, rows = -3;
  for (const Equation& q : equations) {
    const Vec2 weighted = q.information * q.off;
    const Eigen::Matrix<double, 2, 3> by_parallax = q.information * q.by_parallax;
    out.H += q.J.transpose() * q.information * q.J, out.g += q.J.transpose() * weighted;
    X += q.J.transpose() * by_parallax;
    H_late += q.by_late.dot(q.information * q.by_late), g_late += q.by_late.dot(weighted);
    X_late += by_parallax.transpose() * q.by_late;
    cost += q.off.dot(weighted);
    rows += q.variance * q.information.trace();  // what parallax hides counts for nothing
  }
  const Mat3 V_inverse = V.inverse();
  const Eigen::Matrix<double, 8, 3> gain = X * V_inverse;
  H_late -= X_late.dot(V_inverse * X_late), g_late -= X_late.dot(V_inverse * w);
  cost -= w.dot(V_inverse * w);
  if (H_late > 1 / (kLateShows_s * kLateShows_s))
    out.late.push_back({pair.from, pair.to, -g_late / H_late, std::max(0.0, cost - g_late * g_late / H_late) / std::max(1.0, rows) / H_late});
  out.H -= gain * X.transpose();
  out.g -= gain * w;
  out.cost += cost;
  out.rows += rows;
}

GyroAlignment::Normal GyroAlignment::linearise(const Vec8& x) const {
  Normal out;
  for (const Pair& pair : pairs_) add_pair(pair, x, out);
  return out;
}

/// Gauss-Newton from `x`, in shorter steps: the directions of parallax, which weigh the tracks, follow each.
GyroAlignmentEstimate GyroAlignment::solve_from(const Vec8& x) const {
  const Vec8 prior = information(prior_);
  GyroAlignmentEstimate out;
  out.pairs = static_cast<int>(pairs_.size());
  out.x = x;
  for (int i = 0; i < kIterations; ++i) {
    Normal normal = linearise(out.x);
    out.rms = std::sqrt(normal.cost / std::max(1.0, normal.rows));
    out.late = std::move(normal.late);
    const double rms = std::max(kLeastRms, out.rms), scale = 1 / (kShared * rms * rms);
    const GyroAlignmentEstimate::Mat H = scale * normal.H + GyroAlignmentEstimate::Mat(prior.asDiagonal());
    const Eigen::LDLT<GyroAlignmentEstimate::Mat> ldlt(H);
    const Vec8 step = -kShare * ldlt.solve(scale * normal.g + prior.cwiseProduct(out.x));
    out.covariance = ldlt.solve(GyroAlignmentEstimate::Mat::Identity());
    if (!step.allFinite()) break;
    out.x += step;
    out.x(3) = std::clamp(out.x(3), -kLargestOffset_s, kLargestOffset_s);
    if (std::abs(step(3)) < kLeastStep_s && step.head<3>().norm() < kLeastStep_radps) break;
  }
  return out;
}

std::optional<GyroAlignmentEstimate> GyroAlignment::solve() {
  if (pairs_.empty()) return std::nullopt;
  GyroAlignmentEstimate best = solve_from(last_);
  if (!settled_ && pairs_.size() <= kMostSearched) {
    for (const double start : kStarts_s) {
      Vec8 x = Vec8::Zero();
      x(3) = start;
      GyroAlignmentEstimate found = solve_from(x);
      if (found.rms < best.rms) best = std::move(found);
    }
  }
  best.stamp_sigma_s = stamp_sigma(best.late);
  last_ = best.x;
  settled_ = best.time_offset_sigma_s() < kSettled_s;
  return best;
}

}  // namespace fbvins
