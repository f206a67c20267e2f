// SPDX-License-Identifier: Apache-2.0
// How far M is from the building's frame, without any alignment: flights with tags on walls (fbvins simulate --tags 3), with
// right numbers and with wrong ones, and with positions of 10 cm at 5 Hz instead, with and without outliers
// (docs/experiments/maps.md).
//
//   anchors [--adjust] RECORDING...          a recording's tags.yaml lies in its folder; --adjust: with the final adjustment
//                                            as well
#include <fmt/format.h>

#include <string_view>

#include "fbvins/calibration/tag_finder.hpp"
#include "fbvins/config/config.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/eval/evaluation.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/loop/loop_map.hpp"
#include "fbvins/pipeline/system.hpp"

using namespace fbvins;

namespace {

constexpr double kPositionSigma_m = 0.1, kOutlier_m = 3, kPositions_hz = 5;

/// The odometry of a recording, and what a mapper would have got.
struct Flown {
  std::vector<Keyframe> keyframes;
  std::vector<Odometry> odometry;
};

Flown flown(Dataset& data) {
  Flown out;
  Config config;
  config.frontend.kind = "klt";
  System system = *System::create(config, data.rig());
  system.on_keyframe([&](const Keyframe& k) { out.keyframes.push_back(k); });
  system.on_odometry([&](const Odometry& o) { out.odometry.push_back(o); });
  while (auto event = data.next())
    if (!system.push(std::move(*event))) break;  // finish() says why
  if (Result<void> end = system.finish(); !end) throw std::runtime_error(end.error().message);
  return out;
}

struct Anchoring {
  bool tags = false, final_ba = false;
  double wrong_share = 0;

  std::string name() const {
    return fmt::format("{}, {:2.0f} % wrong{}", tags ? "tags" : "positions", 100 * wrong_share, final_ba ? ", adjusted" : "");
  }
};

/// Gives a share of the tags the number, and so the place, of another one.
void confuse(std::vector<TagAnchor>& tags, const TagSurvey& survey, double share, Rng& rng) {
  for (TagAnchor& tag : tags) {
    if (rng.uniform() >= share) continue;
    auto other = survey.T_AT.begin();
    std::advance(other, rng.below(static_cast<std::uint32_t>(survey.T_AT.size())));
    if (other->first == tag.id && ++other == survey.T_AT.end()) other = survey.T_AT.begin();
    tag.id = other->first, tag.T_AT = other->second;
  }
}

/// Positions since the keyframe before, by the truth.
std::vector<Anchor> positions_between(const std::vector<TrajectoryPoint>& truth, Time from, Time to, double wrong_share,
                                      Rng& rng) {
  std::vector<Anchor> out;
  Time next = from;
  for (const TrajectoryPoint& p : truth) {
    if (p.t <= from || p.t > to || p.t < next) continue;
    next = p.t + Duration::from_seconds(1 / kPositions_hz);
    Vec3 error(rng.normal(), rng.normal(), rng.normal());
    error *= kPositionSigma_m;
    if (rng.uniform() < wrong_share) error = kOutlier_m * Vec3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1));
    out.push_back(
        PositionAnchor{.t = p.t, .p_A = p.T_WB.p + error, .covariance = kPositionSigma_m * kPositionSigma_m * Mat3::Identity()});
  }
  return out;
}

std::string errors(const std::vector<TrajectoryPoint>& truth, const Trajectory<M>& in_M) {
  Trajectory<W> reference;
  for (const TrajectoryPoint& p : truth) reference.push_back({p.t, p.T_WB});
  const auto e = evaluate(reference, in_M, {.association = {}, .alignment = Alignment::none});
  return e ? fmt::format("{:7.1f} mm {:6.3f} deg", 1e3 * e->absolute_m.rmse, e->absolute_rotation_deg.rmse) : "-";
}

void measure(const Anchoring& anchoring, const Flown& flight, Dataset& data, const TagSurvey& survey) {
  Rng rng(17);
  TagFinder finder = *TagFinder::create(data.rig(), survey);
  auto map = *LoopMap::create(data.rig());
  Trajectory<M> causal;
  double anchored_s = 0;
  int seen = 0, refused = 0;
  std::size_t next = 0;
  std::optional<MapUpdate> known;
  Time before = flight.keyframes.front().t;
  for (Keyframe k : flight.keyframes) {
    for (; next < flight.odometry.size() && flight.odometry[next].t <= k.t; ++next)
      if (known && flight.odometry[next].health.has_pose())
        causal.push_back({flight.odometry[next].t, known->T_MG * flight.odometry[next].gauge.T_GB});
    if (anchoring.tags) {
      std::vector<TagAnchor> tags = finder.find(k.images);
      confuse(tags, survey, anchoring.wrong_share, rng);
      k.anchors.assign(tags.begin(), tags.end());
    } else {
      k.anchors = positions_between(data.ground_truth(), before, k.t, anchoring.wrong_share, rng);
    }
    before = k.t;
    seen += static_cast<int>(k.anchors.size());
    const MapUpdate u = map->process(k);
    refused += u.stats.anchors_refused;
    if (u.anchored && !known) anchored_s = (k.t - flight.keyframes.front().t).seconds();
    if (u.anchored) known = u;
  }
  const PoseGraphReport graph = map->finish();
  if (anchoring.final_ba) (void)map->adjust();
  Trajectory<G> in_G;
  for (const Odometry& o : flight.odometry)
    if (o.health.has_pose()) in_G.push_back({o.t, o.gauge.T_GB});
  fmt::print(
      "  {:<34} {:4} anchors, {:3} refused in flight, {:3} by the graph; anchored after {:4.1f} s; in flight {}, after it {}\n",
      anchoring.name(), seen, refused, graph.anchors_rejected, anchored_s, errors(data.ground_truth(), causal),
      errors(data.ground_truth(), map->corrected(in_G)));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const bool adjust = argc > 1 && std::string_view(argv[1]) == "--adjust";
  if (argc < 2 + adjust) {
    fmt::print(stderr, "usage: anchors [--adjust] RECORDING...\n");
    return 2;
  }
  for (int i = 1 + adjust; i < argc; ++i) {
    const auto data = open_dataset(argv[i]);
    const auto survey = load_tags(std::string(argv[i]) + "/tags.yaml");
    if (!data || !survey) {
      fmt::print(stderr, "{}\n", (!data ? data.error() : survey.error()).message);
      return 2;
    }
    const Flown flight = flown(**data);
    fmt::print("{}, {} keyframes\n", argv[i], flight.keyframes.size());
    for (const bool tags : {true, false})
      for (const double wrong_share : {0.0, 0.2})
        for (const bool final_ba : {false, true})
          if (adjust || !final_ba) measure({tags, final_ba, wrong_share}, flight, **data, *survey);
  }
  return 0;
}
