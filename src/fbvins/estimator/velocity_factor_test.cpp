// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/velocity_factor.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "fbvins/estimator/factor_test.hpp"
#include "tests/support/window_test_scene.hpp"

namespace fbvins {
namespace velocity_factor_test {

VelocityAtFrame measured() {
  VelocityAtFrame m;
  m.reading.v_mps = Vec3(0.5, -0.2, 0.1);
  m.reading.sigma_mps = Vec3(0.05, 0.1, kUnmeasured_mps);
  m.reading.p_B = Vec3(0.3, -0.1, -0.2), m.reading.q_BS = so3_exp(Vec3(0.2, -0.4, 1.1));
  m.gyro_radps = Vec3(0.3, -0.5, 0.8);
  return m;
}

TEST(VelocityFactor, IsSound) {
  const WindowProblem p = test::make_window(false).problem;
  VelocityAtFrame m = measured();
  for (const int frame : {0, 3, 5}) {
    const NavState<G>& s = p.frames[frame].state;
    const Vec3 true_S = m.reading.q_BS.conjugate() * (s.v_B() + (m.gyro_radps - s.bias.gyro_radps).cross(m.reading.p_B));
    for (const double off : {0.03, 1.0}) {  // within its noise, an outlier
      m.reading.v_mps = true_S + off * Vec3(1, 0.5, 0.3);
      test::expect_sound(VelocityFactor(FrameId{frame}, m), p);
    }
  }
}

TEST(VelocityFactor, SaysNothingAlongAnAxisThatItDoesNotMeasure) {
  const WindowProblem p = test::make_window(false).problem;
  VelocityAtFrame m = measured();
  const double cost = VelocityFactor(FrameId{2}, m).cost(p);
  m.reading.v_mps.z() += 50;
  EXPECT_EQ(VelocityFactor(FrameId{2}, m).cost(p), cost);
}

TEST(VelocityFactor, IsHandedOnWithTheChangeOfVelocity) {
  const WindowProblem p = test::make_window(false).problem;
  const VelocityFactor factor(FrameId{2}, measured());
  const auto left = factor.without({FrameId{2}, FrameId{3}, {}, p.frames[2].state.v_B(), p.frames[3].state.v_B()});
  ASSERT_NE(left, nullptr);
  EXPECT_FALSE(left->touches(FrameId{2}));
  const auto& next = dynamic_cast<const VelocityFactor&>(*left);
  const Vec3 change = next.measured().reading.v_mps - factor.measured().reading.v_mps;
  EXPECT_LT((next.measured().reading.q_BS * change - (p.frames[3].state.v_B() - p.frames[2].state.v_B())).norm(), 1e-12);
  EXPECT_GT(next.measured().reading.sigma_mps.x(), 0.05);
}

/// A vehicle on a circle, 1 m/s ahead, that turns at 0.5 rad/s, with a sensor of velocity 0.4 m ahead of the IMU.
class Drive {
 public:
  explicit Drive(double slip_mps = 0.3, bool images_show_scale = true) : maker_(slip_mps, images_show_scale) {}
  /// Whether the readings of each frame are used. `reads`: what the sensor makes of the truth.
  std::vector<bool> drive(double seconds, const std::function<Vec3(const Vec3&)>& reads) {
    std::vector<bool> out;
    for (const double end_s = t_s_ + seconds; t_s_ < end_s; t_s_ += 0.05) out.push_back(!frame(reads).empty());
    return out;
  }
  std::vector<std::shared_ptr<const Factor>> frame(const std::function<Vec3(const Vec3&)>& reads) {
    TrackedFrame tracked;
    Frame frame;
    frame.id = FrameId{++id_}, frame.t = tracked.t = Time{} + Duration::from_seconds(t_s_);
    const double heading = kRate * t_s_;
    frame.state.T_FB.q = so3_exp(Vec3(0, 0, heading));
    frame.state.v_FB = frame.state.T_FB.q * Vec3(1, 0, 0);
    for (int k = 0; k <= 10; ++k)
      tracked.imu.samples.push_back(
          {frame.t - Duration::from_seconds(0.005 * (10 - k)), Vec3(0, 0, kRate), Vec3(0, kRate, 9.81)});
    for (const double before_s : {0.04, 0.02, 0.0})
      tracked.aiding.emplace_back(VelocitySample{
          .t = frame.t - Duration::from_seconds(before_s), .v_mps = reads(Vec3(1, 0.4 * kRate, 0)), .p_B = Vec3(0.4, 0, 0)});
    const std::vector<TrackedFeature> none;
    return maker_.make({tracked, none, frame, window_, calibration_});
  }
  HealthReason doubt() const { return maker_.doubt(); }

 private:
  static constexpr double kRate = 0.5;
  SlidingWindow window_{EstimatorOptions{}, WindowWeights{}};
  VelocityMaker maker_;
  Calibration calibration_;
  double t_s_ = 0;
  int id_ = 0;
};

Vec3 right(const Vec3& v) { return v; }

TEST(VelocityMaker, ReadingsOfAFrameAreOneFactorAndAgreeWithTheMotion) {
  Drive drive;
  for (int k = 0; k < 20; ++k) {
    const auto factors = drive.frame(right);
    ASSERT_EQ(factors.size(), 1u);
    const Vec3 v = dynamic_cast<const VelocityFactor&>(*factors.front()).measured().reading.v_mps;
    EXPECT_LT((v - Vec3(1, 0.2, 0)).norm(), 2e-3) << v.transpose();
  }
  EXPECT_EQ(drive.doubt(), HealthReason::none);
}

TEST(VelocityMaker, WheelsThatSlipAreLeftOutAndNamedAndForgivenLater) {
  Drive drive;
  drive.drive(1, right);
  for (const bool used : drive.drive(2, [](const Vec3& v) -> Vec3 { return 1.6 * v; })) EXPECT_FALSE(used);
  EXPECT_EQ(drive.doubt(), HealthReason::velocity_disagrees);
  for (const bool used : drive.drive(3, right)) EXPECT_TRUE(used);
  EXPECT_EQ(drive.doubt(), HealthReason::none);
}

TEST(VelocityMaker, ASensorThatHangsIsLeftOut) {
  Drive drive;
  for (const bool used : drive.drive(2, [](const Vec3&) -> Vec3 { return Vec3::Zero(); })) EXPECT_FALSE(used);
  EXPECT_EQ(drive.doubt(), HealthReason::velocity_disagrees);
}

TEST(VelocityMaker, OneCamerasVelocityMayBeOffByAShare) {
  const auto of_scale = [](const Vec3& v) -> Vec3 { return 1.24 * v; };
  EXPECT_FALSE(Drive(0.1).drive(0.1, of_scale).front());
  EXPECT_TRUE(Drive(0.1, false).drive(0.1, of_scale).front()) << "less than a quarter";
}

}  // namespace velocity_factor_test
}  // namespace fbvins
