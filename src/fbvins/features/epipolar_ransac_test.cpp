// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/epipolar_ransac.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace epipolar_ransac_test {

constexpr double kPixel = 1.0 / 460.0;

struct Scene {
  std::vector<Vec2> a, b;
  std::vector<bool> good;
};

/// Points 2-8 m away seen from two poses, Gaussian noise, and a share of matches at random places.
Scene make_scene(const Mat3& R_ba, const Vec3& t_ba, int n, double outlier_share, double noise, Rng& rng) {
  Scene scene;
  while (static_cast<int>(scene.a.size()) < n) {
    const Vec3 ray{rng.uniform(-0.7, 0.7), rng.uniform(-0.45, 0.45), 1.0};
    const Vec3 p_b = R_ba * (rng.uniform(2.0, 8.0) * ray) + t_ba;
    if (p_b.z() < 0.5) continue;
    const bool good = static_cast<double>(scene.a.size()) >= outlier_share * n;
    const Vec2 noise_b{noise * rng.normal(), noise * rng.normal()};
    scene.a.push_back(ray.hnormalized());
    scene.b.push_back(good ? Vec2(p_b.hnormalized() + noise_b) : Vec2{rng.uniform(-0.7, 0.7), rng.uniform(-0.45, 0.45)});
    scene.good.push_back(good);
  }
  return scene;
}

struct Rates {
  double kept_good = 0, kept_bad = 0;
};

Rates rates(const Scene& scene, const EpipolarResult& result) {
  double good = 0, bad = 0;
  Rates r;
  for (std::size_t i = 0; i < scene.good.size(); ++i) {
    (scene.good[i] ? good : bad) += 1;
    (scene.good[i] ? r.kept_good : r.kept_bad) += result.inlier[i];
  }
  return {good > 0 ? r.kept_good / good : 1.0, bad > 0 ? r.kept_bad / bad : 0.0};
}

double angle_deg(const Mat3& A, const Mat3& B_) { return so3_log(Quat(A.transpose() * B_)).norm() * 180 / std::numbers::pi; }

const Mat3 kTurn = so3_exp(Vec3(0.03, -0.05, 0.08)).toRotationMatrix();
const Vec3 kMove(0.25, -0.05, 0.1);

class WithOutliers : public testing::TestWithParam<double> {};

TEST_P(WithOutliers, KnownRotation) {
  Rng rng(11);
  const Scene s = make_scene(kTurn, kMove, 150, GetParam(), 0.3 * kPixel, rng);
  const EpipolarResult result = ransac_epipolar(s.a, s.b, kTurn, {}, rng);
  EXPECT_GT(rates(s, result).kept_good, 0.97);
  EXPECT_LT(rates(s, result).kept_bad, 0.10);  // a random match is near a random line now and then
  EXPECT_GT(std::abs(result.t_ba.dot(kMove.normalized())), 0.995);
}

/// In the mean of scenes: of single ones one in twenty is not repaired at 20 % outliers, one in four at 60 %.
TEST_P(WithOutliers, RotationWrongByTwoPixelsIsRepaired) {
  constexpr int kScenes = 50;
  double kept_good = 0, kept_bad = 0, angle = 0;
  const Mat3 biased = kTurn * so3_exp(Vec3(0.002, -0.001, 0.004)).toRotationMatrix();
  for (int seed = 1; seed <= kScenes; ++seed) {
    Rng rng(static_cast<std::uint64_t>(seed));
    const Scene s = make_scene(kTurn, kMove, 150, GetParam(), 0.3 * kPixel, rng);
    const EpipolarResult result = ransac_epipolar(s.a, s.b, biased, {}, rng);
    kept_good += rates(s, result).kept_good / kScenes;
    kept_bad += rates(s, result).kept_bad / kScenes;
    angle += angle_deg(result.R_ba, kTurn) / kScenes;
  }
  EXPECT_GT(kept_good, 0.97);
  EXPECT_LT(kept_bad, 0.10);
  EXPECT_LT(angle, 0.2);
}

TEST_P(WithOutliers, UnknownRotation) {
  Rng rng(13);
  const Scene s = make_scene(kTurn, kMove, 150, GetParam(), 0.3 * kPixel, rng);
  EpipolarOptions options;
  options.max_iterations = 1000;  // five good of five at 60 % outliers: one sample in 98
  const EpipolarResult result = ransac_epipolar(s.a, s.b, std::nullopt, options, rng);
  EXPECT_GT(rates(s, result).kept_good, 0.95);
  EXPECT_LT(rates(s, result).kept_bad, 0.10);
  EXPECT_LT(angle_deg(result.R_ba, kTurn), 0.2);
}

INSTANTIATE_TEST_SUITE_P(EpipolarRansac, WithOutliers, testing::Values(0.0, 0.2, 0.4, 0.6));

TEST(EpipolarRansac, RotationOnTheSpotAndStandstillKeepAll) {
  for (const bool known : {true, false})
    for (const Mat3& R : {Mat3(Mat3::Identity()), kTurn}) {
      Rng rng(21);
      const Scene s = make_scene(R, Vec3::Zero(), 120, 0.0, 0.2 * kPixel, rng);
      const auto result = ransac_epipolar(s.a, s.b, known ? std::optional<Mat3>(R) : std::nullopt, {}, rng);
      EXPECT_GT(result.inliers, 117) << known;
    }
}

TEST(EpipolarRansac, ExactStandstillIsFinite) {
  Rng rng(22);
  const Scene s = make_scene(Mat3::Identity(), Vec3::Zero(), 60, 0.0, 0.0, rng);
  for (const bool known : {true, false}) {
    const auto result = ransac_epipolar(s.a, s.a, known ? std::optional<Mat3>(Mat3::Identity()) : std::nullopt, {}, rng);
    EXPECT_EQ(result.inliers, 60);
    EXPECT_TRUE(result.E.allFinite());
  }
}

TEST(EpipolarRansac, StandstillWithOutliers) {
  for (const bool known : {true, false}) {
    Rng rng(23);
    const Scene s = make_scene(Mat3::Identity(), Vec3::Zero(), 150, 0.3, 0.2 * kPixel, rng);
    const auto result = ransac_epipolar(s.a, s.b, known ? std::optional<Mat3>(Mat3::Identity()) : std::nullopt, {}, rng);
    EXPECT_GT(rates(s, result).kept_good, 0.97);
    EXPECT_LT(rates(s, result).kept_bad, 0.15);
  }
}

TEST(EpipolarRansac, FewMatchesAreAllKept) {
  Rng rng(24);
  for (const int n : {0, 1, 2}) {
    const Scene s = make_scene(kTurn, kMove, n, 0.0, 0.0, rng);
    EXPECT_EQ(ransac_epipolar(s.a, s.b, kTurn, {}, rng).inliers, n);
    EXPECT_EQ(ransac_epipolar(s.a, s.b, std::nullopt, {}, rng).inliers, n);
  }
}

TEST(EpipolarRansac, SameSeedSameBits) {
  Rng make(25);
  const Scene s = make_scene(kTurn, kMove, 150, 0.5, 0.3 * kPixel, make);
  Rng r1(5), r2(5);
  const auto x = ransac_epipolar(s.a, s.b, std::nullopt, {}, r1), y = ransac_epipolar(s.a, s.b, std::nullopt, {}, r2);
  EXPECT_EQ(x.inlier, y.inlier);
  EXPECT_EQ(x.iterations, y.iterations);
  EXPECT_TRUE(x.E == y.E);
}

}  // namespace epipolar_ransac_test
}  // namespace fbvins
