// SPDX-License-Identifier: Apache-2.0
// What the doctor says of rendered flights with the vehicle's legs in view, without them, and at rest.
#include <gtest/gtest.h>

#include <algorithm>

#include "fbvins/doctor/collect.hpp"
#include "fbvins/doctor/doctor.hpp"
#include "fbvins/sim/legs.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {
namespace masks_test {

constexpr int kLegs = 3;

Diagnosis diagnosis_of(const char* preset, int seed, double seconds, int legs) {
  SimulationOptions options = *simulation_preset(preset);
  options.seed = seed;
  options.flight.duration_s = seconds;
  options.image_rate_hz = 10;
  options.camera.legs = legs;
  Result<DatasetContents> contents = simulate(options);
  EXPECT_TRUE(contents.ok());
  Dataset data(*std::move(contents), {});
  EvidenceCollector gatherer(data.rig());
  while (auto event = data.next())
    if (!gatherer.push(*event)) break;
  return examine(gatherer.finish());
}

/// Hidden pixels that two masks share, of those that either has.
double agreement(const Mask& a, const Mask& b) {
  double both = 0, either = 0;
  for (int y = 0; y < a.height(); ++y)
    for (int x = 0; x < a.width(); ++x) {
      both += a.hides(Vec2(x, y)) && b.hides(Vec2(x, y));
      either += a.hides(Vec2(x, y)) || b.hides(Vec2(x, y));
    }
  return both / either;
}

const Finding* found_in_view(const Diagnosis& diagnosis) {
  const auto finding = std::ranges::find(diagnosis.findings, FindingKind::fixed_in_view, &Finding::kind);
  return finding == diagnosis.findings.end() ? nullptr : &*finding;
}

TEST(Masks, TheDoctorFindsTheLegsOfAFlight) {
  const Diagnosis diagnosis = diagnosis_of("normal", 3, 16, kLegs);
  const Finding* finding = found_in_view(diagnosis);
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->corrected, "cam0/sensor.yaml: mask: mask0.png\ncam1/sensor.yaml: mask: mask1.png");
  ASSERT_EQ(diagnosis.masks.size(), 2u);
  for (int camera = 0; camera < 2; ++camera) {
    const auto& mask = diagnosis.masks[static_cast<std::size_t>(camera)];
    ASSERT_TRUE(mask) << camera;
    EXPECT_GE(agreement(*mask, Mask(Legs(752, 480, kLegs, camera).seen())), 0.7) << camera;
    EXPECT_EQ(diagnosis.rig.camera(camera).mask(), mask);
  }
}

TEST(Masks, TheDoctorFindsNoneWhereThereAreNone) {
  const Diagnosis diagnosis = diagnosis_of("normal", 3, 16, 0);
  EXPECT_EQ(found_in_view(diagnosis), nullptr);
  EXPECT_TRUE(diagnosis.masks.empty());
}

TEST(Masks, TheDoctorDoesNotJudgeARecordingAtRest) {
  const Diagnosis diagnosis = diagnosis_of("takeoff", 3, 3, kLegs);  // two seconds on the floor
  EXPECT_EQ(found_in_view(diagnosis), nullptr);
  EXPECT_TRUE(
      std::ranges::any_of(diagnosis.not_judged, [](const std::string& text) { return text.find("masks") != std::string::npos; }));
}

}  // namespace masks_test
}  // namespace fbvins
