// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/exposures.hpp"

#include "fbvins/camera/camera_times.hpp"

namespace fbvins {

Exposures::Exposures(const StereoRig& rig) : rolling_(has_rolling_shutter(rig)), depth_(rig.depth.has_value()) {
  for (int i = 0; i < rig.camera_count(); ++i) shutters_.push_back({0.5 * rig.camera(i).height(), rig.times(i).line_delay_s});
}

void Exposures::refer_to_stamp(const ExposureMotion& motion, const Calibration& calibration, TrackedFrame& frame) const {
  const auto refer = [&](Observation& o) {
    const int clock = depth_ ? 0 : o.camera;
    const Shutter& shutter = shutters_[static_cast<std::size_t>(clock)];
    o.rows = o.pixel.y() - shutter.middle_row_px;
    o.after_s = frame.offsets.of(clock).seconds() + o.rows * (shutter.line_delay_s + line_delay_correction_s_);  // (S1)
    if (o.after_s == 0) return;
    const Pose<B, C0> T_BC = calibration.T_BC(o.camera);
    const Quat turn = motion.turn(o.after_s);
    const Vec3 ray_C = T_BC.q.conjugate() * (turn * (T_BC.q * o.normalised.homogeneous()));  // (S3)
    if (ray_C.z() > 1e-3) o.normalised = ray_C.hnormalized();
    o.lever_B = turn * T_BC.p - T_BC.p + motion.moved(o.after_s);  // (S4)
  };
  for (TrackedFeature& f : frame.features)
    for (Observation& o : f.seen) refer(o);
}

}  // namespace fbvins
