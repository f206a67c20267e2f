// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/stereo_step.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/core/median.hpp"
#include "fbvins/doctor/stereo_fit.hpp"
#include "fbvins/features/pyramid.hpp"
#include "fbvins/features/shi_tomasi.hpp"
#include "fbvins/frontend/klt_follower.hpp"

namespace fbvins {
namespace {

constexpr int kMostLag = 3;
constexpr std::size_t kViews = 8, kFewestMatches = 15;
/// Below kFits_px there is no lag. A lag must leave less than that, and than kMuchBetter of the error as stamped.
constexpr double kFits_px = 1, kMuchBetter = 0.35;
/// Largest error that a view counts with.
constexpr double kCap_px = 20;

double period_of(std::span<const StereoFrame> frames) {
  std::vector<double> steps;
  for (std::size_t k = 1; k < frames.size(); ++k) steps.push_back((frames[k].t - frames[k - 1].t).seconds());
  return median(steps);
}

/// Mean of the views' epipolar errors, as a lag shows only in views in which the rig rotates. None with fewer than 3 views.
std::optional<double> error_at(int lag, const StereoRig& rig, std::span<const StereoFrame> frames, FreeStereo& stereo) {
  double sum = 0;
  int views = 0;
  Pyramid left, right;
  const std::size_t step = std::max<std::size_t>(frames.size() / kViews, 1);
  for (std::size_t k = kMostLag; k + kMostLag < frames.size(); k += step) {
    const auto& a = frames[k].left();
    const auto& b = frames[static_cast<std::size_t>(static_cast<int>(k) + lag)].right();
    if (!a || !b) continue;
    left.build(a->view(), kKltLevels);
    right.build(b->view(), kKltLevels);
    const StereoView view{frames[k].t, stereo.match(rig, *a, *b, left, right)};
    if (view.points.size() < kFewestMatches) continue;
    sum += std::min(epipolar_error_px(view, rig), kCap_px);
    ++views;
  }
  if (views < 3) return std::nullopt;
  return sum / views;
}

}  // namespace

StereoStep stereo_step(const StereoRig& rig, std::span<const StereoFrame> frames, FreeStereo& stereo) {
  StereoStep step;
  step.period_s = period_of(frames);
  const auto as_stamped = error_at(0, rig, frames, stereo);
  if (!as_stamped) return step;
  step.as_stamped_px = step.in_step_px = *as_stamped;
  if (*as_stamped < kFits_px) return step;
  for (int lag = -kMostLag; lag <= kMostLag; ++lag) {
    const auto error = lag != 0 ? error_at(lag, rig, frames, stereo) : std::nullopt;
    if (error && *error < std::min(kFits_px, kMuchBetter * *as_stamped) && *error < step.in_step_px)
      step.lag = lag, step.in_step_px = *error;
  }
  return step;
}

bool nearly_same(const StereoFrame& first, const StereoFrame& second) {
  const Image *a = first.left().get(), *b = second.left().get();
  if (a == nullptr || b == nullptr || a->width() != b->width() || a->height() != b->height()) return false;
  constexpr int kGrid_px = 4;
  Pyramid pyramid;
  pyramid.build(a->view(), 1);
  std::int64_t sum = 0, count = 0;
  for (int y = 0; y < a->height(); y += kGrid_px)
    for (int x = 0; x < a->width(); x += kGrid_px, ++count) sum += std::abs(a->row(y)[x] - b->row(y)[x]);
  return static_cast<double>(sum) < (2 * estimate_noise(pyramid.level(0)) + 1) * static_cast<double>(count);
}

std::optional<StereoFrame> StereoRealigner::push(StereoFrame frame) {
  if (lag_ == 0) return frame;
  waiting_.push_back(std::move(frame));
  if (waiting_.size() <= static_cast<std::size_t>(std::abs(lag_))) return std::nullopt;
  StereoFrame out = lag_ > 0 ? waiting_.front() : waiting_.back();
  out.set_image(1, lag_ > 0 ? waiting_.back().right() : waiting_.front().right());
  waiting_.pop_front();
  return out;
}

}  // namespace fbvins
