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
/// Views are compared with the one so many before: an odd number, so that of a rig that swings two different ones meet.
constexpr std::size_t kApart = 3;
/// Motion across an edge after which another one lies there: of the scene, and by the rig's turn alone, which moves what is far
/// away, or ahead, as well.
constexpr float kAcross_px = 8, kTurned_px = 8;
/// Of the gyroscope, which is not known yet: the turn of a rig that hovers for seconds from one view to the next may be nothing
/// else. More is a finding of its own.
constexpr double kMostBias_radps = 0.1;
/// Between which the scene moved across an edge; in the whole recording as well.
constexpr int kFewestPairs = 20;
/// Mean gradient of an edge, grey values a pixel of the small image: more than noise has. Vignetting has as much towards the edge
/// of a wide lens's image, but nearly the same all around: what pixels within kAround_px have in common is no edge.
constexpr double kEdge = 2;
constexpr int kAround_px = 15;
/// An edge agrees with its mean where it has this share of its strength: gain and light change.
constexpr double kStrength = 0.35;
constexpr double kMostlyThere = 0.8;
/// Square of the mean gradient against the mean square: near 1 of one edge, less where gain changes or dirt lets the scene shine
/// through. Different edges of the scene that meet at a pixel, such as a room's under its ceiling, leave a mean that is weak
/// beside each of them.
constexpr float kOneEdge = 0.15f;
/// In the small image: gaps in a fixed thing that are filled, specks that are not one, and the smallest one.
constexpr int kGap_px = 5, kSpeck_px = 1, kSmallest_px = 80;
/// The outer side of an edge, where the scene shows through the blur.
constexpr int kSkirt_px = 1;
/// Of the image: less is nothing to tell, more is a recording that does not move.
constexpr double kLeastShare = 0.002, kMostShare = 0.6;
/// What is found so near to an existing mask is the edge of the same thing, masked by hand a little too small.
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

/// A view of one camera, and what happened since the one kApart before; 0 where that is not known.
struct Look {
  const Image* image;
  Eigen::Vector2f moved_px = Eigen::Vector2f::Zero();
  Eigen::Vector3f turned_rad = Eigen::Vector3f::Zero();  ///< of the camera, in its frame
  float by_bias_rad = 0;                                 ///< of which so much may be the gyroscope's bias
};

/// One camera's looks.
struct Looks {
  std::vector<Look> all;
  const Camera* camera = nullptr;

  /// Motion of a far point at a pixel of the small image by a small turn, px of the camera a radian: by its lens, at whose edge a
  /// fisheye's is half of a pinhole's. Zero where the lens sees nothing.
  Eigen::Matrix<float, 2, 3> motion_by_turn(int x, int y) const {
    constexpr double kTurn_rad = 1e-3;
    Eigen::Matrix<float, 2, 3> out = Eigen::Matrix<float, 2, 3>::Zero();
    const Vec2 pixel(2 * x, 2 * y);
    const auto ray = camera->ray(pixel);
    for (int i = 0; ray && i < 3; ++i) {
      const auto there = camera->pixel_of(*ray + kTurn_rad * Vec3::Unit(i).cross(*ray));
      if (!there) return Eigen::Matrix<float, 2, 3>::Zero();
      out.col(i) = ((*there - pixel) / kTurn_rad).cast<float>();
    }
    return out;
  }
};

/// Of each pixel the mean over all looks of its surroundings' gradients.
class SharedGradient {
 public:
  explicit SharedGradient(const std::vector<Look>& looks)
      : width_(looks.front().image->width()), height_(looks.front().image->height()) {
    sums_.assign(static_cast<std::size_t>(width_ + 1) * static_cast<std::size_t>(height_ + 1), Eigen::Vector2d::Zero());
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        Eigen::Vector2f here = Eigen::Vector2f::Zero();
        if (x > 0 && y > 0 && x + 1 < width_ && y + 1 < height_)
          for (const Look& look : looks) here += gradient(*look.image, x, y);
        at(x + 1, y + 1) = at(x, y + 1) + at(x + 1, y) - at(x, y) + here.cast<double>() / static_cast<double>(looks.size());
      }
  }
  Eigen::Vector2f around(int x, int y) {
    const int left = std::max(1, x - kAround_px), right = std::min(width_ - 1, x + kAround_px + 1);
    const int top = std::max(1, y - kAround_px), bottom = std::min(height_ - 1, y + kAround_px + 1);
    const Eigen::Vector2d sum = at(right, bottom) - at(left, bottom) - at(right, top) + at(left, top);
    return (sum / ((right - left) * (bottom - top))).cast<float>();
  }

 private:
  Eigen::Vector2d& at(int x, int y) {
    return sums_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_ + 1) + static_cast<std::size_t>(x)];
  }

  int width_, height_;
  std::vector<Eigen::Vector2d> sums_;
};

/// Whether an edge at the pixel stays while the scene moves across it. `shared`: by vignetting.
bool stays(const Looks& of, int x, int y, const Eigen::Vector2f& shared, std::vector<Eigen::Vector2f>& gradients) {
  const std::vector<Look>& looks = of.all;
  Eigen::Vector2f mean = Eigen::Vector2f::Zero();
  for (std::size_t i = 0; i < looks.size(); ++i) mean += gradients[i] = gradient(*looks[i].image, x, y) - shared;
  mean /= static_cast<float>(looks.size());
  const float strength = mean.norm();
  if (strength < kEdge) return false;
  const Eigen::Vector2f across = mean / strength;
  const auto there = [&](std::size_t i) { return gradients[i].dot(across) > kStrength * strength; };
  const Eigen::RowVector3f by_turn = across.transpose() * of.motion_by_turn(x, y);
  int pairs = 0, stayed = 0, present = 0;
  float squares = 0;
  for (std::size_t i = 0; i < looks.size(); ++i) {
    present += there(i);
    squares += gradients[i].squaredNorm();
    if (i < kApart || std::abs(looks[i].moved_px.dot(across)) < kAcross_px ||
        std::abs(by_turn.dot(looks[i].turned_rad)) < kTurned_px + by_turn.norm() * looks[i].by_bias_rad)
      continue;
    ++pairs;
    stayed += there(i - kApart) && there(i);
  }
  const auto count = static_cast<float>(looks.size());
  return pairs >= kFewestPairs && stayed >= kMostlyThere * pairs && present >= kMostlyThere * count &&
         strength * strength * count >= kOneEdge * squares;
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
Image fixed_parts(const Looks& looks) {
  const int width = looks.all.front().image->width(), height = looks.all.front().image->height();
  Image seen(width, height, 255);
  std::vector<Eigen::Vector2f> gradients(looks.all.size());
  SharedGradient shared(looks.all);
  for (int y = 1; y + 1 < height; ++y)
    for (int x = 1; x + 1 < width; ++x)
      if (stays(looks, x, y, shared.around(x, y), gradients)) seen.at(x, y) = 0;
  seen = shrunk(grown(seen, kGap_px), kGap_px);
  seen = grown(shrunk(seen, kSpeck_px), kSpeck_px);
  drop_small(seen, kSmallest_px);
  return grown(seen, kSkirt_px);
}

void judge(FixedInView& out, std::size_t side, const Looks& looks, const Camera& camera) {
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
  std::array<Looks, 2> looks;
  for (int side = 0; side < cameras; ++side) looks[static_cast<std::size_t>(side)].camera = &evidence.rig.camera(side);
  std::vector<const SmallView*> views;
  for (const SmallView& view : evidence.views)
    if (view.left && (view.right || cameras == 1)) views.push_back(&view);
  const double bias_radps = bias_at_most(views, imu);
  for (std::size_t i = 0; i < views.size(); ++i) {
    Vec2 moved_px = Vec2::Zero();
    Vec3 turned_rad = Vec3::Zero();
    float by_bias_rad = 0;
    bool known = i >= kApart && imu.covers(views[i - kApart]->t, views[i]->t);
    for (std::size_t k = i - kApart + 1; known && k <= i; ++k) {
      known = !views[k]->moved_px.isZero();
      moved_px += views[k]->moved_px;
    }
    // People who walk past a rig at rest move in the image, too.
    if (known) {
      turned_rad = imu.turned(views[i - kApart]->t, views[i]->t);
      by_bias_rad = static_cast<float>(bias_radps * (views[i]->t - views[i - kApart]->t).seconds());
    } else {
      moved_px.setZero();
    }
    out.pairs += moved_px.norm() > kAcross_px && evidence.rig.left.focal_px() * (turned_rad.norm() - by_bias_rad) > kTurned_px;
    for (int side = 0; side < cameras; ++side)
      looks[static_cast<std::size_t>(side)].all.push_back(
          {(side == 0 ? views[i]->left : views[i]->right).get(), moved_px.cast<float>(),
           Vec3(evidence.rig.T_BC(side).q.conjugate() * turned_rad).cast<float>(), by_bias_rad});
  }
  if (!out.judged()) return out;
  judge(out, 0, looks[0], evidence.rig.left);
  if (cameras == 2) judge(out, 1, looks[1], evidence.rig.right);
  return out;
}

}  // namespace fbvins
