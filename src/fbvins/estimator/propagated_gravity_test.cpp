// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/propagated_gravity.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/angle.hpp"

namespace fbvins {
namespace propagated_gravity_test {

/// Where the two contradict each other.
std::optional<Vec3> contradiction(const PropagatedGravity& up, const Vec3& up_B, const Vec3& gyro_bias_radps) {
  const auto difference = up.difference(up_B, gyro_bias_radps);
  return difference && difference->contradiction ? std::optional(difference->turn_B) : std::nullopt;
}

const Vec3 kRate(0.5, -0.2, 0.3), kBias(0.01, 0.02, -0.01);

/// A vehicle that turns steadily, whose window is good until `good_s`.
class Turning {
 public:
  PropagatedGravity up;
  Vec3 truth() const { return so3_exp(t_s_ * kRate).conjugate() * Vec3::UnitZ(); }
  void fly(double seconds, bool good, const Vec3& tilted = Vec3::Zero()) {
    for (const double end = t_s_ + seconds; t_s_ < end - 1e-6;) {
      ImuSegment readings;
      for (int i = 0; i <= 10; ++i)
        readings.samples.push_back({Time{} + Duration::from_seconds(t_s_ + 0.005 * i), kRate + kBias, Vec3::Zero()});
      readings.longest_gap = Duration::from_seconds(0.005);
      t_s_ += 0.05;
      up.carry(Time{} + Duration::from_seconds(t_s_), readings);
      if (good) up.take({so3_exp(tilted) * truth(), 0.003, kBias, 0.001});
    }
  }

 private:
  double t_s_ = 0;
};

TEST(PropagatedGravity, ContradictsAStartWithAnotherTilt) {
  Turning vehicle;
  vehicle.fly(5, true);
  vehicle.fly(0.5, false);
  vehicle.up.restart();
  vehicle.fly(1, false);
  EXPECT_FALSE(contradiction(vehicle.up, so3_exp(Vec3(2 * kDegree, 0, 0)) * vehicle.truth(), kBias));
  const auto away = contradiction(vehicle.up, so3_exp(Vec3(8 * kDegree, 0, 0)) * vehicle.truth(), kBias);
  ASSERT_TRUE(away);
  EXPECT_LT(away->norm(), 8.1 * kDegree);
  EXPECT_LT((so3_exp(*away) * (so3_exp(Vec3(8 * kDegree, 0, 0)) * vehicle.truth()) - vehicle.truth()).norm(), 0.002);
}

TEST(PropagatedGravity, IsFromTwoSecondsBeforeTheEndOfTheGoodPoses) {
  Turning vehicle;
  vehicle.fly(5, true);
  vehicle.fly(1.5, true, Vec3(6 * kDegree, 0, 0));  // what failed had already spoiled the tilt
  vehicle.up.restart();
  vehicle.fly(0.5, false);
  EXPECT_FALSE(contradiction(vehicle.up, vehicle.truth(), kBias));
}

TEST(PropagatedGravity, SaysNothingWhereTheGyroscopeCannotCarryIt) {
  const auto other = [](const Turning& vehicle) { return so3_exp(Vec3(12 * kDegree, 0, 0)) * vehicle.truth(); };
  Turning vehicle;
  EXPECT_FALSE(contradiction(vehicle.up, other(vehicle), kBias));  // the first start
  vehicle.fly(5, true);
  vehicle.up.restart();
  vehicle.fly(1, false);
  ASSERT_TRUE(contradiction(vehicle.up, other(vehicle), kBias));
  EXPECT_FALSE(contradiction(vehicle.up, other(vehicle), kBias + Vec3(0, 0, 0.05)));  // its bias has moved
  Turning later = vehicle;
  later.fly(30, false);
  EXPECT_FALSE(contradiction(later.up, other(later), kBias));
  vehicle.up.carry(Time{} + Duration::from_seconds(7), {});  // readings are missing
  EXPECT_FALSE(contradiction(vehicle.up, other(vehicle), kBias));
}

TEST(PropagatedGravity, IsConfirmedByTwoSecondsOfGoodPosesThatAgree) {
  const auto remembered_after = [](double tilt_deg) {
    Turning vehicle;
    vehicle.fly(5, true);
    vehicle.up.restart();
    vehicle.fly(0.5, false);
    vehicle.fly(2.2, true, Vec3(tilt_deg * kDegree, 0, 0));
    return vehicle.up.difference(-vehicle.truth(), kBias).has_value();
  };
  EXPECT_FALSE(remembered_after(1));
  EXPECT_TRUE(remembered_after(4));
}

TEST(PropagatedGravity, ThroughAContradictionIsFromBeforeIt) {
  const Vec3 tilt(6 * kDegree, 0, 0);
  Turning vehicle;
  vehicle.fly(5, true);
  EXPECT_FALSE(vehicle.up.difference(so3_exp(tilt) * vehicle.truth(), kBias));
  vehicle.up.hold();
  vehicle.fly(2, false);
  vehicle.fly(2.2, true, tilt);  // called good
  vehicle.up.hold();             // a second one
  vehicle.fly(1, false);
  const auto difference = vehicle.up.difference(so3_exp(tilt) * vehicle.truth(), kBias);
  ASSERT_TRUE(difference);
  EXPECT_FALSE(difference->contradiction) << "the gyroscope may be what was wrong";
  EXPECT_LT((so3_exp(difference->turn_B) * (so3_exp(tilt) * vehicle.truth()) - vehicle.truth()).norm(), 0.002);
  vehicle.fly(2.2, true);
  EXPECT_FALSE(vehicle.up.difference(vehicle.truth(), kBias)) << "confirmed";
}

TEST(PropagatedGravity, IsADifferenceWhereItIsNoContradiction) {
  Turning vehicle;
  vehicle.fly(5, true);
  vehicle.up.restart();
  vehicle.fly(1, false);
  const auto difference = vehicle.up.difference(so3_exp(Vec3(2 * kDegree, 0, 0)) * vehicle.truth(), kBias);
  ASSERT_TRUE(difference);
  EXPECT_FALSE(difference->contradiction);
  EXPECT_LT((so3_exp(difference->turn_B) * (so3_exp(Vec3(2 * kDegree, 0, 0)) * vehicle.truth()) - vehicle.truth()).norm(), 0.002);
}

}  // namespace propagated_gravity_test
}  // namespace fbvins
