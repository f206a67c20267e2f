// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/propagated_velocity.hpp"

#include <gtest/gtest.h>

#include "fbvins/imu/propagation.hpp"

namespace fbvins {
namespace propagated_velocity_test {

const Vec3 kThing(1.5, 0, 0);  ///< velocity of what fills the view, in G

/// A vehicle that turns and accelerates, 20 images a second. Each image shows 40 tracks, ten of which are new.
class Vehicle {
 public:
  PropagatedVelocity velocity;
  NavState<G> truth;
  Duration longest_gap = Duration::from_seconds(0.005);
  bool disputed = false;  ///< images contradict the readings
  double sigma_mps = 0.01;

  Vehicle() { truth.v_FB = Vec3(0.4, 0.2, 0); }
  void fly(double seconds, const Vec3& along = Vec3::Zero(), int tracks = 40) {
    for (const double end = t_s_ + seconds; t_s_ < end - 1e-6;) {
      ImuSegment readings;
      for (int i = 0; i <= 10; ++i)
        readings.samples.push_back(
            {Time{} + Duration::from_seconds(t_s_ + 0.005 * i), Vec3(0.3, -0.2, 0.5), Vec3(0.2, 0.1, 9.9)});
      readings.longest_gap = longest_gap;
      t_s_ += 0.05;
      truth = propagate(truth, readings, level_gravity());
      velocity.carry(readings);
      first_ += 10;
      see(along, tracks);
    }
  }
  /// All that is in view is replaced.
  void look_elsewhere() { first_ += 1000; }
  /// What was in view `images` ago is seen again.
  void look_back(int by) { first_ -= by; }

 private:
  void see(const Vec3& along, int tracks) {
    NavState<G> seen = truth;
    seen.v_FB += along;
    std::vector<TrackId> ids;
    for (int i = tracks; i-- > 0;) ids.push_back(TrackId{first_ + i});
    velocity.compare({.state = seen, .velocity_sigma_mps = sigma_mps, .tilt_sigma_rad = 0.003}, ids, disputed);
  }
  std::int64_t first_ = 0;
  double t_s_ = 0;
};

TEST(PropagatedVelocity, ContradictsAThingThatFillsTheView) {
  Vehicle vehicle;
  vehicle.fly(3);
  vehicle.look_elsewhere();
  vehicle.fly(0.05, kThing);
  ASSERT_TRUE(vehicle.velocity.contradicted());
  EXPECT_LT((vehicle.velocity.velocity_G() - kThing).norm(), 1e-9);
  vehicle.fly(1.95, kThing);
  ASSERT_TRUE(vehicle.velocity.contradicted());
  EXPECT_NEAR(vehicle.velocity.shift_G().x(), 2 * kThing.x(), 1e-6);
  EXPECT_FALSE(vehicle.velocity.take_reset());
  vehicle.look_elsewhere();
  vehicle.fly(0.05);
  EXPECT_FALSE(vehicle.velocity.contradicted());
  EXPECT_TRUE(vehicle.velocity.take_reset());
  EXPECT_FALSE(vehicle.velocity.take_reset());
  EXPECT_TRUE(vehicle.velocity.shift_G().isZero(0));
}

TEST(PropagatedVelocity, SaysNothingOfAnotherViewThatStands) {
  Vehicle vehicle;
  for (int i = 0; i < 10; ++i) {
    vehicle.fly(1);
    vehicle.look_elsewhere();
  }
  vehicle.fly(0.5, Vec3::Zero(), 0);  // dark
  vehicle.look_elsewhere();
  vehicle.fly(1, Vec3(0.2, 0, 0));  // as wrong as velocities are after it
  EXPECT_FALSE(vehicle.velocity.contradicted());
  EXPECT_FALSE(vehicle.velocity.take_reset());
}

TEST(PropagatedVelocity, BelievesImagesThatShowWhatWasSeenBefore) {
  Vehicle vehicle;
  vehicle.fly(2);
  vehicle.fly(2, kThing);  // it is the readings that are wrong
  EXPECT_FALSE(vehicle.velocity.contradicted());
  vehicle.look_elsewhere();
  vehicle.fly(0.5);
  ASSERT_TRUE(vehicle.velocity.contradicted());
  vehicle.look_back(1000 + 100);
  vehicle.fly(0.05);
  EXPECT_FALSE(vehicle.velocity.contradicted());
}

TEST(PropagatedVelocity, AFewLandmarksProveNothing) {
  Vehicle vehicle;
  vehicle.fly(2);
  vehicle.look_elsewhere();
  vehicle.fly(1, kThing, 14);
  EXPECT_FALSE(vehicle.velocity.contradicted());
}

TEST(PropagatedVelocity, NothingIsCarriedOnWhereImagesContradictTheReadingsForLong) {
  Vehicle vehicle;
  vehicle.fly(2);
  vehicle.disputed = true;
  Vehicle briefly = vehicle;
  briefly.fly(0.1, kThing);  // it comes into view
  briefly.look_elsewhere();
  briefly.fly(0.05, kThing);
  EXPECT_TRUE(briefly.velocity.contradicted());
  vehicle.fly(1, kThing);
  vehicle.look_elsewhere();
  vehicle.fly(0.5, Vec3::Zero());
  EXPECT_FALSE(vehicle.velocity.contradicted());
}

TEST(PropagatedVelocity, AVelocityThatIsHardlyKnownSaysNothing) {
  Vehicle vehicle;
  vehicle.fly(2);
  vehicle.look_elsewhere();
  vehicle.sigma_mps = 2;
  vehicle.fly(0.2, kThing);
  EXPECT_FALSE(vehicle.velocity.contradicted());
  vehicle.sigma_mps = 0.01;
  vehicle.fly(0.05, kThing);
  EXPECT_TRUE(vehicle.velocity.contradicted());
}

TEST(PropagatedVelocity, EndsWhereTheReadingsCannotCarryItAndTellsWhatWasMovedBy) {
  Vehicle vehicle;
  vehicle.fly(2);
  vehicle.look_elsewhere();
  vehicle.fly(1, kThing);
  ASSERT_TRUE(vehicle.velocity.contradicted());
  Vehicle with_gap = vehicle;
  with_gap.longest_gap = Duration::from_seconds(0.2);
  with_gap.fly(0.05, kThing);
  EXPECT_FALSE(with_gap.velocity.contradicted());
  EXPECT_TRUE(with_gap.velocity.take_reset());
  vehicle.velocity.restart();  // told already
  vehicle.fly(31, kThing);
  EXPECT_FALSE(vehicle.velocity.contradicted());
  EXPECT_TRUE(vehicle.velocity.take_reset());
}

}  // namespace propagated_velocity_test
}  // namespace fbvins
