// SPDX-License-Identifier: Apache-2.0
#include "fbvins/imu/gyro_alignment.hpp"

#include <algorithm>
#include <utility>

#include "fbvins/core/hypotenuse.hpp"
#include "fbvins/geometry/ldlt.hpp"

namespace fbvins {
namespace {

/// Images so far apart are compared: an offset shows by the change of the rate between them.
constexpr double kApart_s = 0.09;
constexpr double kMostApart_s = 0.3;
constexpr std::size_t kMostTracks = 40, kFewestTracks = 12;
constexpr Duration kMargin = Duration{static_cast<std::int64_t>(1e9 * GyroAlignment::kLargestOffset_s)} + GyroTurns::kMostSide;
constexpr int kMostSteps = 10;
/// Of a step after which tracks were compared anew: their weights follow the directions of parallax, which follow the unknowns,
/// and full steps swing to and fro.
constexpr double kShare = 0.6;
/// Of a step, in standard deviations of the solution, that is not worth another.
constexpr double kLeastStep_sigmas = 0.03;
/// Tracks are compared anew with a turn that differs by more, in standard deviations of a track, and by more than the second
/// without the parallax that was found before.
constexpr double kDiffers_sigmas = 0.25, kDiffersMuch_sigmas = 1;
/// Offsets from which the search begins: closer together than a quarter of the fastest motion of a hand, 5 Hz.
constexpr double kStarts_s[] = {0, -0.04, 0.04, -0.08, 0.08};
/// A search is made when there are so many times the pairs of the one before. With more than the second it costs too much for one
/// image; the last solution is improved.
constexpr double kSearchAgain = 1.4;
constexpr std::size_t kMostSearched = 24;
/// From here on the minimum is known.
constexpr double kSettled_s = 0.002;
/// A known offset that tracks and readings contradict by more is forgotten.
constexpr double kContradicted_sigmas = 3;
/// The tracks of two images share what is left of the readings' noise and of the lens, and pairs share images: the covariance of
/// independent ones is too small by this factor (docs/experiments/sensors.md).
constexpr double kShared = 3;
/// And residuals of real tracks are so small a part of what a track's standard deviation allows, at least.
constexpr double kLeastRms = 0.4;
/// A pair shows when its image was taken where its tracks say it to this, alone.
constexpr double kLateShows_s = 0.004;

using Vec8 = GyroAlignmentEstimate::Vec;
using Mat8 = GyroAlignmentEstimate::Mat;

Vec8 information(const GyroAlignmentPrior& p) {
  Vec8 sigma;
  sigma << Vec3::Constant(p.gyro_bias_radps), p.known_offset ? p.known_offset->sigma_s : p.time_offset_s, p.line_delay_s,
      Vec3::Constant(p.rotation_rad);
  return sigma.array().square().inverse();
}

Vec8 mean(const GyroAlignmentPrior& p) { return (p.known_offset ? p.known_offset->s : 0) * Vec8::Unit(3); }

std::vector<SeenTwice> spread_over(const std::vector<SeenTwice>& tracks, std::size_t count) {
  if (tracks.size() <= count) return tracks;
  std::vector<SeenTwice> out;
  out.reserve(count);
  for (std::size_t k = 0; k < count; ++k) out.push_back(tracks[k * tracks.size() / count]);
  return out;
}

}  // namespace

/// How the body turned between two images by the readings, and what that depends on, in the axes of the tracks (Y2, Y3).
struct GyroAlignment::Turned {
  PredictedTurnOfPair turn;
  Eigen::Matrix<double, 4, 8> by_unknowns = Eigen::Matrix<double, 4, 8>::Zero();

  /// From the turn that the tracks were compared with.
  Eigen::Vector4d error(const PredictedTurnOfPair& compared) const {
    Eigen::Vector4d out;
    out << so3_log(Quat(Mat3(compared.R.transpose() * turn.R))), turn.line_delay_s - compared.line_delay_s;
    return out;
  }
};

void GyroAlignment::forget() {
  views_.clear(), pairs_.clear(), compared_.clear();
  turns_.clear();
  paired_ = 0;
}

void GyroAlignment::add(const TrackedFrame& frame, Duration given) {
  const Time t = frame.t + given + frame.offsets.of(0);
  if (frame.after_clock_step || (!views_.empty() && t < views_.back().t)) forget();
  turns_.add(frame.imu);
  views_.push_back(view_of(frame, t));
  make_pairs();
}

GyroAlignment::View GyroAlignment::view_of(const TrackedFrame& frame, Time t) const {
  View view{t, {}};
  view.sights.reserve(frame.features.size());
  for (const TrackedFeature& f : frame.features) {
    const Observation* o = f.lead == 0 ? f.by(0) : nullptr;
    if (!o) continue;
    const Vec3 ray = o->normalised.homogeneous();
    const double norm = ray.norm();
    const double sigma = 1 / (std::sqrt(std::abs(o->sqrt_information.determinant())) * norm);
    view.sights.push_back({f.id, R_BC_ * (ray / norm), sigma, o->pixel.y() - middle_row_px_});
  }
  if (!std::ranges::is_sorted(view.sights, {}, &Sight::id)) std::ranges::sort(view.sights, {}, &Sight::id);
  return view;
}

/// Pairs of images whose readings are here, at whatever offset.
void GyroAlignment::make_pairs() {
  while (paired_ < views_.size()) {
    const View& b = views_[paired_];
    if (turns_.empty() || turns_.last() < b.t + kMargin) break;
    std::size_t i = paired_;
    while (i > 0 && (b.t - views_[i].t).seconds() < kApart_s) --i;
    add_pair(views_[i], b);
    ++paired_;
    while (paired_ > 1 && (views_[paired_ - 1].t - views_[1].t).seconds() > kMostApart_s) views_.pop_front(), --paired_;
  }
  const Time first = pairs_.empty() ? (views_.empty() ? Time{} : views_.front().t) : pairs_.front().from;
  turns_.forget_before(first - kMargin - kMargin);
}

void GyroAlignment::add_pair(const View& a, const View& b) {
  const double apart_s = (b.t - a.t).seconds();
  if (apart_s < kApart_s || apart_s >= kMostApart_s || !turns_.covers(a.t - kMargin, b.t + kMargin)) return;
  std::vector<SeenTwice> tracks;
  auto s = a.sights.begin();
  for (const Sight& seen : b.sights) {
    while (s != a.sights.end() && s->id < seen.id) ++s;
    if (s == a.sights.end()) break;
    if (s->id == seen.id) tracks.push_back({s->ray_B, seen.ray_B, hypotenuse(s->sigma, seen.sigma), s->rows, seen.rows});
  }
  if (tracks.size() < kFewestTracks) return;
  pairs_.push_back({a.t, b.t, spread_over(tracks, kMostTracks)});
  compared_.emplace_back();
  if (pairs_.size() > most_pairs_) pairs_.pop_front(), compared_.pop_front();
}

GyroAlignment::Turned GyroAlignment::turned(const Pair& pair, const Vec8& x) const {
  const Duration offset = Duration::from_seconds(x(3));
  const Time from = pair.from + offset, to = pair.to + offset;
  const double dt_s = (to - from).seconds();
  const Vec3 bias = x.head<3>();
  const Quat raw = turns_.between(from, to);
  const Mat3 by_bias = -dt_s * so3_right_jacobian(so3_log(raw));
  const Mat3 R = (raw * so3_exp(Vec3(by_bias * bias))).toRotationMatrix();
  // The tracks stay in the axes of the mounting as given; the turn is taken there.
  const Mat3 given = so3_exp(Vec3(-x.tail<3>())).toRotationMatrix();
  const double line_delay_s = line_delay_s_ + x(4);
  const Duration side = Duration::from_seconds(std::abs(line_delay_s) * middle_row_px_);
  const auto around = [&](Time t) {
    const TurnAround turn = turns_.around(t, side);
    return TurnAround{given * (turn.rate - bias), given * turn.gain};
  };
  Turned out;
  out.turn = {given * R * given.transpose(), around(from), around(to), line_delay_s, dt_s};
  out.by_unknowns.topLeftCorner<3, 3>() = given * by_bias;
  out.by_unknowns.block<3, 1>(0, 3) = out.turn.around_b.rate - out.turn.R.transpose() * out.turn.around_a.rate;
  out.by_unknowns.topRightCorner<3, 3>() = given * (Mat3::Identity() - R.transpose());
  out.by_unknowns(3, 4) = 1;
  return out;
}

/// By so many standard deviations of a track the tracks' directions differ from where they were compared.
double GyroAlignment::difference_sigmas(const Pair& pair, const Compared& compared, const Turned& now) const {
  const Eigen::Vector4d error = now.error(compared.turn);
  const double rows =
      middle_row_px_ * (std::abs(error(3)) * now.turn.around_b.rate.norm() +
                        std::abs(now.turn.line_delay_s) * (now.turn.around_b.rate - compared.turn.around_b.rate).norm());
  return std::max(error.head<3>().norm(), rows) / pair.tracks.front().sigma;
}

/// Tracks are compared anew where the turn is no longer what they were compared with.
GyroAlignment::Normal GyroAlignment::linearise(const Vec8& x, std::deque<Compared>& compared) const {
  Normal out;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const Turned now = turned(pairs_[i], x);
    Compared& c = compared[i];
    const double differs = c.yet ? difference_sigmas(pairs_[i], c, now) : 0;
    if (!c.yet || differs > kDiffers_sigmas) {
      const bool near = c.yet && differs < kDiffersMuch_sigmas;
      c = {true, now.turn, turn_error(pairs_[i].tracks, now.turn, near ? std::optional(c.error.parallax) : std::nullopt)};
      ++out.compared;
    }
    const Eigen::Vector4d error = now.error(c.turn), a = c.error.a + c.error.A * error;
    const double cost = std::max(0.0, c.error.cost + error.dot(c.error.a + a)), rows = std::max(1.0, c.error.rows);
    const double scale = 1 / (kShared * std::max(kLeastRms * kLeastRms, cost / rows));
    out.H.noalias() += scale * now.by_unknowns.transpose() * c.error.A * now.by_unknowns;
    out.g.noalias() += scale * now.by_unknowns.transpose() * a;
    out.cost += cost;
    out.rows += c.error.rows;
  }
  return out;
}

/// What each pair says of its second stamp, alone.
std::vector<LateImage> GyroAlignment::late_images(const Vec8& x) const {
  std::vector<LateImage> out;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const Turned now = turned(pairs_[i], x);
    const TurnError& e = compared_[i].error;
    const Eigen::Vector4d error = now.error(compared_[i].turn), a = e.a + e.A * error;
    const Vec3 rate = now.turn.around_b.rate;
    const double H = rate.dot(e.A.topLeftCorner<3, 3>() * rate), g = rate.dot(a.head<3>());
    if (H <= 1 / (kLateShows_s * kLateShows_s)) continue;
    const double cost = e.cost + error.dot(e.a + a);
    out.push_back({pairs_[i].from, pairs_[i].to, -g / H, std::max(0.0, cost - g * g / H) / std::max(1.0, e.rows) / H});
  }
  return out;
}

GyroAlignmentEstimate GyroAlignment::solve_from(const Vec8& x, std::deque<Compared>& compared) const {
  const Vec8 prior = information(prior_), known = mean(prior_);
  GyroAlignmentEstimate out;
  out.pairs = static_cast<int>(pairs_.size());
  out.x = x;
  for (int i = 0; i < kMostSteps; ++i) {
    const Normal normal = linearise(out.x, compared);
    out.rms = std::sqrt(std::max(0.0, normal.cost) / std::max(1.0, normal.rows));
    const Mat8 H = normal.H + Mat8(prior.asDiagonal());
    const Ldlt<8> ldlt(H);
    const Vec8 step = -(normal.compared > 0 ? kShare : 1) * ldlt.solve(Vec8(normal.g + prior.cwiseProduct(out.x - known)));
    out.covariance = ldlt.solve(Mat8(Mat8::Identity()));
    if (!step.allFinite()) break;
    out.x += step;
    out.x(3) = std::clamp(out.x(3), -kLargestOffset_s, kLargestOffset_s);
    if (step.dot(H * step) < kLeastStep_sigmas * kLeastStep_sigmas) break;
  }
  return out;
}

/// The covariance of what the solution has moved by is what it has gained.
bool GyroAlignment::contradicts_known(const GyroAlignmentEstimate& found) const {
  if (!prior_.known_offset) return false;
  const double moved_s = found.time_offset_s() - prior_.known_offset->s, sigma_s = prior_.known_offset->sigma_s;
  const double gained_s2 = sigma_s * sigma_s - found.covariance(3, 3);
  return moved_s * moved_s > kContradicted_sigmas * kContradicted_sigmas * std::max(0.0, gained_s2);
}

/// The offset has minima beside the right one while it is hardly known.
void GyroAlignment::search(GyroAlignmentEstimate& best) {
  searched_ = pairs_.size();
  for (const double start : kStarts_s) {
    std::deque<Compared> compared(pairs_.size());
    GyroAlignmentEstimate found = solve_from(Vec8::Unit(3) * start, compared);
    if (found.rms < best.rms) best = std::move(found), compared_ = std::move(compared);
  }
}

std::optional<GyroAlignmentEstimate> GyroAlignment::solve() {
  if (pairs_.empty()) return std::nullopt;
  GyroAlignmentEstimate best = solve_from(last_, compared_);
  const auto again = static_cast<std::size_t>(kSearchAgain * static_cast<double>(searched_));
  if (!settled_ && pairs_.size() >= again && pairs_.size() <= kMostSearched) search(best);
  if (contradicts_known(best)) {
    prior_.known_offset.reset();
    best = solve_from(last_, compared_);
    search(best);
  }
  best.late = late_images(best.x);
  best.stamp_sigma_s = fbvins::stamp_sigma_s(best.late);
  last_ = best.x;
  settled_ = best.time_offset_sigma_s() < kSettled_s;
  return best;
}

}  // namespace fbvins
