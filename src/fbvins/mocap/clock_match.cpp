// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/clock_match.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace fbvins {
namespace {

constexpr double kSpan_s = 0.1;  // over which angular speed is measured: two images
constexpr double kCoarseStep_s = 0.04, kFineStep_s = 0.01;
constexpr int kMostSamples = 8000;  // of the coarse search, whose cost is their square
constexpr double kLargestHole_s = 0.15;
constexpr double kWeakest = 0.6;     // smallest correlation that is accepted
constexpr double kAmbiguous = 0.85;  // another offset is as good
constexpr double kPeakWidth_s = 1.0;

/// Angular speeds on a grid, NaN where not known.
struct Turning {
  Time start;
  double step_s = 0;
  std::vector<double> radps;
};

struct Attitude {
  Time t;
  Quat q;
};

class Attitudes {
 public:
  explicit Attitudes(std::vector<Attitude> samples) : samples_(std::move(samples)) {}

  double turning(Time from, Time to) {
    const auto a = at(from, hint_[0]), b = at(to, hint_[1]);
    if (!a || !b) return std::numeric_limits<double>::quiet_NaN();
    return so3_log(a->conjugate() * *b).norm() / (to - from).seconds();
  }
  Time first() const { return samples_.front().t; }
  Time last() const { return samples_.back().t; }

 private:
  /// Called with growing times.
  std::optional<Quat> at(Time t, std::size_t& hint) const {
    while (hint + 1 < samples_.size() && samples_[hint + 1].t <= t) ++hint;
    if (hint + 1 >= samples_.size() || samples_[hint].t > t) return std::nullopt;
    const Attitude &a = samples_[hint], &b = samples_[hint + 1];
    if ((b.t - a.t).seconds() > kLargestHole_s) return std::nullopt;
    return a.q.slerp((t - a.t).seconds() / (b.t - a.t).seconds(), b.q);
  }

  std::vector<Attitude> samples_;
  std::size_t hint_[2] = {0, 0};
};

Turning turning_of(Attitudes attitudes, double step_s) {
  Turning out{attitudes.first(), step_s, {}};
  const auto count = static_cast<std::size_t>((attitudes.last() - attitudes.first()).seconds() / step_s);
  const Duration half = Duration::from_seconds(kSpan_s / 2);
  for (std::size_t i = 0; i < count; ++i) {
    const Time t = out.start + Duration::from_seconds(static_cast<double>(i) * step_s);
    out.radps.push_back(attitudes.turning(t - half, t + half));
  }
  return out;
}

struct Score {
  double correlation = 0, significance = 0;
  int count = 0;
};

/// Of a[i] with b[i + shift].
Score score_at(const std::vector<double>& a, const std::vector<double>& b, std::ptrdiff_t shift) {
  const std::ptrdiff_t first = std::max<std::ptrdiff_t>(0, -shift);
  const std::ptrdiff_t end = std::min(static_cast<std::ptrdiff_t>(a.size()), static_cast<std::ptrdiff_t>(b.size()) - shift);
  double n = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (std::ptrdiff_t i = first; i < end; ++i) {
    const double x = a[static_cast<std::size_t>(i)], y = b[static_cast<std::size_t>(i + shift)];
    if (std::isnan(x) || std::isnan(y)) continue;
    n += 1, sa += x, sb += y, saa += x * x, sbb += y * y, sab += x * y;
  }
  Score score;
  score.count = static_cast<int>(n);
  const double va = saa - sa * sa / n, vb = sbb - sb * sb / n;
  if (n < 3 || !(va > 0) || !(vb > 0)) return score;
  score.correlation = std::clamp((sab - sa * sb / n) / std::sqrt(va * vb), -0.999999, 0.999999);
  score.significance = std::atanh(score.correlation) * std::sqrt(n - 3);  // Fisher: a long overlap counts for more
  return score;
}

struct Peak {
  std::ptrdiff_t shift = 0;
  Score best;
  double runner_up = 0;  ///< significance of the best shift that is far from it
};

Peak search(const Turning& track, const Turning& estimate, std::ptrdiff_t from, std::ptrdiff_t to, double shortest_s) {
  Peak peak;
  std::vector<Score> scores;
  for (std::ptrdiff_t shift = from; shift <= to; ++shift) {
    Score score = score_at(track.radps, estimate.radps, shift);
    if (score.count * track.step_s < shortest_s) score = {};
    scores.push_back(score);
    if (score.significance > peak.best.significance) peak.best = score, peak.shift = shift;
  }
  const auto width = static_cast<std::ptrdiff_t>(kPeakWidth_s / track.step_s);
  for (std::ptrdiff_t shift = from; shift <= to; ++shift)
    if (std::abs(shift - peak.shift) > width)
      peak.runner_up = std::max(peak.runner_up, scores[static_cast<std::size_t>(shift - from)].significance);
  return peak;
}

/// estimate's start + shift * step is where track's start belongs.
Duration offset_of(const Turning& track, const Turning& estimate, double shift) {
  return (estimate.start - track.start) + Duration::from_seconds(shift * track.step_s);
}

}  // namespace

Result<ClockMatch> match_clocks(const MarkerTrack& track, const Trajectory<W>& estimate) {
  std::vector<Attitude> markers, body;
  for (const MarkerPose& pose : track) markers.push_back({pose.t, pose.T_VK.q});
  for (const StampedPose<W>& pose : estimate) body.push_back({pose.t, pose.T.q});
  const auto length_s = [](const std::vector<Attitude>& a) { return a.size() < 2 ? 0.0 : (a.back().t - a.front().t).seconds(); };
  const double shortest_s = std::max(kShortestOverlap_s, 0.3 * std::min(length_s(markers), length_s(body)));
  if (std::min(length_s(markers), length_s(body)) < kShortestOverlap_s)
    return Error{ErrorCode::invalid_argument,
                 fmt::format("{:.1f} s of motion capture and {:.1f} s of estimate: both need {:.0f} s", length_s(markers),
                             length_s(body), kShortestOverlap_s)};
  const double coarse_s = std::max(kCoarseStep_s, std::max(length_s(markers), length_s(body)) / kMostSamples);
  const Turning a = turning_of(Attitudes(markers), coarse_s), b = turning_of(Attitudes(body), coarse_s);
  const Peak coarse =
      search(a, b, -static_cast<std::ptrdiff_t>(a.radps.size()), static_cast<std::ptrdiff_t>(b.radps.size()), shortest_s);
  if (coarse.best.correlation < kWeakest)
    return Error{
        ErrorCode::invalid_argument,
        fmt::format(
            "at no offset of the clocks do markers and estimate turn alike (best correlation {:.2f}): is it the same flight, the "
            "right body, and {:.0f} s of both at the same time?",
            coarse.best.correlation, shortest_s)};
  if (coarse.runner_up > kAmbiguous * coarse.best.significance)
    return Error{
        ErrorCode::invalid_argument,
        fmt::format("the offset of the clocks is not shown: two offsets more than {:.0f} s apart fit alike; turn irregularly",
                    kPeakWidth_s)};
  const Duration around = offset_of(a, b, static_cast<double>(coarse.shift));
  const Turning fine_a = turning_of(Attitudes(markers), kFineStep_s), fine_b = turning_of(Attitudes(body), kFineStep_s);
  const auto centre = static_cast<std::ptrdiff_t>(std::llround((around - offset_of(fine_a, fine_b, 0)).seconds() / kFineStep_s));
  const auto reach = static_cast<std::ptrdiff_t>(std::ceil(2 * coarse_s / kFineStep_s));
  const Peak fine = search(fine_a, fine_b, centre - reach, centre + reach, shortest_s);
  return ClockMatch{offset_of(fine_a, fine_b, static_cast<double>(fine.shift)), fine.best.correlation};
}

}  // namespace fbvins
