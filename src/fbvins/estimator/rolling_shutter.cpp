// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/rolling_shutter.hpp"

#include <algorithm>

#include "fbvins/geometry/so3.hpp"

namespace fbvins {
namespace {

constexpr Duration kSlopeOver = Duration{25'000'000};

/// (S3), (S4). No change where the point would have no projection.
void shift(Observation& o, double after_s, double inverse_depth, const ShutterMotion& motion, const Pose<B, C0>& T_BC) {
  const Vec3 turn = after_s * motion.w_B + 0.5 * after_s * after_s * motion.alpha_B;
  const Vec3 at_row_B = T_BC.q * o.normalised.homogeneous() + inverse_depth * T_BC.p;
  const Vec3 at_stamp_B = so3_exp(turn) * at_row_B + inverse_depth * after_s * motion.v_B;
  const Vec3 p_C = T_BC.q.conjugate() * (at_stamp_B - inverse_depth * T_BC.p);
  if (p_C.z() > 1e-3) o.normalised = p_C.head<2>() / p_C.z();
}

/// By least squares, of the left ray with the right observation; zero for a match that is behind the cameras.
double stereo_inverse_depth(const TrackedFeature& f, const Calibration& calibration) {
  const Pose<B, C0> T_BL = calibration.T_BC(f.cameras.left), T_BR = calibration.T_BC(f.cameras.right);
  const Mat3 R_RB = T_BR.R().transpose();
  const Vec3 a = R_RB * (T_BL.q * f.left->normalised.homogeneous());
  const Vec3 b = R_RB * (T_BL.p - T_BR.p);
  const Vec2 u = a.head<2>() - a.z() * f.right->normalised, w = b.head<2>() - b.z() * f.right->normalised;
  return std::max(0.0, -u.dot(w) / w.squaredNorm());
}

}  // namespace

ShutterMotion turning_at_end(const ImuSegment& readings, const Vec3& gyro_bias_radps) {
  ShutterMotion out;
  if (readings.empty()) return out;
  const Time end = readings.samples.back().t;
  double n = 0, t = 0, tt = 0;
  Vec3 w = Vec3::Zero(), tw = Vec3::Zero();
  for (const ImuSample& s : readings.samples) {
    if (s.t < end - kSlopeOver) continue;
    const double at = (s.t - end).seconds();
    n += 1, t += at, tt += at * at, w += s.gyro_radps, tw += at * s.gyro_radps;
  }
  const double spread = n * tt - t * t;
  if (n >= 3 && spread > 0) out.alpha_B = (n * tw - t * w) / spread;
  out.w_B = (w - t * out.alpha_B) / n - gyro_bias_radps;
  return out;
}

RollingShutter::RollingShutter(const StereoRig& rig) : line_delay_s_(rig.line_delay_s) {
  for (int i = 0; i < rig.camera_count(); ++i) heights_px_.push_back(rig.camera(i).height());
  if (rig.depth) heights_px_.push_back(rig.left.height());  // a depth has its pixel's row
}

void RollingShutter::bring_to_stamp(const ShutterMotion& motion, const Calibration& calibration, const InverseDepth* known,
                                    std::vector<TrackedFeature>& features) const {
  for (TrackedFeature& f : features) {
    const double stereo = f.left && f.right ? stereo_inverse_depth(f, calibration) : 0;
    const auto bring = [&](Observation& o, bool right) {
      const int camera = f.cameras[right];
      o.rows = o.pixel.y() - 0.5 * heights_px_[static_cast<std::size_t>(camera)];
      if (global()) return;
      const double after_s = o.rows * line_delay_s_;
      const std::optional<double> depth = known ? (*known)(f, right) : std::nullopt;
      shift(o, after_s, depth.value_or(stereo), motion, calibration.T_BC(camera));
    };
    if (f.left) bring(*f.left, false);
    if (f.right) bring(*f.right, true);
  }
}

}  // namespace fbvins
