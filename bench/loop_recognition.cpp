// SPDX-License-Identifier: Apache-2.0
// How well places are recognised and verified, on stereo keyframes with known poses:
//
//   loop_recognition VOCABULARY DATASET [OTHER_DATASET...]     with a boosted vocabulary: boosted descriptors
//
// Within the first recording every pair is tested without help of the odometry: recall over the pairs that share more than
// 40 % of their view, precision of the accepted pairs. Between it and the others every accepted pair is a false loop.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "fbvins/core/stage_timer.hpp"
#include "fbvins/eval/statistics.hpp"
#include "fbvins/features/booster.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/loop/inverted_index.hpp"
#include "fbvins/loop/place_extractor.hpp"
#include "fbvins/loop/place_verifier.hpp"
#include "fbvins/loop/vocabulary_file.hpp"

using namespace fbvins;

namespace {

constexpr double kShared = 0.4;
constexpr double kCorrect_m = 0.30, kCorrect_rad = 0.09;

struct View {
  Time t;
  Pose<W, B> T_WB;
  Place place;
};

struct Recording {
  StereoRig rig;
  std::vector<View> views;
  double extract_ms = 0;
};

Pose<W, B> truth_at(const std::vector<TrajectoryPoint>& truth, Time t) {
  const auto it = std::lower_bound(truth.begin(), truth.end(), t, [](const TrajectoryPoint& p, Time x) { return p.t < x; });
  return it == truth.end() ? truth.back().T_WB : it->T_WB;
}

/// Every n-th frame that has a pose.
std::optional<Recording> load(const std::string& path, const Vocabulary& vocabulary, int every) {
  DatasetOptions options;
  options.require_imu = false;
  auto opened = open_dataset(path, options);
  if (!opened) {
    fmt::print(stderr, "{}\n", opened.error().message);
    return std::nullopt;
  }
  Dataset& data = **opened;
  Recording r{data.rig(), {}, 0};
  auto stage = vocabulary.kind() == kBoostedDescriptors ? make_booster_stage({}) : Result(make_identity_stage());
  if (!stage) {
    fmt::print(stderr, "{}\n", stage.error().message);
    return std::nullopt;
  }
  PlaceExtractor extractor(r.rig, {}, vocabulary, *std::move(stage));
  for (int n = 0; auto event = data.next();) {
    const auto* frame = std::get_if<StereoFrame>(&*event);
    if (frame == nullptr || n++ % every != 0) continue;
    const Pose<W, B> T_WB = truth_at(data.ground_truth(), frame->t);
    CpuTimer timer;
    Place place = extractor.extract(*frame, T_WB.R());
    r.extract_ms += timer.lap_ms();
    r.views.push_back({frame->t, T_WB, std::move(place)});
  }
  return r;
}

/// Whether b sees a surface at the distance of p: the depth of the nearest feature agrees.
bool surface_agrees(const View& b, const Vec3& p) {
  const Vec2 xy = p.hnormalized();
  double nearest = 1e9, inverse_depth = 0;
  for (const PlaceFeature& f : b.place.features)
    if (f.has_point() && (f.xy() - xy).squaredNorm() < nearest)
      nearest = (f.xy() - xy).squaredNorm(), inverse_depth = f.inverse_depth;
  return std::abs(inverse_depth * p.z() - 1) < 0.2;
}

/// Share of a's points that fall into b's view and are not hidden there by another surface.
double seen_from(const StereoRig& rig, const View& a, const View& b) {
  const Pose<C0, C0> T_ba = (b.T_WB * rig.T_BC0).inverse() * (a.T_WB * rig.T_BC0);
  int points = 0, inside = 0;
  for (const PlaceFeature& f : a.place.features) {
    if (!f.has_point()) continue;
    ++points;
    const Vec3 p = T_ba * f.p_C0();
    if (!(p.z() > 0.1)) continue;
    const auto px = rig.left.project(p);
    inside += px && rig.left.inside(*px) && surface_agrees(b, p);
  }
  return points > 0 ? static_cast<double>(inside) / points : 0;
}

void within(const Recording& r, const Vocabulary& vocabulary, const PlaceVerifierOptions& verification) {
  InvertedIndex index(vocabulary.words());
  for (std::size_t i = 0; i < r.views.size(); ++i) index.add(KeyframeId{static_cast<std::int64_t>(i)}, r.views[i].place.words);
  PlaceVerifier verifier(verification);
  int sharing = 0, found = 0, retrieved = 0, accepted = 0, wrong = 0;
  double verify_ms = 0, verified = 0;
  std::vector<double> error_mm, error_mrad, nees;
  for (std::size_t i = 0; i < r.views.size(); ++i) {
    const View& q = r.views[i];
    verifier.set_query(q.place);
    const auto hits = index.query(q.place.words, 10, [&](KeyframeId k) { return k.value != static_cast<std::int64_t>(i); });
    for (std::size_t j = 0; j < r.views.size(); ++j) {
      if (j == i) continue;
      const View& c = r.views[j];
      const bool shares = std::min(seen_from(r.rig, q, c), seen_from(r.rig, c, q)) > kShared;
      CpuTimer timer;
      const auto pose = verifier.verify(c.place);
      verify_ms += timer.lap_ms(), ++verified;
      sharing += shares;
      found += shares && pose;
      retrieved += shares && std::any_of(hits.begin(), hits.end(),
                                         [&](const IndexHit& h) { return h.keyframe.value == static_cast<std::int64_t>(j); });
      if (!pose) continue;
      ++accepted;
      const Pose<C0, C0> truth = (q.T_WB * r.rig.T_BC0).inverse() * (c.T_WB * r.rig.T_BC0);
      Vec6 e;
      e << truth.p - pose->pose.T_qc.p, so3_log(pose->pose.T_qc.q.conjugate() * truth.q);
      if (e.head<3>().norm() > kCorrect_m || e.tail<3>().norm() > kCorrect_rad) {
        ++wrong;
        fmt::print(
            "  wrong: {} <- {} by {:.2f} m {:.1f} deg, {} inliers of {} visible in {} cells, truth {:.2f} m apart, shared {:.2f}\n",
            i, j, e.head<3>().norm(), e.tail<3>().norm() * 57.3, pose->pose.inliers.size(), pose->visible, pose->cells,
            truth.p.norm(), seen_from(r.rig, c, q));
      } else {
        error_mm.push_back(e.head<3>().norm() * 1e3), error_mrad.push_back(e.tail<3>().norm() * 1e3);
        nees.push_back(e.dot(pose->pose.information * e));
      }
    }
  }
  const ErrorStatistics p = statistics_of(error_mm), a = statistics_of(error_mrad), n = statistics_of(nees);
  fmt::print("{} keyframes, extraction {:.2f} ms, verification {:.2f} ms a pair\n", r.views.size(), r.extract_ms / r.views.size(),
             verify_ms / verified);
  fmt::print("pairs sharing > 40 %: {}; recall {:.1f} %, among the ten most similar {:.1f} %\n", sharing, 100.0 * found / sharing,
             100.0 * retrieved / sharing);
  fmt::print("accepted {}, wrong {}: precision {:.2f} %\n", accepted, wrong,
             accepted > 0 ? 100.0 * (accepted - wrong) / accepted : 100.0);
  fmt::print("error median {:.1f} mm {:.2f} mrad, rms {:.1f} mm {:.2f} mrad, NEES median {:.1f} mean {:.1f} (6)\n", p.median,
             a.median, p.rmse, a.rmse, n.median, n.mean);
}

void across(const Recording& a, const Recording& b, const PlaceVerifierOptions& verification) {
  PlaceVerifier verifier(verification);
  int queries = 0, most = 0;
  std::vector<std::string> accepted;
  for (std::size_t i = 0; i < a.views.size(); ++i) {
    verifier.set_query(a.views[i].place);
    for (std::size_t j = 0; j < b.views.size(); ++j) {
      ++queries;
      const auto pose = verifier.verify(b.views[j].place);
      most = std::max(most, static_cast<int>(verifier.last().pose.inliers.size()));
      if (pose)
        accepted.push_back(
            fmt::format("{} <- {}: {} of {} visible, {} cells", i, j, pose->pose.inliers.size(), pose->visible, pose->cells));
    }
  }
  fmt::print("across scenes: {} pairs, {} accepted, most inliers of any {}\n", queries, accepted.size(), most);
  for (const std::string& line : accepted) fmt::print("  false: {}\n", line);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "usage: loop_recognition VOCABULARY DATASET [OTHER_DATASET...]\n");
    return 2;
  }
  const auto vocabulary = Vocabulary::open(argv[1]);
  if (!vocabulary) {
    fmt::print(stderr, "{}\n", vocabulary.error().message);
    return 2;
  }
  const char* every_text = std::getenv("EVERY");
  const int every = every_text != nullptr ? std::atoi(every_text) : 1;
  const auto first = load(argv[2], *vocabulary, every);
  if (!first) return 2;
  const PlaceVerifierOptions verification = vocabulary->kind() == kBoostedDescriptors ? for_boosted({}) : PlaceVerifierOptions{};
  within(*first, *vocabulary, verification);
  for (int i = 3; i < argc; ++i)
    if (const auto other = load(argv[i], *vocabulary, 16)) across(*first, *other, verification);
  return 0;
}
