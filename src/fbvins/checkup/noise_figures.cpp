// SPDX-License-Identifier: Apache-2.0
#include "fbvins/checkup/noise_figures.hpp"

#include <fmt/format.h>

#include <string>

namespace fbvins {
namespace {

/// A density that is plausible: from a tenth of what good tactical sensors have to ten times that of bad consumer ones.
struct Range {
  double least, most;
  bool holds(double density) const { return density >= least && density <= most; }
};
constexpr Range kGyro{5e-6, 5e-3}, kAccel{5e-5, 0.1};  // rad/s/sqrt(Hz), m/s^2/sqrt(Hz)

std::string complaint(const char* sensor, double density, const Range& range) {
  return fmt::format("the {}'s noise density in the calibration is {:.3g}, and IMUs have {:.0e} to {:.0e}", sensor, density,
                     range.least, range.most);
}

}  // namespace

std::optional<Finding> check_noise_figures(const ImuNoise& noise) {
  const double gyro = noise.gyro_noise_density_radps_rthz, accel = noise.accel_noise_density_mps2_rthz;
  const bool gyro_wrong = !kGyro.holds(gyro), accel_wrong = !kAccel.holds(accel);
  if (!gyro_wrong && !accel_wrong) return std::nullopt;
  Finding finding;
  finding.kind = FindingKind::imu_noise;
  finding.size = gyro_wrong ? gyro / ImuNoise{}.gyro_noise_density_radps_rthz : accel / ImuNoise{}.accel_noise_density_mps2_rthz;
  finding.unit = "of the default";
  if (gyro_wrong) finding.measured = complaint("gyroscope", gyro, kGyro);
  if (accel_wrong) finding.measured += (gyro_wrong ? ", " : "") + complaint("accelerometer", accel, kAccel);
  finding.expected = "densities, rad/s/sqrt(Hz) and m/s^2/sqrt(Hz), as in the data sheet";
  finding.advice = "give twice the data sheet's figures, or measure them (fbvins calibrate --imu-noise); until then the default";
  finding.fields = {CalibrationField::imu_noise};
  return finding;
}

ImuNoise plausible(ImuNoise noise) {
  const ImuNoise usual;
  if (!kGyro.holds(noise.gyro_noise_density_radps_rthz)) {
    noise.gyro_noise_density_radps_rthz = usual.gyro_noise_density_radps_rthz;
    noise.gyro_random_walk_radps2_rthz = usual.gyro_random_walk_radps2_rthz;
  }
  if (!kAccel.holds(noise.accel_noise_density_mps2_rthz)) {
    noise.accel_noise_density_mps2_rthz = usual.accel_noise_density_mps2_rthz;
    noise.accel_random_walk_mps3_rthz = usual.accel_random_walk_mps3_rthz;
  }
  return noise;
}

}  // namespace fbvins
