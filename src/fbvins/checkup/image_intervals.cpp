// SPDX-License-Identifier: Apache-2.0
#include "fbvins/checkup/image_intervals.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace fbvins {
namespace {

/// Sorted steps so near to each other belong to one interval, and those of one are so near to their mean.
constexpr double kApart_s = 2e-4, kOff_s = 5e-4;
/// Two intervals are farther apart than stamps that are whole milliseconds, and than what is no finding.
constexpr double kBetween_s = 2.5e-3;
constexpr std::size_t kMostModes = 6, kFewest = 4;
constexpr double kLeastShare = 0.02, kLeastHeld = 0.9;
/// Of an interval's whole multiples: nearer to one than this share of it.
constexpr double kMultiple = 0.02;
/// A camera keeps to an interval: so many steps in a row. Lost images, late stamps and clock ticks come one by one.
constexpr double kLeastRun = 3;

struct Group {
  double mean_s = 0, square_s2 = 0;
  std::size_t count = 0;
};

std::vector<Group> groups_of(std::vector<double> sorted_s) {
  std::ranges::sort(sorted_s);
  std::vector<Group> groups;
  for (std::size_t first = 0; first < sorted_s.size();) {
    std::size_t last = first + 1;
    while (last < sorted_s.size() && sorted_s[last] - sorted_s[last - 1] < kApart_s) ++last;
    Group group;
    group.count = last - first;
    for (std::size_t i = first; i < last; ++i) group.mean_s += sorted_s[i] / static_cast<double>(group.count);
    for (std::size_t i = first; i < last; ++i) group.square_s2 += std::pow(sorted_s[i] - group.mean_s, 2);
    groups.push_back(group);
    first = last;
  }
  return groups;
}

/// Whether all are whole multiples of their smallest difference, or of the first one: lost images, or the ticks of a clock.
bool on_a_grid(const std::vector<double>& intervals_s) {
  double grid_s = intervals_s.front();
  for (std::size_t i = 1; i < intervals_s.size(); ++i) grid_s = std::min(grid_s, intervals_s[i] - intervals_s[i - 1]);
  return std::ranges::all_of(intervals_s, [&](double s) { return std::abs(s / grid_s - std::round(s / grid_s)) < kMultiple; });
}

/// Steps in a row that belong to one interval: of all in the mean, and of the one with the shortest runs.
struct Runs {
  double mean = 0, shortest = 0;
};

Runs runs_of(std::span<const double> steps_s, const std::vector<double>& intervals_s) {
  Runs out;
  out.shortest = static_cast<double>(steps_s.size());
  double all_steps = 0, all_runs = 0;
  for (const double interval_s : intervals_s) {
    double steps = 0, runs = 0;
    bool before = false;
    for (const double step_s : steps_s) {
      const bool now = std::abs(step_s - interval_s) < kBetween_s / 2;
      steps += now, runs += now && !before;
      before = now;
    }
    out.shortest = std::min(out.shortest, steps / std::max(runs, 1.0));
    all_steps += steps, all_runs += runs;
  }
  out.mean = all_steps / std::max(all_runs, 1.0);
  return out;
}

}  // namespace

bool IntervalModes::holds(double step_s) const {
  return std::ranges::any_of(intervals_s, [&](double s) { return std::abs(step_s - s) < kBetween_s / 2; });
}

std::optional<IntervalModes> interval_modes(std::span<const double> steps_s) {
  const auto least = std::max(static_cast<double>(kFewest), kLeastShare * static_cast<double>(steps_s.size()));
  IntervalModes modes;
  double square_s2 = 0;
  std::size_t held = 0;
  for (const Group& group : groups_of({steps_s.begin(), steps_s.end()})) {
    if (static_cast<double>(group.count) < least) continue;
    if (std::sqrt(group.square_s2 / static_cast<double>(group.count)) > kOff_s) return std::nullopt;
    if (!modes.intervals_s.empty() && group.mean_s - modes.intervals_s.back() < kBetween_s) return std::nullopt;
    modes.intervals_s.push_back(group.mean_s);
    square_s2 += group.square_s2, held += group.count;
  }
  if (modes.intervals_s.size() < 2 || modes.intervals_s.size() > kMostModes) return std::nullopt;
  if (static_cast<double>(held) < kLeastHeld * static_cast<double>(steps_s.size())) return std::nullopt;
  const Runs runs = runs_of(steps_s, modes.intervals_s);
  if ((on_a_grid(modes.intervals_s) ? runs.shortest : runs.mean) < kLeastRun) return std::nullopt;
  modes.off_s = std::sqrt(square_s2 / static_cast<double>(held));
  return modes;
}

}  // namespace fbvins
