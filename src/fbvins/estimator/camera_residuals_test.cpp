// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/camera_residuals.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"

namespace fbvins {
namespace camera_residuals_test {

constexpr double kFocal_px = 450;

/// Landmarks as two pairs of cameras see them from the origin, looking along x, each second one by the second pair.
struct Scene {
  Calibration calibration;
  std::vector<TrackedFeature> features;
  std::vector<LandmarkObservation> observations;

  /// `shift`: of what each camera sees, in standard deviations.
  explicit Scene(const std::array<double, 4>& shift, int landmarks = 80) : features(static_cast<std::size_t>(landmarks)) {
    Mat3 R_BC;
    R_BC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    const Pose<B, C0> left(R_BC, Vec3(0, 0.05, 0)), right(R_BC, Vec3(0, -0.05, 0));
    calibration.cameras = {left, right, left, right};
    const CameraGeometry cameras(calibration);
    Rng rng(2);
    for (std::size_t i = 0; i < features.size(); ++i) {
      const Vec3 p_G(rng.uniform(2, 6), rng.uniform(-2, 2), rng.uniform(-1.5, 1.5));
      const int first = i % 2 == 0 ? 0 : 2;
      const auto seen = [&](int camera) {
        Observation o;
        const Vec3 p_C = cameras.R_CB[camera] * (p_G - cameras.t_BC[camera]);
        o.sqrt_information = kFocal_px * Mat2::Identity();
        o.normalised = p_C.head<2>() / p_C.z() + Vec2(shift[static_cast<std::size_t>(camera)] / kFocal_px, 0);
        return o;
      };
      features[i].lead = first;
      for (const int camera : {first, first + 1}) features[i].see(camera, seen(camera));
      observations.push_back({p_G, &features[i]});
    }
  }
  ResidualMedians residuals() const { return camera_residuals(observations, calibration, {}, Vec3::Zero()); }
  std::uint8_t alone(const ResidualMedians& at, double limit) const {
    std::vector<double> off;
    for (std::size_t c = 0; c < 4; ++c) off.push_back(at.norm[c].value_or(0));
    return camera_off_alone(observations, at, off, [limit](double) { return limit; });
  }
};

TEST(CameraResiduals, AreTheMediansOfEachCameraInStandardDeviations) {
  const ResidualMedians at = Scene({0, 2, -3, 0}).residuals();
  EXPECT_NEAR(*at.norm[1], 2, 1e-9);
  EXPECT_NEAR(*at.norm[2], 3, 1e-9);
  EXPECT_NEAR(at.shift[2].x(), 3, 1e-9) << "the prediction minus what is seen";
  EXPECT_NEAR(at.worst(), 3, 1e-9);
  EXPECT_EQ(at.focal, kFocal_px);
}

TEST(CameraResiduals, FewLandmarksSayNothing) {
  const ResidualMedians at = Scene({2, 2, 2, 2}, 28).residuals();
  EXPECT_FALSE(at.of(0) || at.of(3));
  EXPECT_EQ(at.worst(), 0);
}

TEST(CameraOffAlone, IsTheCameraThenItsPairThenNone) {
  const auto found = [](const std::array<double, 4>& shift) {
    const Scene scene(shift);
    return scene.alone(scene.residuals(), 1.5);
  };
  EXPECT_EQ(found({0, 0, 0.5, 5}), 0b1000);
  EXPECT_EQ(found({4, 5, 0, 0.5}), 0b0011);
  EXPECT_EQ(found({5, 5, 4, 0}), 0);
}

}  // namespace camera_residuals_test
}  // namespace fbvins
