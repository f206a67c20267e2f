// SPDX-License-Identifier: Apache-2.0
#include "fbvins/calibration/recent_board_views.hpp"

#include <algorithm>
#include <optional>

namespace fbvins {
namespace {

constexpr double kMemory_s = 1.5, kNow_s = 0.5;
constexpr double kFast = 0.4;       // image widths a second: a corner moves by pixels while the shutter is open
constexpr double kLostPart = 0.4;   // of the images that do not show the board
constexpr std::size_t kFewest = 4;  // images to judge by

/// Of the corners that both views have.
std::optional<double> shift_px(const BoardView& from, const BoardView& to) {
  double sum = 0;
  int common = 0;
  for (const BoardCorner& a : from.corners)
    for (const BoardCorner& b : to.corners)
      if (a.index == b.index) sum += (a.pixel - b.pixel).norm(), ++common;
  return common > 0 ? std::optional(sum / common) : std::nullopt;
}

}  // namespace

void RecentBoardViews::add(int camera, Time t, int width_px, const BoardDetection& seen, bool mirrored) {
  One one{{t, camera, seen.corners}, seen.tags, seen.foreign_tags, seen.twice, mirrored, 0};
  for (auto before = last_.rbegin(); before != last_.rend() && !one.view.corners.empty(); ++before) {
    if (before->view.camera != camera || before->view.corners.empty()) continue;
    const double apart_s = (t - before->view.t).seconds();
    const auto shift = apart_s > 0 && apart_s < kNow_s ? shift_px(before->view, one.view) : std::nullopt;
    if (shift) speed_ = one.speed = *shift / width_px / apart_s;
    break;
  }
  last_.push_back(std::move(one));
  while ((t - last_.front().view.t).seconds() > kMemory_s) last_.pop_front();
}

std::vector<BoardView> RecentBoardViews::now() const {
  std::vector<BoardView> out;
  for (auto one = last_.rbegin(); one != last_.rend(); ++one) {
    if ((last_.back().view.t - one->view.t).seconds() > kNow_s) break;
    const bool known = std::ranges::any_of(out, [&](const BoardView& view) { return view.camera == one->view.camera; });
    if (!known && !one->view.corners.empty()) out.push_back(one->view);
  }
  std::ranges::sort(out, {}, &BoardView::camera);
  return out;
}

std::string RecentBoardViews::advice() const {
  if (last_.size() < kFewest) return "";
  const auto part = [&](const auto& fact) {
    return static_cast<double>(std::ranges::count_if(last_, fact)) / static_cast<double>(last_.size());
  };
  if (part([](const One& one) { return one.foreign > one.tags; }) > kLostPart)
    return "show another board: this one's tags are not those of the target file";
  if (part([](const One& one) { return one.mirrored; }) > 0 && part([](const One& one) { return one.tags > 0; }) == 0)
    return "print the board again, or correct the camera: the board is seen mirrored";
  if (part([](const One& one) { return one.twice > 0; }) > kLostPart) return "leave only one board in view";
  // Cameras may look elsewhere: what counts is whether any of them sees it.
  int stamps = 0, lost = 0;
  for (auto one = last_.begin(); one != last_.end();) {
    const Time t = one->view.t;
    bool seen = false;
    for (; one != last_.end() && one->view.t == t; ++one) seen = seen || !one->view.corners.empty();
    ++stamps, lost += !seen;
  }
  if (lost < kLostPart * stamps) return "";
  if (speed_ > kFast) return "hold still: the images are blurred";
  return lost == stamps ? "show the board to the cameras" : "";
}

}  // namespace fbvins
