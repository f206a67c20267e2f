// SPDX-License-Identifier: Apache-2.0
// In wall time: tests what arrives, not how fast.
#include "fbvins/flight/live_link.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "fbvins/live/host_clock.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {
namespace live_link_test {

Time at_ms(std::int64_t ms) { return Time{ms * 1'000'000}; }

/// A second at rest, with images that differ in one pixel (repeated images count as a frozen camera).
Result<std::vector<KnownEstimate>> rest(OdometryLink& link) {
  std::vector<KnownEstimate> all;
  for (std::int64_t ms = 0; ms <= 1000; ms += 5) {
    if (Result<void> pushed = link.push(ImuSample{at_ms(ms), Vec3::Zero(), Vec3(0, 0, 9.81)}); !pushed) return pushed.error();
    if (ms % 50 == 25) {
      Image image(752, 480);
      image.at(0, 0) = static_cast<std::uint8_t>(ms / 50);
      const auto shared = std::make_shared<const Image>(std::move(image));
      if (Result<void> pushed = link.push(StereoFrame{at_ms(ms - 3), {shared, shared}}); !pushed) return pushed.error();
    }
    Result<std::vector<KnownEstimate>> known = link.known_at(at_ms(ms));
    if (!known) return known.error();
    all.insert(all.end(), known->begin(), known->end());
  }
  return all;
}

TEST(LiveLink, EverythingGoesThroughTheSocketInWallTime) {
  auto link = LiveLink::create({}, {}, euroc_rig(), 2);
  ASSERT_TRUE(link) << link.error().message;
  const Time begin = host_now();
  const auto known = rest(**link);
  ASSERT_TRUE(known) << known.error().message;
  EXPECT_GE((host_now() - begin).seconds(), 0.49) << "a second at twice real time";
  ASSERT_TRUE((*link)->finish());
  const std::optional<WallTime> wall = (*link)->wall_time();
  ASSERT_TRUE(wall);
  EXPECT_EQ(wall->rate, 2);
  EXPECT_EQ(wall->live.counts.imu, 201);
  EXPECT_EQ(wall->live.counts.images, 20);
  EXPECT_EQ(wall->live.counts.images_incomplete, 0);
  EXPECT_EQ(wall->live.counts.images_estimated + wall->live.counts.images_dropped, 20);
  for (std::size_t i = 1; i < known->size(); ++i) EXPECT_LT((*known)[i - 1].odometry.t, (*known)[i].odometry.t);
}

TEST(LiveLink, FinishReportsAFailure) {
  EstimatorSetup setup;
  setup.on_tracked_frame = [](const TrackedFrame&) { throw std::runtime_error("no film"); };
  auto link = LiveLink::create(setup, {}, euroc_rig(), 4);
  ASSERT_TRUE(link);
  (void)rest(**link);
  const Result<void> done = (*link)->finish();
  ASSERT_FALSE(done);
  EXPECT_NE(done.error().message.find("no film"), std::string::npos) << done.error().message;
}

TEST(LiveLink, BadOptionsAreRefused) {
  LiveOptions options;
  options.camera_silence_s = -1;
  EXPECT_FALSE(LiveLink::create({}, options, euroc_rig(), 1));
}

}  // namespace live_link_test
}  // namespace fbvins
