// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/estimator_setup.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "fbvins/camera/camera_groups.hpp"
#include "fbvins/camera/depth_reader.hpp"
#include "fbvins/core/hypotenuse.hpp"
#include "fbvins/estimator/calibration_uncertainty.hpp"

namespace fbvins {

WindowWeights weights_of(const EstimatorOptions& o, bool images_show_scale) {
  WindowWeights w;
  w.images_show_scale = images_show_scale;
  w.gravity_mps2 = o.gravity_mps2;
  w.estimate_extrinsics = o.estimate_extrinsics;
  w.estimate_time_offset = o.estimate_time_offset;
  w.estimate_line_delay = o.estimate_line_delay;
  return w;
}

EstimatorOptions for_cameras_of(const StereoRig& rig, EstimatorOptions options) {
  if (!has_stereo(rig)) options.known_landmarks.enabled = false;
  if (rig.depth) options.estimate_extrinsics = false;
  return options;
}

ImuNoise assumed_noise(ImuNoise noise, const EstimatorOptions& o) {
  noise.gyro_noise_density_radps_rthz =
      hypotenuse(o.gyro_noise_scale * noise.gyro_noise_density_radps_rthz, o.gyro_unmodelled_radps_rthz);
  noise.accel_noise_density_mps2_rthz =
      hypotenuse(o.accel_noise_scale * noise.accel_noise_density_mps2_rthz, o.accel_unmodelled_mps2_rthz);
  noise.gyro_random_walk_radps2_rthz *= o.gyro_walk_scale;
  noise.accel_random_walk_mps3_rthz *= o.accel_walk_scale;
  return noise;
}

Calibration calibration_of(const StereoRig& rig) {
  Calibration out{.cameras = {}};
  for (const MountedCamera& camera : rig.cameras) out.cameras.push_back(camera.T_BC);
  if (!rig.has_right()) out.cameras.push_back(rig.depth ? depth_observer(rig.T_BC0()) : rig.T_BC0());
  return out;
}

double scale_sigma_of(const StereoRig& rig) {
  if (rig.depth) return rig.depth->scale_sigma;
  double least = 0;
  for (const CameraGroup& group : camera_groups(rig)) {
    if (!group.second) continue;
    const double sigma = scale_sigma(rig.T_BC(group.first).p, rig.T_BC(*group.second).p);
    least = least == 0 ? sigma : std::min(least, sigma);
  }
  return least;
}

Frame without_state(const TrackedFrame& tracked) {
  Frame f;
  f.id = tracked.id;
  f.t = tracked.t;
  f.images = tracked.images;
  f.depth = tracked.depth;
  return f;
}

std::vector<TrackedFeature> without_cameras(std::vector<TrackedFeature> features, std::uint8_t cameras) {
  for (TrackedFeature& feature : features)
    feature.seen.erase_if([&](const Observation& o) { return (cameras >> o.camera & 1U) != 0; });
  std::erase_if(features, [](const TrackedFeature& f) { return f.seen.empty(); });
  return features;
}

Frame frame_of_start(const InitialSolution& start, std::size_t number, const ImuNoise& noise) {
  Frame f = without_state(start.frames[number]);
  f.state = start.states[number];
  f.keyframe = start.from_rest ? number == 0 : number % 2 == 0;
  if (number == 0) return f;
  Preintegration imu(noise, f.state.bias);
  imu.integrate(start.frames[number].imu);
  f.imu = std::make_shared<const Preintegration>(std::move(imu));
  return f;
}

}  // namespace fbvins
