// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/camera_residuals.hpp"

#include <algorithm>

#include "fbvins/core/median.hpp"
#include "fbvins/estimator/integrity_thresholds.hpp"

namespace fbvins {
namespace {

unsigned bit(int camera) { return 1U << static_cast<unsigned>(camera); }

/// The cameras of the landmarks that a camera leads or sees.
unsigned with_partners(int camera, const std::vector<LandmarkObservation>& observations) {
  unsigned out = bit(camera);
  for (const LandmarkObservation& l : observations) {
    unsigned of_this = bit(l.feature->lead);
    for (const Observation& o : l.feature->seen) of_this |= bit(o.camera);
    if ((of_this & bit(camera)) != 0) out |= of_this;
  }
  return out;
}

}  // namespace

double ResidualMedians::worst() const {
  double worst = 0;
  for (const std::optional<double>& n : norm) worst = std::max(worst, n.value_or(0));
  return worst;
}

ResidualMedians camera_residuals(const std::vector<LandmarkObservation>& observations, const Calibration& calibration,
                                 const Pose<G, B>& T_GB, const Vec3& v_B) {
  const CameraGeometry cameras(calibration);
  const Mat3 R_BG = T_GB.R().transpose();
  ResidualMedians out;
  out.shift.fill(Vec2::Zero());
  for (int c = 0; c < calibration.camera_count(); ++c) {
    std::vector<double> residuals, x, y;
    for (const LandmarkObservation& l : observations) {
      const Observation* o = l.feature->by(c);
      if (!o) continue;
      const Vec3 p_C = cameras.R_CB[c] * (R_BG * (l.p_G - T_GB.p) - cameras.t_BC[c] - o->displacement_B(v_B));
      const Vec2 r =
          p_C.z() > kMinScaledDepth ? Vec2(o->sqrt_information * (p_C.head<2>() / p_C.z() - o->normalised)) : Vec2(1e3, 1e3);
      residuals.push_back(r.norm()), x.push_back(r.x()), y.push_back(r.y());
      out.focal = o->sqrt_information(0, 0);
    }
    if (residuals.size() < thresholds::kFewestToJudge) continue;
    out.norm[static_cast<std::size_t>(c)] = median(residuals);
    out.shift[static_cast<std::size_t>(c)] = Vec2(median(x), median(y));
  }
  return out;
}

std::uint8_t camera_off_alone(const std::vector<LandmarkObservation>& observations, const ResidualMedians& at,
                              const std::vector<double>& off, const std::function<double(double)>& limit) {
  const auto worst = static_cast<int>(std::max_element(off.begin(), off.end()) - off.begin());
  if (!at.of(worst)) return 0;
  for (const unsigned cameras : {bit(worst), with_partners(worst, observations)}) {
    double of_others = 0;
    int others = 0;
    for (int c = 0; c < static_cast<int>(off.size()); ++c) {
      if ((cameras & bit(c)) != 0) continue;
      others += at.of(c);
      of_others = std::max(of_others, off[static_cast<std::size_t>(c)]);
    }
    if (others > 0 && of_others < limit(off[static_cast<std::size_t>(worst)])) return static_cast<std::uint8_t>(cameras);
  }
  return 0;
}

}  // namespace fbvins
