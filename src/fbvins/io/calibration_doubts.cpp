// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/calibration_doubts.hpp"

#include <fmt/format.h>

#include <cmath>

namespace fbvins {
namespace {

/// Drivers are late by up to some 0.1 s, and a shutter rolls over its image in less than 0.1 s.
constexpr double kLargestOffset_s = 0.3, kLongestReadout_s = 0.2;

void doubt_times(const StereoRig& rig, int number, std::vector<std::string>& out) {
  const CameraTimes times = rig.times(number);
  if (std::abs(times.time_offset_s) > kLargestOffset_s)
    out.push_back(fmt::format("calibration: camera {}'s time offset is {:g} s: is it in milliseconds, where seconds are meant?",
                              number, times.time_offset_s));
  const double readout_s = times.line_delay_s * rig.camera(number).height();
  if (std::abs(readout_s) > kLongestReadout_s)
    out.push_back(
        fmt::format("calibration: camera {}'s line delay of {:g} s makes {:g} s of an image: is it in microseconds, or of "
                    "the whole image, where seconds a row are meant?",
                    number, times.line_delay_s, readout_s));
  else if (times.line_delay_s < 0)
    out.push_back(
        fmt::format("calibration: camera {}'s line delay is negative ({:g} s): rows are taken from the bottom up only where "
                    "the driver turns the images upside down",
                    number, times.line_delay_s));
}

struct Figure {
  const char* name;
  double value, least, most;
};

}  // namespace

std::vector<std::string> calibration_doubts(const StereoRig& rig) {
  std::vector<std::string> out;
  for (int i = 0; i < rig.camera_count(); ++i)
    if (i == 0 || rig.camera(i).own_times() != CameraTimes{}) doubt_times(rig, i, out);
  const ImuNoise& n = rig.imu_noise;
  // From the best sensor that flies to the worst, with the factor of ten that many add.
  const Figure figures[] = {{"gyroscope's noise density", n.gyro_noise_density_radps_rthz, 1e-6, 0.05},
                            {"accelerometer's noise density", n.accel_noise_density_mps2_rthz, 1e-5, 0.5},
                            {"gyroscope's random walk", n.gyro_random_walk_radps2_rthz, 3e-8, 0.01},
                            {"accelerometer's random walk", n.accel_random_walk_mps3_rthz, 1e-7, 0.5}};
  bool plausible = true;
  for (const Figure& f : figures) {
    if (f.value >= f.least && f.value <= f.most) continue;
    plausible = false;
    out.push_back(
        fmt::format("calibration: the {} of {:g} is {} than that of any IMU in use ({:g} to {:g}): is it in another unit?",
                    f.name, f.value, f.value < f.least ? "smaller" : "larger", f.least, f.most));
  }
  if (plausible && n.gyro_noise_density_radps_rthz > n.accel_noise_density_mps2_rthz)
    out.push_back(
        fmt::format("calibration: the gyroscope's noise density ({:g} rad/s/sqrt(Hz)) is larger than the accelerometer's "
                    "({:g} m/s^2/sqrt(Hz)): are they exchanged?",
                    n.gyro_noise_density_radps_rthz, n.accel_noise_density_mps2_rthz));
  return out;
}

}  // namespace fbvins
