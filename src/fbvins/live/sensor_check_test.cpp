// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/sensor_check.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace sensor_check_test {

/// Five seconds of sensors at rest, with faults.
struct Look {
  double image_rate_hz = 20, imu_rate_hz = 200, accel = 9.81, gyro = 0.02, clock = 1, image_stamp_offset_s = 0;
  int width = 8, lose_image = -1, lose_reading = -1;
  int freeze = -1, alone = -1;  ///< the camera that repeats its image, and the one that delivers none

  std::vector<SensorFinding> findings() const {
    StereoRig rig;
    rig.cameras.assign(2, {Camera(PinholeRadtan{5, 5, 4, 3}, 8, 6), {}});
    rig.cameras.push_back({rig.left(), {}});
    Time now;
    SensorCheck check(rig, 1, [&] { return now; });
    int image = 0, reading = 0;
    for (int us = 0; us < 5'000'000; us += 100) {
      const Time t{1'000'000'000'000 + us * 1000LL};
      now = Time{77} + Duration::from_seconds(us * 1e-6 / clock);
      if (reading < us * 1e-6 * imu_rate_hz && reading++ != lose_reading)
        check.push(ImuSample{t, Vec3(gyro, 0, 0), Vec3(0, 0, accel)});
      if (image < us * 1e-6 * image_rate_hz && image++ != lose_image) {
        const auto pixels = [&](bool still, int across) {
          return std::make_shared<Image>(across, 6, static_cast<std::uint8_t>(still ? 1 : image));
        };
        StereoFrame frame{t + Duration::from_seconds(image_stamp_offset_s), {pixels(freeze == 0, width)}};
        if (alone != 1) frame.set_image(1, pixels(freeze == 1, 8));
        if (alone != 2) frame.set_image(2, pixels(freeze == 2, 8));
        check.push(std::move(frame));
      }
    }
    return check.findings();
  }
  /// Its findings that are faults, joined.
  std::string faults() const {
    std::string all;
    for (const SensorFinding& f : findings())
      if (!f.fine) all += f.text + "\n";
    return all;
  }
};

TEST(SensorCheck, GoodSensorsHaveNoFault) {
  EXPECT_EQ(Look{}.faults(), "");
  EXPECT_EQ((Look{.gyro = 4, .image_stamp_offset_s = 0.03}.faults()), "");
  EXPECT_EQ(Look{}.findings().size(), 8u);
}

TEST(SensorCheck, EachFaultIsNamedAlone) {
  const auto expect = [](const Look& look, const std::string& words) {
    const std::string faults = look.faults();
    EXPECT_NE(faults.find(words), std::string::npos) << words << " in: " << faults;
    EXPECT_EQ(std::count(faults.begin(), faults.end(), '\n'), 1) << faults;
  };
  expect({.imu_rate_hz = 100}, "the calibration says 200");
  expect({.accel = 1}, "it looks like g");
  expect({.accel = 30}, "units or axes are wrong");
  expect({.gyro = 57}, "it looks like degrees");
  expect({.clock = 1.5}, "takes 0.667 s");
  expect({.image_stamp_offset_s = 37}, "do not stamp by one clock");
  expect({.width = 9}, "camera 0: an image is 9 x 6, in the calibration it is 8 x 6");
  expect({.lose_image = 50}, "longest time between two images");
  expect({.lose_reading = 50}, "longest time between two readings");
  expect({.freeze = 0}, "camera 0: 99 images are earlier ones to the last bit");
  expect({.freeze = 2}, "camera 2: 99 images are earlier ones to the last bit");
  expect({.alone = 1}, "camera 1: 100 of 100 frames came without its image");
  expect({.alone = 2}, "camera 2: 100 of 100 frames came without its image");
  expect({.image_rate_hz = 4}, "lose the scene");
  expect({.image_rate_hz = 0}, "no image came");
  expect({.imu_rate_hz = 0}, "no IMU reading came");
}

}  // namespace sensor_check_test
}  // namespace fbvins
