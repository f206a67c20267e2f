// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/fixed_view.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace fbvins {
namespace {

/// Motion of the scene from one view to the next, and views at most: 17 MB of two VGA cameras.
constexpr double kStep_px = 16;
constexpr std::size_t kMostViews = 96;
/// Turn of the rig between two views from which even what is far away, or ahead, has moved in the image.
constexpr double kTurned_px = 8;
/// Motion across an edge after which another one lies there.
constexpr double kAcross_px = 8;
constexpr int kFewestPairs = 8;
/// Mean gradient of an edge, grey values a pixel of the small image: more than noise and vignetting have.
constexpr double kEdge = 2;
/// An edge agrees with its mean where it has this share of its strength: gain and light change.
constexpr double kStrength = 0.35;
constexpr double kMostlyThere = 0.8;
/// In the small image: gaps in a fixed thing that are filled, specks that are not one, and the smallest one.
constexpr int kGap_px = 5, kSpeck_px = 1, kSmallest_px = 80;
/// The outer side of an edge, where the scene shows through the blur.
constexpr int kSkirt_px = 1;
/// Of the image: less is nothing to tell, more is a recording that does not move.
constexpr double kLeastShare = 0.002, kMostShare = 0.6;

/// Distance that a finding keeps from what is hidden already: the edge of a mask that was drawn by hand.
constexpr double kBesideMask_px = 12;

std::shared_ptr<const Image> half_of(const Pyramid& pyramid) {
  if (pyramid.levels() < 2) return nullptr;
  const PyramidLevel& level = pyramid.level(1);
  auto half = std::make_shared<Image>(level.width, level.height);
  for (int y = 0; y < level.height; ++y) std::copy_n(level.row(y), level.width, half->row(y));
  return half;
}

/// Sobel's gradient at a pixel, grey values a pixel.
Eigen::Vector2f gradient(const Image& image, int x, int y) {
  const std::uint8_t *a = image.row(y - 1) + x, *p = image.row(y) + x, *b = image.row(y + 1) + x;
  return 0.125f * Eigen::Vector2f(static_cast<float>(a[1] - a[-1] + 2 * (p[1] - p[-1]) + b[1] - b[-1]),
                                  static_cast<float>(b[-1] - a[-1] + 2 * (b[0] - a[0]) + b[1] - a[1]));
}

/// A view of one camera and the motion that led to it; 0 where it does not count.
struct Look {
  const Image* image;
  Eigen::Vector2f moved_px;
};

/// Whether an edge at the pixel stays while the scene moves across it.
bool stays(const std::vector<Look>& looks, int x, int y, std::vector<Eigen::Vector2f>& gradients) {
  Eigen::Vector2f mean = Eigen::Vector2f::Zero();
  for (std::size_t i = 0; i < looks.size(); ++i) mean += gradients[i] = gradient(*looks[i].image, x, y);
  mean /= static_cast<float>(looks.size());
  const float strength = mean.norm();
  if (strength < kEdge) return false;
  const Eigen::Vector2f across = mean / strength;
  const auto there = [&](std::size_t i) { return gradients[i].dot(across) > kStrength * strength; };
  int pairs = 0, stayed = 0, present = there(0);
  for (std::size_t i = 1; i < looks.size(); ++i) {
    present += there(i);
    if (std::abs(looks[i].moved_px.dot(across)) < kAcross_px) continue;
    ++pairs;
    stayed += there(i - 1) && there(i);
  }
  return pairs >= kFewestPairs && stayed >= kMostlyThere * pairs && present >= kMostlyThere * static_cast<double>(looks.size());
}

/// Black pixels and those at most `by` away from one.
Image grown(const Image& seen, int by) {
  const Mask mask(seen);
  Image out(seen.width(), seen.height(), 255);
  for (int y = 0; y < out.height(); ++y)
    for (int x = 0; x < out.width(); ++x)
      if (mask.hides(Vec2(x, y), by)) out.at(x, y) = 0;
  return out;
}

Image inverted(Image image) {
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) image.at(x, y) = static_cast<std::uint8_t>(255 - image.at(x, y));
  return image;
}

Image shrunk(const Image& seen, int by) { return inverted(grown(inverted(seen), by)); }

/// Whitens connected parts of fewer pixels.
void drop_small(Image& seen, int fewest) {
  Image done(seen.width(), seen.height(), 0);
  std::vector<std::pair<int, int>> part;
  for (int y = 0; y < seen.height(); ++y)
    for (int x = 0; x < seen.width(); ++x) {
      const auto take = [&](int u, int v) {
        if (u < 0 || v < 0 || u >= seen.width() || v >= seen.height() || seen.at(u, v) != 0 || done.at(u, v) != 0) return;
        done.at(u, v) = 1;
        part.emplace_back(u, v);
      };
      part.clear();
      take(x, y);
      for (std::size_t i = 0; i < part.size(); ++i) {
        const auto [u, v] = part[i];
        take(u - 1, v), take(u + 1, v), take(u, v - 1), take(u, v + 1);
      }
      if (part.size() < static_cast<std::size_t>(fewest))
        for (const auto& [u, v] : part) seen.at(u, v) = 255;
    }
}

/// What stays, black, in the small image.
Image fixed_parts(const std::vector<Look>& looks) {
  const int width = looks.front().image->width(), height = looks.front().image->height();
  Image seen(width, height, 255);
  std::vector<Eigen::Vector2f> gradients(looks.size());
  for (int y = 1; y + 1 < height; ++y)
    for (int x = 1; x + 1 < width; ++x)
      if (stays(looks, x, y, gradients)) seen.at(x, y) = 0;
  seen = shrunk(grown(seen, kGap_px), kGap_px);
  seen = grown(shrunk(seen, kSpeck_px), kSpeck_px);
  drop_small(seen, kSmallest_px);
  return grown(seen, kSkirt_px);
}

void judge(FixedInView& out, std::size_t side, const std::vector<Look>& looks, const Camera& camera) {
  if (looks.empty()) return;
  const Image small = fixed_parts(looks);
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
  if (share < kLeastShare || share > kMostShare) return;
  out.share[side] = share;
  out.masks[side] = std::make_shared<const Mask>(seen);
}

}  // namespace

void ViewSampler::add(Time t, const Vec2& moved_px, const Pyramid& left, const Pyramid& right) {
  moved_px_ += moved_px;
  if (left.empty() || right.empty() || (!views_.empty() && moved_px_.norm() < kStep_px)) return;
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
  std::array<std::vector<Look>, 2> looks;
  const double focal_px = evidence.rig.left.focal_px();
  for (std::size_t i = 0; i < evidence.views.size(); ++i) {
    const SmallView& view = evidence.views[i];
    if (!view.left || !view.right) continue;
    // People who walk past a rig at rest move in the image, too.
    const bool turned = i > 0 && imu.covers(evidence.views[i - 1].t, view.t) &&
                        focal_px * imu.turned(evidence.views[i - 1].t, view.t).norm() > kTurned_px;
    const Eigen::Vector2f moved_px = turned ? Eigen::Vector2f(view.moved_px.cast<float>()) : Eigen::Vector2f::Zero();
    out.pairs += moved_px.norm() > kAcross_px;
    looks[0].push_back({view.left.get(), moved_px});
    looks[1].push_back({view.right.get(), moved_px});
  }
  if (!out.judged()) return out;
  judge(out, 0, looks[0], evidence.rig.left);
  judge(out, 1, looks[1], evidence.rig.right);
  return out;
}

}  // namespace fbvins
