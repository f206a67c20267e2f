// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/orb_pattern.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace {

constexpr int kCandidates = 3000;
constexpr double kCorrelationLength_px = 6.0;
constexpr int kSmallestDistance_px = 4;
constexpr int kReach = 2 * kOrbRadius + 1;  // largest coordinate difference between two points

/// C(r) over squared distances.
class Covariance {
 public:
  Covariance() {
    for (int r2 = 0; r2 < kSize; ++r2)
      table_[static_cast<std::size_t>(r2)] = 1.0 / (1.0 + r2 / (kCorrelationLength_px * kCorrelationLength_px));
  }
  double operator()(int dx, int dy) const { return table_[static_cast<std::size_t>(dx * dx + dy * dy)]; }

 private:
  static constexpr int kSize = 2 * kReach * kReach + 1;
  std::array<double, kSize> table_{};
};

struct Candidate {
  PointPair pair;
  double deviation = 0;  // of I(a) - I(b)
  double bias = 0;       // |mean| / deviation after turning to the centroid
};

/// Covariance of I(x, y) with the x moment of the disc, the direction patches are turned to.
std::vector<double> moment_covariance(const Covariance& C) {
  std::vector<double> table;
  for (int y = -kPatternRadius; y <= kPatternRadius; ++y)
    for (int x = -kPatternRadius; x <= kPatternRadius; ++x) {
      double sum = 0;
      for (int v = -kOrbRadius; v <= kOrbRadius; ++v)
        for (int u = -kOrbRadius; u <= kOrbRadius; ++u)
          if (u * u + v * v <= kOrbRadius * kOrbRadius) sum += u * C(x - u, y - v);
      table.push_back(sum);
    }
  return table;
}

std::vector<Candidate> draw_candidates(const Covariance& C) {
  const std::vector<double> moment = moment_covariance(C);
  const auto at = [&](int x, int y) {
    return moment[static_cast<std::size_t>((y + kPatternRadius) * (2 * kPatternRadius + 1) + x + kPatternRadius)];
  };
  Rng rng(20);
  const auto point = [&rng](std::int8_t& x, std::int8_t& y) {
    do {
      x = static_cast<std::int8_t>(static_cast<int>(rng.below(2 * kPatternRadius + 1)) - kPatternRadius);
      y = static_cast<std::int8_t>(static_cast<int>(rng.below(2 * kPatternRadius + 1)) - kPatternRadius);
    } while (x * x + y * y > kPatternRadius * kPatternRadius);
  };
  std::vector<Candidate> candidates;
  while (candidates.size() < kCandidates) {
    Candidate c;
    PointPair& p = c.pair;
    point(p.ax, p.ay);
    point(p.bx, p.by);
    const int dx = p.ax - p.bx, dy = p.ay - p.by;
    if (dx * dx + dy * dy < kSmallestDistance_px * kSmallestDistance_px) continue;
    c.deviation = std::sqrt(2.0 * (C(0, 0) - C(dx, dy)));
    c.bias = std::abs(at(p.ax, p.ay) - at(p.bx, p.by)) / c.deviation;
    candidates.push_back(c);
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) { return a.bias < b.bias; });
  return candidates;
}

double correlation(const Covariance& C, const Candidate& s, const Candidate& t) {
  const PointPair &p = s.pair, &q = t.pair;
  const double cov =
      C(p.ax - q.ax, p.ay - q.ay) - C(p.ax - q.bx, p.ay - q.by) - C(p.bx - q.ax, p.by - q.ay) + C(p.bx - q.bx, p.by - q.by);
  return std::abs(cov) / (s.deviation * t.deviation);
}

}  // namespace

std::array<PointPair, 256> make_orb_pattern() {
  const Covariance C;
  const std::vector<Candidate> candidates = draw_candidates(C);
  std::vector<Candidate> taken;
  for (double limit = 0.2; taken.size() < 256; limit += 0.02) {
    taken.clear();
    for (const Candidate& c : candidates) {
      const bool fresh =
          std::none_of(taken.begin(), taken.end(), [&](const Candidate& t) { return correlation(C, c, t) > limit; });
      if (fresh) taken.push_back(c);
      if (taken.size() == 256) break;
    }
  }
  std::array<PointPair, 256> pattern;
  for (std::size_t i = 0; i < 256; ++i) pattern[i] = taken[i].pair;
  return pattern;
}

const std::array<PointPair, 256>& orb_pattern() {
  static const std::array<PointPair, 256> pattern = make_orb_pattern();
  return pattern;
}

}  // namespace fbvins
