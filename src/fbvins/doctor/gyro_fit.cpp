// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/gyro_fit.hpp"

#include <limits>

#include "fbvins/imu/gyro_alignment.hpp"

namespace fbvins {
namespace {

constexpr int kFewestPairs = 30;
/// Of a tracked feature; its size is corrected by the residuals.
constexpr double kTrack_px = 0.5;
/// Less is known of a setup that is examined than of one in flight. Its axes have been looked at.
constexpr GyroAlignmentPrior kPrior{.gyro_bias_radps = 0.2, .time_offset_s = 0.1, .line_delay_s = 1e-4, .rotation_rad = 0.1};

TrackedFrame tracked(const SeenFrame& seen, const Camera& camera) {
  TrackedFrame out;
  out.t = seen.t;
  for (const SeenFeature& feature : seen.features) {
    const auto ray = camera.undistort(feature.px);
    if (!ray) continue;
    TrackedFeature f;
    f.id = TrackId{feature.id};
    f.see(0, Observation{feature.px, *ray, camera.focal_px() / kTrack_px * Mat2::Identity()});
    out.features.push_back(std::move(f));
  }
  return out;
}

}  // namespace

std::optional<GyroFit> fit_gyro(std::span<const SeenFrame> frames, const ImuSeries& imu, const StereoRig& rig, double offset_s) {
  const Duration offset = Duration::from_seconds(offset_s);
  const double line_delay_s = rig.times(0).line_delay_s;
  GyroAlignment alignment(rig.T_BC0().R(), 0.5 * rig.left().height(), line_delay_s, kPrior,
                          std::numeric_limits<std::size_t>::max());
  std::optional<Time> before;
  for (const SeenFrame& seen : frames) {
    TrackedFrame frame = tracked(seen, rig.left());
    if (before && imu.covers(*before + offset, seen.t + offset)) frame.imu = imu.segment(*before + offset, seen.t + offset);
    alignment.add(frame, offset);
    before = seen.t;
  }
  const auto found = alignment.solve();
  if (!found || found->pairs < kFewestPairs) return std::nullopt;
  return GyroFit{offset_s + found->time_offset_s(),
                 found->time_offset_sigma_s(),
                 line_delay_s + found->line_delay_s(),
                 found->line_delay_sigma_s(),
                 (so3_exp(found->rotation_rad()).toRotationMatrix() * rig.T_BC0().R()).transpose(),
                 found->covariance.diagonal().tail<3>().cwiseSqrt()};
}

}  // namespace fbvins
