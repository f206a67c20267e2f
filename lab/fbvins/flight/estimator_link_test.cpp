// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/estimator_link.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "fbvins/sim/simulation.hpp"

namespace fbvins {
namespace estimator_link_test {

Time at_ms(std::int64_t ms) { return Time{ms * 1'000'000}; }

StereoFrame black_frame(std::int64_t ms) {
  const auto image = std::make_shared<const Image>(752, 480);
  return {at_ms(ms), {image, image}};
}

/// Stamps [ms] of the images whose estimates became available at each reading, in half a second of black images at rest.
std::vector<std::vector<std::int64_t>> told(RunMode mode, Mapper* mapper = nullptr) {
  auto link = EstimatorLink::create({.options = {}, .mode = mode, .mapper = mapper}, euroc_rig());
  EXPECT_TRUE(link) << link.error().message;
  std::vector<std::vector<std::int64_t>> known;
  for (std::int64_t ms = 0; ms <= 500; ms += 5) {
    if (ms % 50 == 25) {
      EXPECT_TRUE((*link)->push(black_frame(ms - 3)));  // arrives later than its stamp
    }
    EXPECT_TRUE((*link)->push(ImuSample{at_ms(ms), Vec3::Zero(), Vec3(0, 0, 9.81)}));
    const Result<std::vector<KnownEstimate>> now = (*link)->known_at(at_ms(ms - 30));
    EXPECT_TRUE(now);
    known.emplace_back();
    for (const KnownEstimate& e : *now) known.back().push_back(e.odometry.t.ns / 1'000'000);
  }
  EXPECT_TRUE((*link)->finish());
  return known;
}

TEST(EstimatorLink, AnswersEachImageOnceAfterTheDelay) {
  const auto known = told(RunMode::deterministic);
  std::vector<std::int64_t> all;
  for (std::size_t k = 0; k < known.size(); ++k)
    for (std::int64_t image : known[k]) {
      all.push_back(image);
      const auto now = static_cast<std::int64_t>(5 * k);
      EXPECT_GE(now - image, 30);
      EXPECT_LT(now - image, 35);
    }
  EXPECT_EQ(all, (std::vector<std::int64_t>{22, 72, 122, 172, 222, 272, 322, 372, 422}));
}

TEST(EstimatorLink, ThreadsChangeNothing) { EXPECT_EQ(told(RunMode::threaded), told(RunMode::deterministic)); }

TEST(EstimatorLink, ReportsAFailureInsteadOfWaiting) {
  EstimatorSetup setup;
  setup.mode = RunMode::threaded;
  setup.on_tracked_frame = [](const TrackedFrame&) { throw std::runtime_error("no film"); };
  auto link = EstimatorLink::create(setup, euroc_rig());
  ASSERT_TRUE(link);
  ASSERT_TRUE((*link)->push(black_frame(1)));
  (void)(*link)->push(ImuSample{at_ms(5), Vec3::Zero(), Vec3(0, 0, 9.81)});
  const auto known = (*link)->known_at(at_ms(1));
  ASSERT_FALSE(known);
  EXPECT_NE(known.error().message.find("no film"), std::string::npos) << known.error().message;
}

}  // namespace estimator_link_test
}  // namespace fbvins
