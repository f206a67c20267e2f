// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/device_facts.hpp"

#include <gtest/gtest.h>

namespace fbvins {
namespace device_facts_test {

StereoRig rig_of_a_d435i() {
  StereoRig rig;
  rig.cameras.resize(2);
  rig.cameras[0].camera = Camera(PinholeRadtan{385, 385, 320, 240, 0, 0, 0, 0}, 640, 480);
  rig.cameras[1].camera = rig.left();
  rig.image_rate_hz = 30;
  return rig;
}

/// What is said of a text, a line each: a letter for ok, note or wrong, and the sentence.
std::string said_of(std::string_view text, const StereoRig& rig = rig_of_a_d435i()) {
  const auto facts = parse_device_facts(text);
  if (!facts) return facts.error().message;
  std::string all;
  for (const SensorFinding& finding : device_findings(*facts, rig))
    all += (finding.fine ? finding.advice ? "n " : "o " : "w ") + finding.text + "\n";
  return all;
}

void expect_said(std::string_view text, const std::string& words) {
  const std::string all = said_of(text);
  EXPECT_NE(all.find(words), std::string::npos) << words << "\nin:\n" << all;
}

constexpr const char* kAsItShouldBe =
    "model=D435I\nfirmware=5.16.0.1\nrecommended_firmware=5.16.0.1\nusb=3.2\ndriver=user space\nclock=global\nemitter=off\n"
    "mode=640x480@30\nother_modes=848x480@30 848x480@60\nset_mode=--source d435i:MODE\nexposure_ms=3.1\n"
    "longest_exposure_ms=8\nimu_calibrated=yes\nresets=0\nstalls=0\nof_a_later_version=7\n";

TEST(DeviceFacts, ADeviceAsItShouldBe) {
  StereoRig rig = rig_of_a_d435i();
  rig.time_offset_s = 0.002;
  EXPECT_EQ(said_of(kAsItShouldBe, rig),
            "o D435I, firmware 5.16.0.1\n"
            "o USB 3.2\n"
            "o driver: in user space (RSUSB)\n"
            "o stamps of images and readings are on one clock (global time)\n"
            "o images of 640x480@30; the device also has 848x480@30 848x480@60 (--source d435i:MODE)\n"
            "o the dot projector is off\n"
            "o exposure 3.1 ms, at most 8.0 ms, which is a blur of 3.1 px while the camera turns by 1 rad/s\n"
            "o the IMU has a calibration on the device\n"
            "o the time offset between images and IMU is 2.00 ms\n"
            "o no reset of the USB device and no stall of its streams\n");
}

TEST(DeviceFacts, EachThingThatCouldBeBetter) {
  expect_said("firmware=5.9.14\nrecommended_firmware=5.12.7.100", "n firmware 5.9.14, and its library recommends 5.12.7.100");
  expect_said("firmware=5.13.0\nrecommended_firmware=5.12.7", "o firmware 5.13.0\n");
  expect_said("usb=2.1", "w USB 2.1: too slow");
  expect_said("driver=kernel", "o driver: the kernel's");
  expect_said("clock=arrival", "w images are stamped when they arrive");
  expect_said("clock=device", "n stamps are on the device's own clock");
  expect_said("emitter=on", "w the dot projector is on, and its dots move with the camera; switch it off, or mask it");
  expect_said("emitter=alternating", "w the dot projector is on in every second image");
  expect_said("emitter=unknown", "n the dot projector cannot be switched or read");
  expect_said("exposure_ms=5",
              "w exposure 5.0 ms, at most 33.3 ms, which is a blur of 12.8 px while the camera turns by 1 rad/s; "
              "limit it to 10 ms");
  expect_said("imu_calibrated=no", "n the IMU has no calibration on the device");
  expect_said("", "n the time offset between images and IMU is taken as 0");
  expect_said("resets=2\nstalls=1", "w 2 resets of the USB device, 1 stalls of its streams; use a short cable");
}

TEST(DeviceFacts, LinesThatAreNone) {
  EXPECT_EQ(said_of("usb=3.2\nexposure\n"), "device, line 2: exposure");
  EXPECT_EQ(said_of("exposure_ms=-1"), "device, line 1: exposure_ms=-1");
  EXPECT_EQ(said_of("exposure_ms=nan"), "device, line 1: exposure_ms=nan");
  EXPECT_EQ(said_of("imu_calibrated=perhaps"), "device, line 1: imu_calibrated=perhaps");
  EXPECT_EQ(said_of("stalls=0.5"), "device, line 1: stalls=0.5");
  expect_said("model=a\033[31m\nfirmware=1", "o a?[31m, firmware 1");
}

}  // namespace device_facts_test
}  // namespace fbvins
