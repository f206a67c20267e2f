// SPDX-License-Identifier: Apache-2.0
// A complete frontend outside of the library, in the simplest way that flies: corners by Harris' measure, found again by
// comparing blocks of pixels, over time where the gyroscope expects them and in the right image along the epipolar line.
//
//   fbvins run MH_01_easy --plugin build/libown_frontend.so --frontend blocks
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fbvins/frontend/any_rig.hpp>
#include <fbvins/frontend/frontend_plugin.hpp>
#include <fbvins/frontend/observe.hpp>
#include <fbvins/geometry/so3.hpp>
#include <optional>
#include <vector>

namespace {

using namespace fbvins;

constexpr int kHalf = 5, kBlock = 2 * kHalf + 1;          // px
constexpr int kSearch = 14;                               // px around the prediction, in each direction
constexpr double kSigma_px = 0.5, kWorstDifference = 14;  // mean over the block, grey values
constexpr double kNearest_m = 0.5, kCell_px = 40;
constexpr int kFeatures = 150;

/// Mean absolute difference of two blocks, their mean brightness apart; a large number at the border.
double difference(const Image& a, const Vec2& at_a, const Image& b, int bx, int by) {
  const int ax = static_cast<int>(std::lround(at_a.x())), ay = static_cast<int>(std::lround(at_a.y()));
  for (const auto& [x, y, image] : {std::tuple(ax, ay, &a), std::tuple(bx, by, &b)})
    if (x < kHalf || y < kHalf || x >= image->width() - kHalf || y >= image->height() - kHalf) return 1e9;
  int brighter = 0, sum = 0;
  for (int v = -kHalf; v <= kHalf; ++v)
    for (int u = -kHalf; u <= kHalf; ++u) brighter += a.at(ax + u, ay + v) - b.at(bx + u, by + v);
  brighter /= kBlock * kBlock;
  for (int v = -kHalf; v <= kHalf; ++v)
    for (int u = -kHalf; u <= kHalf; ++u) sum += std::abs(a.at(ax + u, ay + v) - b.at(bx + u, by + v) - brighter);
  return static_cast<double>(sum) / (kBlock * kBlock);
}

/// The best place and its fraction of a pixel, by a parabola through its neighbours.
std::optional<Vec2> refined(const Image& a, const Vec2& at_a, const Image& b, int x, int y) {
  const double best = difference(a, at_a, b, x, y);
  if (best > kWorstDifference) return std::nullopt;
  const auto fraction = [best](double before, double after) {
    const double bend = before + after - 2 * best;
    return bend > 1e-9 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0.0;
  };
  // What the first block's place was rounded by is part of the match.
  return Vec2(x + fraction(difference(a, at_a, b, x - 1, y), difference(a, at_a, b, x + 1, y)),
              y + fraction(difference(a, at_a, b, x, y - 1), difference(a, at_a, b, x, y + 1))) +
         at_a - at_a.array().round().matrix();
}

class BlockFrontend final : public Frontend {
 public:
  explicit BlockFrontend(const StereoRig& rig) : rig_(rig) {}

  TrackedFrame process(const SensorPacket& packet, const StatePrior& prior) override {
    TrackedFrame out;
    const auto& left = packet.frame.left();
    if (!left) return out;
    if (before_) follow(*left, rotation_since(packet, prior));
    detect(*left);
    for (Track& track : tracks_) {
      const std::optional<Observation> seen = observe(rig_.left(), track.px, kSigma_px);
      if (!seen) continue;
      TrackedFeature feature{track.id, track.age++};
      feature.see(0, seen);
      if (packet.frame.right()) feature.see(1, in_right(track, *left, *packet.frame.right()));
      out.features.push_back(feature);
    }
    before_ = left;
    return out;
  }

 private:
  struct Track {
    TrackId id;
    Vec2 px;
    int age = 0;
  };

  /// Of the camera between the images, by the gyroscope: p_now = R * p_before of what is far away.
  Mat3 rotation_since(const SensorPacket& packet, const StatePrior& prior) const {
    Quat q_before_now = Quat::Identity();
    const auto& samples = packet.imu.samples;
    for (std::size_t k = 1; k < samples.size(); ++k) {
      const Vec3 rate =
          0.5 * (samples[k - 1].gyro_radps + samples[k].gyro_radps) - (prior.valid ? prior.bias.gyro_radps : Vec3::Zero());
      q_before_now = q_before_now * so3_exp(rate * (samples[k].t - samples[k - 1].t).seconds());
    }
    const Mat3 R_BC = rig_.T_BC0().q.toRotationMatrix();
    return R_BC.transpose() * q_before_now.conjugate().toRotationMatrix() * R_BC;
  }

  void follow(const Image& now, const Mat3& R) {
    std::erase_if(tracks_, [&](Track& track) {
      const std::optional<Vec3> ray = rig_.left().ray(track.px);
      const std::optional<Vec2> expected = ray ? rig_.left().project(R * *ray) : std::nullopt;
      if (!expected) return true;
      const std::optional<Vec2> found = best_near(now, track.px, *expected);
      if (found) track.px = *found;
      return !found;
    });
  }

  std::optional<Vec2> best_near(const Image& now, const Vec2& px, const Vec2& expected) const {
    const int x0 = static_cast<int>(std::lround(expected.x())), y0 = static_cast<int>(std::lround(expected.y()));
    double best = 1e9;
    int x = x0, y = y0;
    for (int dy = -kSearch; dy <= kSearch; ++dy)
      for (int dx = -kSearch; dx <= kSearch; ++dx)
        if (const double d = difference(*before_, px, now, x0 + dx, y0 + dy); d < best) best = d, x = x0 + dx, y = y0 + dy;
    return refined(*before_, px, now, x, y);
  }

  /// Along the places that the point would have at every depth.
  std::optional<Observation> in_right(const Track& track, const Image& left, const Image& right) const {
    const std::optional<Vec3> ray = rig_.left().ray(track.px);
    if (!ray) return std::nullopt;
    const Pose<C1, C0> T_C1C0 = rig_.T_C1C0();
    constexpr int kDepths = 60;
    double best = 1e9;
    int x = 0, y = 0;
    for (int k = 0; k <= kDepths; ++k) {
      const std::optional<Vec2> px = rig_.right().project(T_C1C0.q * *ray + T_C1C0.p * (k / (kDepths * kNearest_m)));
      if (!px) continue;
      for (int dy = -1; dy <= 1; ++dy) {
        const int px_x = static_cast<int>(std::lround(px->x())), px_y = static_cast<int>(std::lround(px->y())) + dy;
        if (const double d = difference(left, track.px, right, px_x, px_y); d < best) best = d, x = px_x, y = px_y;
      }
    }
    const std::optional<Vec2> found = best < 1e9 ? refined(left, track.px, right, x, y) : std::nullopt;
    return found ? observe(rig_.right(), *found, kSigma_px) : std::nullopt;
  }

  /// The strongest corner of each cell of the image that has no track.
  void detect(const Image& image) {
    const int columns = static_cast<int>(image.width() / kCell_px), rows = static_cast<int>(image.height() / kCell_px);
    std::vector<bool> taken(static_cast<std::size_t>(columns + 1) * static_cast<std::size_t>(rows + 1), false);
    const auto cell = [&](double x, double y) {
      return static_cast<std::size_t>(y / kCell_px) * static_cast<std::size_t>(columns + 1) +
             static_cast<std::size_t>(x / kCell_px);
    };
    for (const Track& track : tracks_) taken[cell(track.px.x(), track.px.y())] = true;
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns && static_cast<int>(tracks_.size()) < kFeatures; ++column) {
        if (taken[cell(column * kCell_px, row * kCell_px)]) continue;
        double best = 2e5;
        std::optional<Vec2> corner;
        for (int y = static_cast<int>(row * kCell_px); y < (row + 1) * kCell_px; y += 2)
          for (int x = static_cast<int>(column * kCell_px); x < (column + 1) * kCell_px; x += 2)
            if (const double strength = harris(image, x, y); strength > best) best = strength, corner = Vec2(x, y);
        if (corner) tracks_.push_back({TrackId{next_id_++}, *corner});
      }
  }

  static double harris(const Image& image, int x, int y) {
    if (x < kHalf + 2 || y < kHalf + 2 || x >= image.width() - kHalf - 2 || y >= image.height() - kHalf - 2) return 0;
    double xx = 0, yy = 0, xy = 0;
    for (int v = y - 2; v <= y + 2; ++v)
      for (int u = x - 2; u <= x + 2; ++u) {
        const double gx = image.at(u + 1, v) - image.at(u - 1, v), gy = image.at(u, v + 1) - image.at(u, v - 1);
        xx += gx * gx, yy += gy * gy, xy += gx * gy;
      }
    return xx * yy - xy * xy - 0.04 * (xx + yy) * (xx + yy);
  }

  StereoRig rig_;
  std::shared_ptr<const Image> before_;
  std::vector<Track> tracks_;
  std::int64_t next_id_ = 0;
};

}  // namespace

FBVINS_FRONTENDS(add) {
  add({"blocks", "corners found again by comparing blocks of pixels", [](const StereoRig& rig, const FrontendOptions&) {
         return Result(
             for_any_rig(rig, kFeatures, [](const StereoRig& cameras) { return std::make_unique<BlockFrontend>(cameras); }));
       }});
}
