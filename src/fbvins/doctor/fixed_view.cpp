// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/fixed_view.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "fbvins/doctor/fixed_edges.hpp"

namespace fbvins {
namespace {

/// Motion of the scene from one view to the next, and views at most: 17 MB of two VGA cameras.
constexpr double kStep_px = 16;
constexpr std::size_t kMostViews = 96;
/// Of the gyroscope, which is not known yet: the turn of a rig that hovers for seconds from one view to the next may be nothing
/// else. More is a finding of its own.
constexpr double kMostBias_radps = 0.1;
/// Of the image: less is nothing to tell, more is an image that does not move.
constexpr double kLeastFixedShare = 0.002, kMostFixedShare = 0.6;
/// What is found so near to an existing mask is the edge of the same thing, masked by hand a little too small.
constexpr double kBesideMask_px = 12;

std::shared_ptr<const Image> half_of(const Pyramid& pyramid) {
  if (pyramid.levels() < 2) return nullptr;
  const PyramidLevel& level = pyramid.level(1);
  auto half = std::make_shared<Image>(level.width, level.height);
  for (int y = 0; y < level.height; ++y) std::copy_n(level.row(y), level.width, half->row(y));
  return half;
}

void judge(FixedInView& out, std::size_t side, const FixedEdges& fixed, const Camera& camera) {
  const Image small = fixed.parts(fixed.edges());
  const Image before = camera.mask() ? camera.mask()->image() : Image(camera.width(), camera.height(), 255);
  Image seen = before;
  std::int64_t found = 0;
  for (int y = 0; y < seen.height(); ++y)
    for (int x = 0; x < seen.width(); ++x) {
      // A pixel of the small image lies on one of twice its coordinates.
      if (small.at(std::min((x + 1) / 2, small.width() - 1), std::min((y + 1) / 2, small.height() - 1)) != 0) continue;
      if (camera.hidden(Vec2(x, y), kBesideMask_px)) continue;
      seen.at(x, y) = 0;
      ++found;
    }
  const double share = static_cast<double>(found) / (1.0 * seen.width() * seen.height());
  if (share < kLeastFixedShare || share > kMostFixedShare) return;
  out.share[side] = share;
  out.masks[side] = std::make_shared<const Mask>(seen);
}

/// The gyroscope's bias may be so large: what the rig turns in the mean, which over a whole recording is little.
double bias_at_most(const std::vector<const SmallView*>& views, const ImuSeries& imu) {
  Vec3 turned_rad = Vec3::Zero();
  double time_s = 0;
  for (std::size_t i = 1; i < views.size(); ++i) {
    if (!imu.covers(views[i - 1]->t, views[i]->t)) continue;
    turned_rad += imu.turned(views[i - 1]->t, views[i]->t);
    time_s += (views[i]->t - views[i - 1]->t).seconds();
  }
  return time_s > 0 ? std::min(kMostBias_radps, turned_rad.norm() / time_s) : 0;
}

}  // namespace

void ViewSampler::add(Time t, const Vec2& moved_px, const Pyramid& left, const Pyramid& right) {
  moved_px_ += moved_px;
  if (left.empty() || (of_a_pair_ && right.empty()) || (!views_.empty() && moved_px_.norm() < kStep_px)) return;
  if (++skipped_ < stride_) return;
  views_.push_back({t, known_ ? moved_px_ : Vec2::Zero(), half_of(left), half_of(right)});
  moved_px_.setZero();
  known_ = true;
  skipped_ = 0;
  if (views_.size() < kMostViews) return;
  // Every second one goes, the last among them; the motion over two is the sum.
  if (views_.size() % 2 == 0) {
    moved_px_ = views_.back().moved_px;
    known_ = !moved_px_.isZero();
  }
  std::vector<SmallView> kept;
  for (std::size_t i = 0; i < views_.size(); i += 2) {
    if (i > 0) {
      const Vec2 &a = views_[i - 1].moved_px, &b = views_[i].moved_px;
      views_[i].moved_px = a.isZero() || b.isZero() ? Vec2::Zero() : Vec2(a + b);
    }
    kept.push_back(std::move(views_[i]));
  }
  views_ = std::move(kept);
  stride_ *= 2;
}

bool FixedInView::judged() const { return pairs >= kFewestPairs; }

FixedInView find_fixed(const Evidence& evidence, const ImuSeries& imu) {
  FixedInView out;
  const int cameras = evidence.rig.has_right() ? 2 : 1;
  std::vector<FixedEdges> fixed;
  for (int side = 0; side < cameras; ++side) fixed.emplace_back(evidence.rig.camera(side));
  std::vector<const SmallView*> views;
  for (const SmallView& view : evidence.views)
    if (view.left && (view.right || cameras == 1)) views.push_back(&view);
  const double bias_radps = bias_at_most(views, imu);
  for (std::size_t i = 0; i < views.size(); ++i) {
    Vec2 moved_px = Vec2::Zero();
    Vec3 turned_rad = Vec3::Zero();
    float by_bias_rad = 0;
    bool known = i >= kLooksApart && imu.covers(views[i - kLooksApart]->t, views[i]->t);
    for (std::size_t k = i - kLooksApart + 1; known && k <= i; ++k) {
      known = !views[k]->moved_px.isZero();
      moved_px += views[k]->moved_px;
    }
    // People who walk past a rig at rest move in the image, too.
    if (known) {
      turned_rad = imu.turned(views[i - kLooksApart]->t, views[i]->t);
      by_bias_rad = static_cast<float>(bias_radps * (views[i]->t - views[i - kLooksApart]->t).seconds());
    } else {
      moved_px.setZero();
    }
    out.pairs += moved_px.norm() > kAcross_px && evidence.rig.left().focal_px() * (turned_rad.norm() - by_bias_rad) > kAcross_px;
    for (int side = 0; side < cameras; ++side)
      fixed[static_cast<std::size_t>(side)].add({side == 0 ? views[i]->left : views[i]->right, moved_px.cast<float>(),
                                                 Vec3(evidence.rig.T_BC(side).q.conjugate() * turned_rad).cast<float>(),
                                                 by_bias_rad});
  }
  if (!out.judged()) return out;
  judge(out, 0, fixed[0], evidence.rig.left());
  if (cameras == 2) judge(out, 1, fixed[1], evidence.rig.right());
  return out;
}

}  // namespace fbvins
