// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/rest_detector.hpp"

#include "fbvins/core/median.hpp"

#include <algorithm>
#include <vector>

namespace fbvins {

void RestDetector::start(const TrackedFrame& frame) {
  reference_.clear();
  since_ = frame.t;
  for (const TrackedFeature& f : frame.features) {
    Sights& sights = reference_[f.id];
    for (const Observation& o : f.seen) sights.push_back({o.camera, o.pixel});
  }
}

bool RestDetector::imu_is_quiet(const ImuSegment& imu) const {
  if (imu.empty()) return false;
  const double n = static_cast<double>(imu.samples.size());
  Vec3 gyro = Vec3::Zero(), accel = Vec3::Zero(), gyro2 = Vec3::Zero(), accel2 = Vec3::Zero();
  for (const ImuSample& s : imu.samples) {
    gyro += s.gyro_radps / n;
    accel += s.accel_mps2 / n;
    gyro2 += s.gyro_radps.cwiseAbs2() / n;
    accel2 += s.accel_mps2.cwiseAbs2() / n;
  }
  const double gyro_variance = (gyro2 - gyro.cwiseAbs2()).maxCoeff();
  const double accel_variance = (accel2 - accel.cwiseAbs2()).maxCoeff();
  return gyro_variance < options_.max_gyro_std_radps * options_.max_gyro_std_radps &&
         accel_variance < options_.max_accel_std_mps2 * options_.max_accel_std_mps2;
}

Duration RestDetector::update(const TrackedFrame& frame) {
  std::vector<double> motion;
  for (const TrackedFeature& f : frame.features) {
    const auto before = reference_.find(f.id);
    if (before == reference_.end()) continue;
    for (const Observation& o : f.seen) {  // the first camera that saw it both times
      const auto then = std::ranges::find(before->second, o.camera, &Sight::camera);
      if (then == before->second.end()) continue;
      motion.push_back((o.pixel - then->pixel).norm());
      break;
    }
  }
  const bool enough = static_cast<int>(motion.size()) >= options_.min_features;
  if (!enough || !imu_is_quiet(frame.imu) || median(motion) >= options_.max_motion_px) {
    start(frame);
    return {};
  }
  return frame.t - since_;
}

}  // namespace fbvins
