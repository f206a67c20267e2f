// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/lens_watch.hpp"

#include <algorithm>
#include <utility>

#include "fbvins/core/median.hpp"
#include "fbvins/frontend/frame_images.hpp"

namespace fbvins {
namespace {

/// At a quarter of their size; the newest looks, and after how many more they are judged.
constexpr FixedEdgeRule kRule{.reduction = 4,
                              .across_px = 16,
                              .fewest_pairs = 8,
                              .around_px = 8,
                              .gap_px = 3,
                              .speck_px = 1,
                              .smallest_px = 40,
                              .largest_hole_px = 1000,
                              .skirt_px = 1};
constexpr std::size_t kLooks = 16;
constexpr int kLooksToJudgment = 6;
/// Judgments in a row that find an edge fixed, before it counts: those of the scene that meet at a pixel by chance do not last.
constexpr int kJudgments = 2;
/// From a look to the next: motion of the scene by the rig's turn, and time.
constexpr double kStep_px = 8, kStep_s = 0.3;
/// A feature that moves has moved so far from a look to the next, and so many of a camera's must.
constexpr double kFeatureMoves_px = 2;
constexpr std::size_t kFewestMoving = 8;
/// The estimator's bias of the gyroscope is known so well.
constexpr float kBias_radps = 0.005f;
/// A mask is replaced by one that differs from it in this share of what either hides.
constexpr double kChanged = 0.25;

/// Each pixel the mean of the two middle rows of a square of 4 x 4.
std::shared_ptr<const Image> quarter_of(const Image& image) {
  constexpr int k = kRule.reduction;
  auto out = std::make_shared<Image>(image.width() / k, image.height() / k);
  std::vector<std::uint16_t> columns(static_cast<std::size_t>(out->width() * k));
  for (int y = 0; y < out->height(); ++y) {
    const std::uint8_t *a = image.row(k * y + 1), *b = image.row(k * y + 2);
    for (std::size_t x = 0; x < columns.size(); ++x) columns[x] = static_cast<std::uint16_t>(a[x] + b[x]);
    std::uint8_t* const row = out->row(y);
    for (int x = 0; x < out->width(); ++x) {
      const std::uint16_t* const four = columns.data() + k * x;
      row[x] = static_cast<std::uint8_t>((four[0] + four[1] + four[2] + four[3] + k) / (2 * k));
    }
  }
  return out;
}

Camera& camera_of(StereoRig& rig, int i) {
  return i == 0 ? rig.left : i == 1 ? rig.right : rig.more[static_cast<std::size_t>(i - 2)].camera;
}

const std::optional<Observation>& seen_by(const TrackedFeature& feature, int camera) {
  return feature.cameras.left == camera ? feature.left : feature.right;
}

/// Black pixels of either image, and of one alone.
std::pair<int, int> black_in(const Image& a, const Image& b) {
  int either = 0, one = 0;
  for (int y = 0; y < a.height(); ++y)
    for (int x = 0; x < a.width(); ++x) {
      either += a.at(x, y) == 0 || b.at(x, y) == 0;
      one += a.at(x, y) != b.at(x, y);
    }
  return {either, one};
}

}  // namespace

LensWatch::LensWatch(const StereoRig& rig) : rig_(rig) {
  for (int i = 0; i < rig.camera_count(); ++i) {
    const Camera& camera = rig.camera(i);
    watched_.push_back({FixedEdges(camera, kRule), camera.mask(), std::make_shared<std::shared_ptr<const Mask>>(camera.mask())});
    camera_of(rig_, i).share_mask(watched_.back().shown);
  }
}

void LensWatch::add(const SensorPacket& packet, const StatePrior& prior, const TrackedFrame& tracked) {
  Vec3 turned_B = Vec3::Zero();
  const std::vector<ImuSample>& readings = packet.imu.samples;
  for (std::size_t i = 1; i < readings.size(); ++i)
    turned_B += (0.5 * (readings[i - 1].gyro_radps + readings[i].gyro_radps) - prior.bias.gyro_radps) *
                (readings[i].t - readings[i - 1].t).seconds();
  for (int i = 0; i < rig_.camera_count(); ++i) {
    Watched& watched = watched_[static_cast<std::size_t>(i)];
    watched.step.turned_B += turned_B;
    watched.step.known = watched.step.known && prior.valid && !packet.imu.empty();
    const auto image = packet.frame.image(i);
    if (!is_usable(image.get(), rig_.camera(i))) continue;
    const double turned_px = rig_.camera(i).focal_px() * watched.step.turned_B.norm();
    if (watched.looks == 0 || (turned_px >= kStep_px && (packet.frame.t - watched.looked).seconds() >= kStep_s))
      look(watched, i, *image, tracked);
  }
}

void LensWatch::look(Watched& watched, int camera, const Image& image, const TrackedFrame& tracked) {
  // The scene's motion is that of the median feature of those that move: what is fixed in view does not.
  std::vector<SeenAt> seen;
  for (const TrackedFeature& feature : tracked.features)
    if (feature.cameras.has(camera) && seen_by(feature, camera)) seen.push_back({feature.id, seen_by(feature, camera)->pixel});
  std::ranges::sort(seen, {}, [](const SeenAt& s) { return s.id.value; });
  std::vector<double> x_px, y_px;
  auto before = watched.seen.begin();
  for (const SeenAt& now : seen) {
    while (before != watched.seen.end() && before->id.value < now.id.value) ++before;
    if (before == watched.seen.end() || before->id != now.id) continue;
    const Vec2 moved_px = now.px - before->px;
    if (moved_px.norm() > kFeatureMoves_px) x_px.push_back(moved_px.x()), y_px.push_back(moved_px.y());
  }
  watched.step.known = watched.step.known && x_px.size() >= kFewestMoving;
  watched.step.moved_px = Vec2(median(x_px), median(y_px));
  watched.steps[static_cast<std::size_t>(watched.looks) % kLooksApart] = watched.step;
  watched.seen = std::move(seen);

  Look newest{.image = quarter_of(image)};
  if (std::ranges::all_of(watched.steps, &Step::known)) {
    Step sum;
    for (const Step& step : watched.steps) sum.moved_px += step.moved_px, sum.turned_B += step.turned_B;
    newest.moved_px = sum.moved_px.cast<float>();
    newest.turned_rad = Vec3(rig_.T_BC(camera).q.conjugate() * sum.turned_B).cast<float>();
    newest.by_bias_rad = kBias_radps * static_cast<float>(kLooksApart * kStep_s);
  }
  watched.fixed.add(std::move(newest), kLooks);
  watched.looked = tracked.t;
  watched.step = {.known = true};
  if (++watched.looks % kLooksToJudgment == 0 && watched.fixed.size() == kLooks) judge(watched, rig_.camera(camera));
}

void LensWatch::judge(Watched& watched, const Camera& camera) {
  Image now = watched.fixed.edges(watched.edges.empty() ? nullptr : &watched.edges);
  if (watched.edges.empty()) {
    watched.edges = watched.covered = Image(now.width(), now.height(), 255);
    watched.times = Image(now.width(), now.height(), 0);
  }
  for (int y = 0; y < now.height(); ++y)
    for (int x = 0; x < now.width(); ++x) {
      std::uint8_t& times = watched.times.at(x, y);
      times = now.at(x, y) == 0 ? static_cast<std::uint8_t>(std::min(times + 1, kJudgments)) : std::uint8_t{0};
      watched.edges.at(x, y) = times == kJudgments ? 0 : 255;
    }
  Image found = watched.fixed.parts(watched.edges);
  const auto [either, one] = black_in(found, watched.covered);
  if (one <= kChanged * either) return;

  Image seen = watched.own ? watched.own->image() : Image(camera.width(), camera.height(), 255);
  int covered_px = 0;
  for (int y = 0; y < kRule.reduction * found.height(); ++y)
    for (int x = 0; x < kRule.reduction * found.width(); ++x) {
      if (found.at(x / kRule.reduction, y / kRule.reduction) != 0) continue;
      if (watched.own && watched.own->hides(Vec2(x, y), kBesideMask_px)) continue;
      seen.at(x, y) = 0;
      ++covered_px;
    }
  const double share = covered_px / (1.0 * seen.width() * seen.height());
  if (share > kMostFixedShare) return;
  const bool any = share >= kLeastFixedShare;
  watched.covered = any ? std::move(found) : Image(found.width(), found.height(), 255);
  watched.covered_px = any ? covered_px : 0;
  *watched.shown = any ? std::make_shared<const Mask>(seen) : watched.own;
}

}  // namespace fbvins
