// SPDX-License-Identifier: Apache-2.0
// The doctor's parts, one by one.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "fbvins/camera/scaled_lens.hpp"
#include "fbvins/doctor/accel_fit.hpp"
#include "fbvins/doctor/axes.hpp"
#include "fbvins/doctor/block_fit.hpp"
#include "fbvins/doctor/depths.hpp"
#include "fbvins/doctor/diagnose.hpp"
#include "fbvins/doctor/doctor.hpp"
#include "fbvins/doctor/free_stereo.hpp"
#include "fbvins/doctor/image_health.hpp"
#include "fbvins/doctor/imu_health.hpp"
#include "fbvins/doctor/imu_series.hpp"
#include "fbvins/doctor/lens_change.hpp"
#include "fbvins/doctor/motion_problem.hpp"
#include "fbvins/doctor/stereo_step.hpp"
#include "fbvins/imu/propagation.hpp"
#include "tests/support/noise_texture.hpp"
#include "tests/support/synthetic_evidence.hpp"

namespace fbvins {
namespace parts_test {

std::vector<ImuSample> readings(double seconds) {
  const test::Motion motion(0.3, 0.3);
  std::vector<ImuSample> samples;
  for (Time t{1'000'000'000}; t.seconds() < 1 + seconds; t = t + Duration{5'000'000}) samples.push_back(motion.sample(t));
  return samples;
}

TEST(Axes, AreFortyEight) {
  std::set<std::string> texts;
  for (const Mat3& P : signed_permutations()) {
    texts.insert(axes_text(P));
    EXPECT_NEAR(std::abs(P.determinant()), 1, 1e-12);
    EXPECT_EQ(nearest_axes(P * so3_exp(Vec3(0.1, -0.2, 0.15)).toRotationMatrix()), P);
  }
  EXPECT_EQ(texts.size(), 48u);
  EXPECT_EQ(axes_text(Mat3::Identity()), "x, y, z");
}

TEST(BlockFit, SolvesForWhatIsFreeAndKnowsHowWell) {
  // y = 2 u + 3 w + noise, in stretches of 40; the same 60 times, to see how far solutions scatter.
  Rng rng(1);
  double square = 0, said = 0;
  constexpr int kTimes = 60;
  for (int time = 0; time < kTimes; ++time) {
    BlockFit fit(Eigen::Vector2d(100, 100), 0.5);
    for (int stretch = 0; stretch < BlockFit::kStretches; ++stretch)
      for (int i = 0; i < 40; ++i) {
        Eigen::VectorXd J(2);
        J << rng.normal(), rng.normal();
        const double r = -(2 * J(0) + 3 * J(1) + 0.5 * rng.normal());
        fit.add(stretch, J * J.transpose(), J * r);
      }
    const std::vector<int> both{0, 1}, one{1};
    const auto solution = fit.solve(both);
    ASSERT_TRUE(solution);
    square += std::pow(solution->x(0) - 2, 2) / kTimes;
    said += solution->covariance(0, 0) / kTimes;
    const auto alone = fit.solve(one);
    ASSERT_TRUE(alone);
    EXPECT_EQ(alone->x(0), 0);
    EXPECT_LT(alone->decrease, solution->decrease);
  }
  EXPECT_NEAR(said / square, 1, 0.5);
}

TEST(ImuSeries, TurnsAsTheIntegralOfItsReadings) {
  const ImuSeries imu(readings(4));
  const Time a{2'003'000'000}, b{2'091'000'000};
  EXPECT_TRUE(imu.covers(a, b));
  EXPECT_FALSE(imu.covers(a, Time{7'000'000'000}));
  const Vec3 exact = so3_log(integrate_gyro(imu.segment(a, b), Vec3::Zero()));
  EXPECT_LT((imu.turned(a, b) - exact).norm(), 2e-3 * exact.norm());
}

TEST(ImuSeries, AGapIsNotCovered) {
  auto samples = readings(4);
  samples.erase(samples.begin() + 300, samples.begin() + 330);
  EXPECT_FALSE(ImuSeries(samples).covers(samples[290].t, samples[310].t));
}

TEST(ImuHealth, SeesReadingsAtTheEndOfTheirRange) {
  auto samples = readings(4);
  EXPECT_FALSE(check_saturation(samples));
  for (ImuSample& sample : samples) sample.accel_mps2 = (3 * sample.accel_mps2).cwiseMin(19.6).cwiseMax(-19.6);
  EXPECT_TRUE(check_saturation(samples));
}

TEST(ImuHealth, MeasuresVibration) {
  auto samples = readings(10);
  EXPECT_FALSE(check_vibration(samples));
  for (ImuSample& sample : samples)
    sample.accel_mps2.x() += 8 * std::numbers::sqrt2 * std::sin(2 * std::numbers::pi * 62 * sample.t.seconds());
  const Vibration seen = measure_vibration(samples);
  EXPECT_NEAR(seen.rms_mps2, 8, 0.4);
  EXPECT_NEAR(seen.peak_hz, 62, 0.5);
  EXPECT_GT(seen.peak_share, 0.9);
  EXPECT_TRUE(check_vibration(samples));
}

TEST(ImageHealth, SeesRepeatedImages) {
  EXPECT_TRUE(check_repeated({.frames = 300}).empty());
  const auto frozen = check_repeated({.frames = 300, .right = 30});
  ASSERT_EQ(frozen.size(), 1u);
  EXPECT_EQ(frozen.front().kind, FindingKind::frozen_images);
  const auto one = check_repeated({.frames = 300, .same_pair = 300});
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one.front().kind, FindingKind::same_image_twice);
}

TEST(ImageHealth, SeesWhatHangsInView) {
  Evidence evidence = test::SyntheticEvidence({}).make();
  EXPECT_FALSE(check_fixed(measure_fixed(evidence, ImuSeries(evidence.imu))));
  for (SeenFrame& frame : evidence.frames) {
    const std::size_t seen = frame.features.size();
    for (std::size_t i = 0; i < seen / 3; ++i)
      frame.features.push_back({static_cast<std::int64_t>(1000 + i), Vec2(10.0 * static_cast<double>(i), 400), 0, false});
  }
  const auto finding = check_fixed(measure_fixed(evidence, ImuSeries(evidence.imu)));
  ASSERT_TRUE(finding);
  EXPECT_EQ(finding->kind, FindingKind::fixed_in_view);
  for (SeenFrame& frame : evidence.frames)
    for (std::size_t i = 0; i < frame.features.size(); i += 2) frame.features[i].bright_dot = true;
  EXPECT_EQ(check_fixed(measure_fixed(evidence, ImuSeries(evidence.imu)))->kind, FindingKind::projector_dots);
}

StereoFrame numbered(int number) {
  StereoFrame frame;
  frame.t = Time{number};
  auto left = std::make_shared<Image>(1, 1), right = std::make_shared<Image>(1, 1);
  left->at(0, 0) = right->at(0, 0) = static_cast<std::uint8_t>(number);
  frame.set_image(0, left), frame.set_image(1, right);
  return frame;
}

TEST(StereoStep, GivesEachLeftImageTheRightOneThatBelongsToIt) {
  for (const int lag : {-2, 0, 1}) {
    StereoRealigner realigner(lag);
    int frames = 0;
    for (int k = 10; k < 20; ++k)
      if (const auto frame = realigner.push(numbered(k))) {
        ++frames;
        EXPECT_EQ(frame->t.ns, frame->left()->at(0, 0));
        EXPECT_EQ(frame->right()->at(0, 0), frame->left()->at(0, 0) + lag);
      }
    EXPECT_EQ(frames, 10 - std::abs(lag));
  }
}

TEST(FreeStereo, MatchesACameraThatIsUpsideDown) {
  const Camera camera(PinholeRadtan{.fx = 300, .fy = 300, .cx = 240, .cy = 160}, 480, 320);
  StereoRig rig;
  rig.cameras = {{camera, {}}, {camera, {}}};
  const NoiseTexture texture{7, 24};
  const auto image = [&](double shift_px, bool turned, std::uint64_t seed) {
    const auto place = [&](const Vec2& px) { return Vec2((turned ? Vec2(Vec2(479, 319) - px) : px) + Vec2(shift_px, 0)); };
    return render_texture(480, 320, texture, place, 120, 35, 1.0, seed);
  };
  const Image left = image(0, false, 1), right = image(18, true, 2);
  Pyramid of_left, of_right;
  of_left.build(left.view(), 3), of_right.build(right.view(), 3);
  FreeStereo stereo;
  for (int time = 0; time < 2; ++time) {
    const auto points = stereo.match(rig, left, right, of_left, of_right);
    ASSERT_GT(points.size(), 30u);
    for (const StereoPoint& point : points)
      EXPECT_LT((Vec2(479, 319) - point.right - (point.left - Vec2(18, 0))).norm(), 1) << point.left.transpose();
  }
}

TEST(Diagnosis, ASqueezedLensSeesTheSame) {
  const Camera calibrated(PinholeRadtan{.fx = 458, .fy = 457, .cx = 367, .cy = 248, .k1 = -0.28}, 752, 480);
  StereoRig rig;
  rig.cameras = {{*middle_of(calibrated, 640, 480), {}}};
  const ScaledLens lens{.camera = 0, .calibrated = {752, 480}, .images = {640, 480}};
  const std::optional<StereoRig> squeezed = squeezed_rig(rig, std::span(&lens, 1));
  ASSERT_TRUE(squeezed);
  const Vec3 point(0.5, -0.3, 1);
  const Vec2 was = *calibrated.project(point), is = *squeezed->left().project(point);
  EXPECT_NEAR(is.x() + 0.5, (was.x() + 0.5) * 640 / 752, 1e-9);
  EXPECT_NEAR(is.y(), was.y(), 1e-9);
}

TEST(Diagnosis, HasNoVerdictWhereWhatAFlightRestsOnWasNotJudged) {
  Diagnosis diagnosis;
  diagnosis.no_verdict = "too few points are seen in both images";
  EXPECT_EQ(to_text(diagnosis), "no verdict: too few points are seen in both images");
  diagnosis.findings.resize(1);
  EXPECT_NE(to_text(diagnosis).find("1 finding in 0 measurements"), std::string::npos);
}

/// Of all features with depths by both.
template <class Take>
void compare_depths(const Evidence& a, const Evidence& b, Take&& take) {
  int features = 0;
  for (std::size_t f = 0; f < a.frames.size(); ++f)
    for (std::size_t i = 0; i < a.frames[f].features.size(); ++i) {
      const SeenFeature &one = a.frames[f].features[i], &other = b.frames[f].features[i];
      if (one.inverse_depth > 0 && other.inverse_depth > 0) take(one.px, one.inverse_depth, other.inverse_depth), ++features;
    }
  EXPECT_GT(features, 1000);
}

TEST(Depths, AreThoseOfTheNewCalibration) {
  const Evidence good = test::SyntheticEvidence({}).make();
  StereoRig longer = good.rig, turned = good.rig;
  longer.cameras[1].T_BC.p = longer.T_BC0().p + 1.2 * (longer.T_BC1().p - longer.T_BC0().p);
  compare_depths(good, with_depths_by(longer, good),
                 [](const Vec2&, double before, double after) { EXPECT_NEAR(after, before / 1.2, 1e-6); });
  turned.cameras[1].T_BC = {Mat3(turned.T_BC1().R() * so3_exp(Vec3(0, 0.01, 0)).toRotationMatrix()), turned.T_BC1().p};
  const Vec2 centre(good.rig.left().width() / 2.0, good.rig.left().height() / 2.0);
  compare_depths(good, with_depths_by(turned, good), [&](const Vec2& px, double before, double after) {
    // A rotation by 0.01 rad changes the disparity by 0.01 times the focal length, and the baseline is 0.11 m.
    if ((px - centre).norm() < 80) {
      EXPECT_NEAR(std::abs(after - before), 0.01 / 0.11, 0.01);
    }
  });
}

TEST(MotionProblem, ALensStaysInTheRangeOfItsModel) {
  Evidence evidence = test::SyntheticEvidence({}).make();
  const ImuSeries imu(evidence.imu);
  for (const double alpha : {0.5, 0.95}) {
    // A focal length that is very wrong and not free: the shape that would make up for it is none of the model.
    evidence.rig.cameras[0].camera = Camera(ExtendedUnified{1200, 1200, 367, 248, alpha, 1}, 752, 480);
    evidence.working_rig = evidence.rig;
    MotionProblem problem(pair_frames(evidence), imu, {evidence.rig});
    ASSERT_GT(problem.pairs(), 20u);
    problem.free = {doctor::motion::kRadial, doctor::motion::kRadial + 1};
    ASSERT_TRUE(problem.converge());
    EXPECT_TRUE(in_range(problem.hypothesis().camera)) << problem.x.transpose();
    EXPECT_GT(alpha + problem.x[doctor::motion::kRadial], 0.98) << "does not reach the end of the range";
  }
}

TEST(AccelFit, GravityConfirmsABias) {
  AccelFit spoilt;  // (1, -1, 0.5) m/s^2 put into 12 s of `simulate fast`
  spoilt.bias = {0.9, -0.87, 0.38}, spoilt.bias_sigma = {0.47, 0.12, 0.15};
  EXPECT_GT(bias_significance(spoilt, 1.2, 0.3), 5) << "the bias explains what gravity is off by";
  EXPECT_GT(bias_significance(spoilt, 0.9, 0.6), 5) << "within what the bias' sigmas leave open";
  EXPECT_LT(bias_significance(spoilt, 0.9, 1.1), 5) << "gravity is farther off without the bias";
  EXPECT_LT(bias_significance(spoilt, 0.1, 0.8), 5) << "gravity is as it should be";
  AccelFit good;  // a flight without any bias that could be seen
  good.bias = {-1.18, -0.46, 1.1}, good.bias_sigma = {1.92, 0.06, 0.18};
  EXPECT_LT(bias_significance(good, 0.3, 0.1), 5);
  AccelFit plain;
  plain.bias = {0, 1.5, 0}, plain.bias_sigma = {0.1, 0.2, 0.1};
  EXPECT_DOUBLE_EQ(bias_significance(plain, 0.1, 0.1), 7.5) << "large by the least certain axis, too";
}

}  // namespace parts_test

TEST(LensChange, AUnifiedLensIsHeldToTheRangeOfItsXi) {
  const auto lens = [](double xi) { return Camera(UnifiedRadtan{400, 400, 320, 240, xi, 0, 0, 0, 0}, 640, 480); };
  EXPECT_TRUE(in_range(lens(1)));
  EXPECT_FALSE(in_range(lens(-0.5)));
}

}  // namespace fbvins
