// SPDX-License-Identifier: Apache-2.0
// A rendered flight of a camera with a depth sensor through a room with hardly any texture, and with images that show nothing for
// two seconds while the depths stay.
#include <gtest/gtest.h>

#include <algorithm>

#include "fbvins/core/rng.hpp"
#include "fbvins/pipeline/system.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {
namespace {

constexpr double kBlankFrom_s = 2.5, kBlankTo_s = 4.5;

std::shared_ptr<const Image> plain(const Image& like, Rng& rng) {
  auto image = std::make_shared<Image>(like.width(), like.height());
  for (int y = 0; y < image->height(); ++y)
    for (int x = 0; x < image->width(); ++x) image->at(x, y) = static_cast<std::uint8_t>(130 + rng.normal());
  return image;
}

struct Flown {
  std::vector<Odometry> poses;
  std::vector<double> error_m;  ///< of those with a pose, position and heading aligned at the first
  double seconds(std::size_t i) const { return (poses[i].t - poses.front().t).seconds(); }
};

Flown fly(const std::string& frontend, bool blank, bool with_depth) {
  SimulationOptions options = *simulation_preset("weak-texture");
  options.seed = 21;
  options.rig = "rgbd";
  options.flight.duration_s = 6;
  Result<DatasetContents> contents = simulate(options);
  EXPECT_TRUE(contents.ok());
  const std::vector<TrajectoryPoint> truth = contents->ground_truth;
  Dataset data(*std::move(contents), {});
  Config config;
  config.frontend.kind = frontend;
  Result<System> system = System::create(config, data.rig());
  EXPECT_TRUE(system.ok());
  Flown out;
  system->on_odometry([&](const Odometry& o) { out.poses.push_back(o); });
  Rng rng(1, 1);
  std::optional<Time> first;
  while (auto event = data.next()) {
    if (auto* frame = std::get_if<StereoFrame>(&*event)) {
      if (!first) first = frame->t;
      const double at_s = (frame->t - *first).seconds();
      if (blank && at_s >= kBlankFrom_s && at_s < kBlankTo_s) {
        frame->left = plain(*frame->left, rng);
        if (!with_depth) frame->depth = nullptr;
      }
    }
    EXPECT_TRUE(system->push(std::move(*event)).ok());
  }
  EXPECT_TRUE(system->finish().ok());

  std::optional<Pose<W, W>> aligned;  // W of the truth from W of the odometry; both are level
  for (const Odometry& o : out.poses) {
    if (!o.health.has_pose()) continue;
    const auto at = std::ranges::min_element(truth, {}, [&](const TrajectoryPoint& p) { return std::abs((p.t - o.t).ns); });
    if (!aligned) aligned = at->T_WB * o.T_WB.inverse();
    out.error_m.push_back((*aligned * o.T_WB.p - at->T_WB.p).norm());
  }
  return out;
}

class DepthFlight : public testing::TestWithParam<const char*> {};

TEST_P(DepthFlight, IsGoodFromItsStartOn) {
  const Flown flown = fly(GetParam(), false, true);
  const auto first = std::ranges::find_if(flown.poses, [](const Odometry& o) { return o.health.has_pose(); });
  EXPECT_LT((first->t - flown.poses.front().t).seconds(), 1.0);
  for (auto o = first; o != flown.poses.end(); ++o) EXPECT_EQ(o->health.state, HealthState::good);
  EXPECT_LT(*std::ranges::max_element(flown.error_m), 0.03);
}

TEST_P(DepthFlight, DepthsCarryThePoseWhereImagesShowNothing) {
  const Flown with = fly(GetParam(), true, true), without = fly(GetParam(), true, false);
  bool degraded = false;
  for (std::size_t i = 0; i < with.poses.size(); ++i) {
    const Odometry& o = with.poses[i];
    EXPECT_NE(o.health.state, HealthState::lost);
    EXPECT_EQ(o.reset_counter, with.poses.back().reset_counter);
    if (with.seconds(i) > kBlankFrom_s + 0.2 && with.seconds(i) < kBlankTo_s) {
      EXPECT_EQ(o.health.state, HealthState::degraded);
      degraded = true;
    }
  }
  EXPECT_TRUE(degraded);
  EXPECT_EQ(with.poses.back().health.state, HealthState::good);
  const double worst = *std::ranges::max_element(with.error_m);
  EXPECT_LT(worst, 0.06);
  EXPECT_LT(worst, 0.5 * *std::ranges::max_element(without.error_m));
}

INSTANTIATE_TEST_SUITE_P(All, DepthFlight, testing::Values("klt", "boost"));

}  // namespace
}  // namespace fbvins
