// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/prediction.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace prediction_test {

const Pose<B, C0> kT_BC0(so3_exp(Vec3(0.01, -0.02, 0.3)), Vec3(0.02, -0.01, 0.03));

/// A body that turns at a constant rate and accelerates along x of G, with its IMU readings.
struct Flight {
  Vec3 w_B = Vec3(0.1, -0.3, 0.2), a_G = Vec3(0.4, 0, 0);

  Pose<G, B> T_GB(double s) const { return {so3_exp(s * w_B), Vec3(0.5 * s, 0, 0) + 0.5 * s * s * a_G}; }
  ImuSegment imu(double from_s, double to_s) const {
    ImuSegment segment;
    for (double s = from_s; s < to_s + 1e-6; s += 0.005)
      segment.samples.push_back({Time{} + Duration::from_seconds(s), w_B, T_GB(s).q.conjugate() * (a_G + Vec3(0, 0, 9.81))});
    return segment;
  }
  StatePrior prior(double s) const {
    StatePrior prior;
    prior.t = Time{} + Duration::from_seconds(s);
    prior.T_GB = T_GB(s);
    prior.v_GB = Vec3(0.5, 0, 0) + s * a_G;
    prior.valid = true;
    return prior;
  }
};

constexpr Time at_ms(std::int64_t ms) { return Time{ms * 1'000'000}; }

TEST(MotionPredictor, CarriesThePriorToBothImages) {
  const Flight flight;
  MotionPredictor predictor(kT_BC0);
  predictor.add(flight.imu(0.0, 0.3), StatePrior{});
  const CameraMotion gyro_only = predictor.between(at_ms(100), at_ms(150));
  EXPECT_TRUE(gyro_only.has_rotation);
  EXPECT_FALSE(gyro_only.has_translation);

  predictor.add(ImuSegment{}, flight.prior(0.05));
  const CameraMotion motion = predictor.between(at_ms(100), at_ms(150));
  const Pose<C0, C0> truth = (flight.T_GB(0.15) * kT_BC0).inverse() * (flight.T_GB(0.10) * kT_BC0);
  ASSERT_TRUE(motion.has_rotation && motion.has_translation);
  EXPECT_LT(so3_log(Quat(Mat3(motion.R_ba.transpose() * truth.R()))).norm(), 1e-4);
  EXPECT_LT((motion.p_ba - truth.p).norm(), 1e-3);
  EXPECT_LT((gyro_only.R_ba - motion.R_ba).norm(), 1e-6);
  EXPECT_FALSE(predictor.between(at_ms(100), at_ms(900)).has_rotation);
  EXPECT_FALSE(MotionPredictor(kT_BC0).between(Time{0}, Time{1}).has_rotation);
}

TEST(MotionPredictor, CarriesTheLastPriorOnForHalfASecondWhenOneIsSkipped) {
  const Flight flight;
  MotionPredictor predictor(kT_BC0);
  EXPECT_FALSE(predictor.camera_at(at_ms(0)));
  predictor.add(flight.imu(0.0, 1.0), flight.prior(0.1));
  predictor.add(ImuSegment{}, StatePrior{});  // none for this image
  const auto camera = predictor.camera_at(at_ms(550));
  ASSERT_TRUE(camera);
  EXPECT_LT((camera->p - (flight.T_GB(0.55) * kT_BC0).p).norm(), 1e-3);
  EXPECT_TRUE(predictor.between(at_ms(550), at_ms(600)).has_translation);
  EXPECT_FALSE(predictor.camera_at(at_ms(650))) << "too old";
  EXPECT_FALSE(predictor.camera_at(at_ms(50))) << "of the future";
  predictor.forget_state();
  EXPECT_FALSE(predictor.camera_at(at_ms(550)));
}

TEST(MotionPredictor, PlacesTheSecondCameraWhereItWasAtItsExposure) {
  const Flight flight;
  const Pose<C1, C0> T_C1C0(so3_exp(Vec3(0.02, 0.01, -0.01)), Vec3(-0.11, 0.002, 0.001));
  MotionPredictor predictor(kT_BC0);
  predictor.add(flight.imu(0.0, 0.3), StatePrior{});
  EXPECT_EQ(predictor.at_exposures(T_C1C0, at_ms(200), at_ms(200)).p, T_C1C0.p);
  predictor.add(ImuSegment{}, flight.prior(0.05));
  for (const double right_s : {0.155, 0.18, 0.21}) {
    const Pose<G, C1> second = flight.T_GB(right_s) * kT_BC0 * T_C1C0.inverse();
    const Pose<C1, C0> truth = second.inverse() * (flight.T_GB(0.2) * kT_BC0);
    const Pose<C1, C0> placed = predictor.at_exposures(T_C1C0, at_ms(200), Time{} + Duration::from_seconds(right_s));
    EXPECT_LT((placed.p - truth.p).norm(), 1e-3) << right_s;
    EXPECT_LT(so3_log(placed.q.conjugate() * truth.q).norm(), 1e-4) << right_s;
  }
  predictor.forget_state();
  const Pose<C1, C0> turned = predictor.at_exposures(T_C1C0, at_ms(200), at_ms(180));
  const Quat truth = (flight.T_GB(0.18) * kT_BC0 * T_C1C0.inverse()).q.conjugate() * (flight.T_GB(0.2) * kT_BC0).q;
  EXPECT_LT(so3_log(turned.q.conjugate() * truth).norm(), 1e-4) << "without a prior the turn is known";
}

TEST(CarryPoint, TurnsAndMovesByDepth) {
  const Camera camera(PinholeRadtan{.fx = 400, .fy = 400, .cx = 320, .cy = 240}, 640, 480);
  CameraMotion motion;
  motion.has_rotation = motion.has_translation = true;
  motion.p_ba = Vec3(0.2, 0, -1);  // a metre ahead, and to the left
  const auto carried = carry_point(camera, motion, Vec2::Zero(), 0.25);
  ASSERT_TRUE(carried);
  EXPECT_DOUBLE_EQ(carried->p.z(), 0.75) << "four metres away, then three";
  EXPECT_NEAR((carried->b_px - carried->a_px).x(), 400 * 0.2 / 3, 1e-9);
  motion.has_translation = false;
  const auto still = carry_point(camera, motion, Vec2(0.1, 0.2), 0.25);
  ASSERT_TRUE(still);
  EXPECT_EQ(still->a_px, still->b_px);
  motion.R_ba = so3_exp(Vec3(0, 3.0, 0)).toRotationMatrix();
  EXPECT_FALSE(carry_point(camera, motion, Vec2::Zero(), 0.25)) << "behind the camera";
}

}  // namespace prediction_test
}  // namespace fbvins
