// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/exposures.hpp"

namespace fbvins {

Exposures::Exposures(const StereoRig& rig) : line_delay_s_(rig.line_delay_s), depth_(rig.depth.has_value()) {
  for (int i = 0; i < rig.camera_count(); ++i) heights_px_.push_back(rig.camera(i).height());
}

void Exposures::refer_to_stamp(const ExposureMotion& motion, const Calibration& calibration, TrackedFrame& frame) const {
  const auto refer = [&](Observation& o, int camera) {
    const int clock = depth_ ? 0 : camera;
    o.rows = o.pixel.y() - 0.5 * heights_px_[static_cast<std::size_t>(clock)];
    o.after_s = frame.offsets.of(clock).seconds() + o.rows * line_delay_s_;
    if (o.after_s == 0) return;
    const Pose<B, C0> T_BC = calibration.T_BC(camera);
    const Quat turn = motion.turn(o.after_s);
    const Vec3 ray_C = T_BC.q.conjugate() * (turn * (T_BC.q * o.normalised.homogeneous()));  // (S3)
    if (ray_C.z() > 1e-3) o.normalised = ray_C.hnormalized();
    o.lever_B = turn * T_BC.p - T_BC.p + motion.moved(o.after_s);  // (S4)
  };
  for (TrackedFeature& f : frame.features) {
    if (f.left) refer(*f.left, f.cameras.left);
    if (f.right) refer(*f.right, f.cameras.right);
  }
}

}  // namespace fbvins
