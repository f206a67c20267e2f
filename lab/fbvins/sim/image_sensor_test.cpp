// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/image_sensor.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fbvins/sim/simulation.hpp"

namespace fbvins {
namespace image_sensor_test {

CameraModelOptions plain() {
  CameraModelOptions options;
  options.vignetting = options.glare = options.blur_px = 0;
  return options;
}

struct Statistics {
  double mean = 0, sigma = 0;
};

Statistics of(const Image& image) {
  double sum = 0, squares = 0;
  const int n = image.width() * image.height();
  for (int i = 0; i < n; ++i) sum += image.row(0)[i], squares += std::pow(image.row(0)[i], 2);
  return {sum / n, std::sqrt(squares / n - std::pow(sum / n, 2))};
}

TEST(ImageSensor, NoiseGrowsWithLightAndGainAsItsOptionsSay) {
  const Camera camera = euroc_rig().left();
  for (float level : {30.0f, 120.0f}) {
    CameraModelOptions options = plain();
    options.auto_exposure = false;
    options.shot_noise = 0.05;
    options.read_noise = 1.5;
    ImageSensor sensor(options, camera, 1.0, 3);
    std::vector<float> light(752 * 480, level / static_cast<float>(options.sensitivity * options.max_exposure_ms));
    const Statistics s = of(sensor.expose(light, 0));
    EXPECT_NEAR(s.mean, level, 0.1);
    EXPECT_NEAR(s.sigma, std::sqrt(1.5 * 1.5 + 0.05 * level + 1.0 / 12), 0.03);
  }
}

TEST(ImageSensor, ExposureSettlesAndFollowsWithLag) {
  CameraModelOptions options = plain();
  const Camera camera = euroc_rig().left();
  ImageSensor sensor(options, camera, 1.0, 3);
  const std::vector<float> bright(752 * 480, 1.0f), dim(752 * 480, 0.25f);
  sensor.settle(bright);
  std::vector<float> light = bright;
  EXPECT_NEAR(of(sensor.expose(light, 0)).mean, options.target_level, 2);
  light = dim;
  const double first = of(sensor.expose(light, 1)).mean;
  EXPECT_NEAR(first, options.target_level / 4, 2);  // exposure has not reacted yet
  double last = first;
  for (int k = 2; k < 60; ++k) {
    light = dim;
    last = of(sensor.expose(light, k)).mean;
    if (k == 9) {
      EXPECT_LT(last, 0.8 * options.target_level);
    }
  }
  EXPECT_NEAR(last, options.target_level, 4);
}

TEST(ImageSensor, DarknessEndsAtTheLargestExposureAndGain) {
  CameraModelOptions options = plain();
  ImageSensor sensor(options, euroc_rig().left(), 1.0, 3);
  sensor.settle(std::vector<float>(752 * 480, 1e-4f));
  EXPECT_NEAR(sensor.exposure_s(), options.max_exposure_ms * 1e-3, 1e-9);
  EXPECT_NEAR(sensor.gain(), options.max_gain, 1e-9);
}

TEST(ImageSensor, BlurAndGlareKeepTheLight) {
  CameraModelOptions options = plain();
  options.auto_exposure = false;
  options.read_noise = options.shot_noise = 0;
  options.blur_px = 1;
  options.glare = 0.2;
  ImageSensor sensor(options, euroc_rig().left(), 1.0, 3);
  std::vector<float> light(752 * 480, 0.0f);
  for (int y = 200; y < 280; ++y)
    for (int x = 300; x < 400; ++x) light[static_cast<std::size_t>(y) * 752 + x] = 0.5f;
  const double before = 0.5 * 80 * 100 * options.sensitivity * options.max_exposure_ms / (752.0 * 480);
  EXPECT_NEAR(of(sensor.expose(light, 0)).mean, before, 0.6);
}

TEST(ImageSensor, AnImageOfASingleBlockHasGlareToo) {
  CameraModelOptions options = plain();
  options.auto_exposure = false;
  options.read_noise = options.shot_noise = 0;
  options.glare = 0.2;
  for (const auto& [width, height] : {std::pair{8, 6}, {40, 6}, {8, 40}}) {
    ImageSensor sensor(options, Camera(PinholeRadtan{10, 10, 4, 3, 0, 0, 0, 0}, width, height), 1.0, 3);
    const float level = 100;
    std::vector<float> light(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                             level / static_cast<float>(options.sensitivity * options.max_exposure_ms));
    const Statistics s = of(sensor.expose(light, 0));
    EXPECT_NEAR(s.mean, level, 1.1) << width << " x " << height;
    EXPECT_LT(s.sigma, 0.1) << width << " x " << height;
  }
}

TEST(ImageSensor, TheSameFrameHasTheSameNoiseAnotherHasOther) {
  const Camera camera = euroc_rig().left();
  const auto image = [&](std::int64_t frame) {
    ImageSensor sensor(plain(), camera, 1.0, 3);
    std::vector<float> light(752 * 480, 0.3f);
    return sensor.expose(light, frame);
  };
  const Image a = image(5), b = image(5), c = image(6);
  EXPECT_TRUE(std::equal(a.row(0), a.row(480), b.row(0)));
  EXPECT_FALSE(std::equal(a.row(0), a.row(480), c.row(0)));
}

}  // namespace image_sensor_test
}  // namespace fbvins
