// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/turn_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "fbvins/core/median.hpp"
#include "fbvins/doctor/two_view.hpp"
#include "fbvins/geometry/ldlt.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

constexpr double kPair_s = 0.1, kPairSlack_s = 0.02;
constexpr std::size_t kFewestFeatures = 20;
constexpr double kHuber_px = 1.0;
constexpr int kIterations = 12;

/// Residual of a feature and its derivative by (turn, p) of the pair; false behind the camera.
bool residual(const Camera& camera, const PairedFeature& feature, const Vec2& ray_a, const Mat3& R_ba, const Vec3& p_ab, Vec2& r,
              Eigen::Matrix<double, 2, 6>& J) {
  // In units of the depth in a: X_b = R_ba (x_a - rho p_CaCb).
  const Vec3 X = R_ba * (ray_a.homogeneous() - feature.inverse_depth * p_ab);
  if (X.z() < 0.05) return false;
  Mat2 J_pixel;
  r = camera.distort(X.hnormalized(), &J_pixel) - feature.b_px;
  Eigen::Matrix<double, 2, 3> project;
  project << 1 / X.z(), 0, -X.x() / (X.z() * X.z()), 0, 1 / X.z(), -X.y() / (X.z() * X.z());
  const Eigen::Matrix<double, 2, 3> J_X = J_pixel * project;
  J.leftCols<3>() = J_X * hat(X);  // R_ab Exp(d): X_b = Exp(-d) X
  J.rightCols<3>() = -feature.inverse_depth * J_X * R_ba;
  return true;
}

/// The motion of a pair by Gauss-Newton, starting at none. False where the features do not fit one motion.
bool estimate_motion(const Camera& camera, FramePair& pair) {
  std::vector<Vec2> rays;
  std::vector<PairedFeature> features;
  for (const PairedFeature& feature : pair.features)
    if (const auto ray = camera.undistort(feature.a_px)) rays.push_back(*ray), features.push_back(feature);
  if (features.size() < kFewestFeatures) return false;
  pair.features = features;
  Quat q = Quat::Identity();  // R_ab
  Vec3 p = Vec3::Zero();
  double sigma = 0;
  Mat6 H;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Mat3 R_ba = q.conjugate().toRotationMatrix();
    H.setZero();
    Vec6 g = Vec6::Zero();
    std::vector<double> norms;
    const double threshold = iteration == 0 ? 1e3 : std::max(2 * sigma, 0.5 * kHuber_px);
    for (std::size_t i = 0; i < features.size(); ++i) {
      Vec2 r;
      Eigen::Matrix<double, 2, 6> J;
      if (!residual(camera, features[i], rays[i], R_ba, p, r, J)) continue;
      norms.push_back(r.norm());
      const double weight = huber(r.squaredNorm(), threshold).weight;
      H += weight * J.transpose() * J;
      g += weight * J.transpose() * r;
    }
    if (norms.size() < kFewestFeatures) return false;
    sigma = 0.85 * median(norms);  // of one coordinate, of a Rayleigh distribution
    H.diagonal().tail<3>().array() += 1e-4 * static_cast<double>(norms.size());
    const Vec6 d = -Ldlt<6>(H).solve(g);
    if (!d.allFinite()) return false;
    q = (q * so3_exp(d.head<3>())).normalized();
    p += d.tail<3>();
    if (iteration > 3 && d.head<3>().norm() < 1e-7) break;
  }
  pair.turn = so3_log(q);
  pair.p_CaCb = p;
  pair.rms_px = sigma;
  pair.covariance = H.inverse() * std::max(sigma * sigma, 1e-4);
  return sigma < 5 && pair.turn.allFinite();
}

std::vector<PairedFeature> in_both(const SeenFrame& a, const SeenFrame& b, bool without_depths) {
  std::vector<PairedFeature> both;
  auto there = b.features.begin();
  for (const SeenFeature& feature : a.features) {
    while (there != b.features.end() && there->id < feature.id) ++there;
    if (there == b.features.end()) break;
    if (there->id == feature.id && (without_depths || feature.inverse_depth > 0))
      both.push_back({feature.px, there->px, feature.inverse_depth});
  }
  return both;
}

/// Angular rates of camera and gyroscope, each without its mean, so that the gyroscope's bias does not matter.
struct Turns {
  std::vector<Vec3> seen, read;
};

struct Similarity {
  double correlation = 0, scale = 1;
  bool mirrored = false;
  Mat3 R = Mat3::Identity();
  Vec3 spread = Vec3::Zero();
};

/// seen = scale R read in the least-squares sense (Umeyama), with a reflection where that explains much more.
Similarity similarity(const Turns& turns) {
  Mat3 C = Mat3::Zero(), S = Mat3::Zero();
  double seen2 = 0, read2 = 0;
  for (std::size_t i = 0; i < turns.seen.size(); ++i) {
    C += turns.seen[i] * turns.read[i].transpose();
    S += turns.seen[i] * turns.seen[i].transpose();
    seen2 += turns.seen[i].squaredNorm();
    read2 += turns.read[i].squaredNorm();
  }
  Similarity out;
  if (!(seen2 > 0) || !(read2 > 0)) return out;
  const Eigen::JacobiSVD<Mat3> svd(C, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vec3 s = svd.singularValues();
  const bool improper = svd.matrixU().determinant() * svd.matrixV().determinant() < 0;
  // Without the reflection (Umeyama's sign) more remains unexplained; if hardly more, there was no rotation about that axis, and
  // the handedness cannot be told.
  const double with = s.sum(), without = s.x() + s.y() - s.z();
  const double left_with = 1 - with * with / (seen2 * read2), left_without = 1 - without * without / (seen2 * read2);
  out.mirrored = improper && left_without > 2 * left_with + 0.01;
  const double sign = improper && !out.mirrored ? -1 : 1;
  out.R = svd.matrixU() * Vec3(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
  const double trace = s.x() + s.y() + sign * s.z();
  out.correlation = trace / std::sqrt(seen2 * read2);
  out.scale = trace / read2;
  const Eigen::JacobiSVD<Mat3> axes(S / static_cast<double>(turns.seen.size()));
  out.spread = axes.singularValues().cwiseSqrt();
  return out;
}

Turns turns_at(const std::vector<FramePair>& pairs, const ImuSeries& imu, Duration offset) {
  Turns turns;
  Vec3 mean_seen = Vec3::Zero(), mean_read = Vec3::Zero();
  for (const FramePair& pair : pairs) {
    const Time a = pair.a + offset, b = pair.b + offset;
    if (a < imu.samples().front().t || b > imu.samples().back().t) continue;
    turns.seen.push_back(pair.turn / pair.dt_s());
    turns.read.push_back(imu.turned(a, b) / pair.dt_s());
    mean_seen += turns.seen.back();
    mean_read += turns.read.back();
  }
  const double n = std::max<double>(static_cast<double>(turns.seen.size()), 1);
  for (Vec3& v : turns.seen) v -= mean_seen / n;
  for (Vec3& v : turns.read) v -= mean_read / n;
  return turns;
}

}  // namespace

namespace {

/// The first frame after `a` that may be its partner; the number of frames where there is none.
std::size_t partner_of(std::size_t a, const std::vector<SeenFrame>& frames, bool without_depths) {
  std::size_t b = a + 1;
  while (b < frames.size() &&
         (without_depths ? (frames[b].t - frames[a].t).seconds() < kPair_s - kPairSlack_s : !frames[b].has_depths))
    ++b;
  return b;
}

}  // namespace

std::vector<FramePair> pair_frames(const Evidence& evidence) {
  std::vector<FramePair> pairs;
  const std::vector<SeenFrame>& frames = evidence.frames;
  const bool without_depths = !evidence.rig.has_right() && !evidence.rig.depth;
  for (std::size_t a = 0; a < frames.size();) {
    if (!without_depths && !frames[a].has_depths) {
      ++a;
      continue;
    }
    const std::size_t b = partner_of(a, frames, without_depths);
    if (b >= frames.size()) break;
    FramePair pair;
    pair.a = frames[a].t, pair.b = frames[b].t;
    pair.frame_a = a, pair.frame_b = b;
    pair.features = in_both(frames[a], frames[b], without_depths);
    pair.without_depths = without_depths;
    const Camera& camera = evidence.working_rig.left();
    const bool near = pair.dt_s() > 0 && pair.dt_s() < 3 * kPair_s;
    if (near && (without_depths ? estimate_without_depths(camera, pair) : estimate_motion(camera, pair)))
      pairs.push_back(std::move(pair));
    a = b;
  }
  return pairs;
}

namespace {

/// Ranges of the time offset: the near one first, the far one where nothing fits there.
constexpr double kNear_s = 0.6, kFar_s = 5, kGrid_s = 4e-3;
constexpr std::size_t kFewestPairs = 30;
/// A camera resolves a rotation of a tenth of a degree between images; below three times that nothing is judged.
constexpr double kLeastTurning_rad = 5e-3;
constexpr double kSurelyCorrelated = 0.9;

struct Scan {
  double offset_s = 0;
  Similarity best;
};

Scan scan(const std::vector<FramePair>& pairs, const ImuSeries& imu, double about_s, double range_s) {
  Scan out;
  const int steps = static_cast<int>(std::round(range_s / kGrid_s));
  std::vector<double> correlation(static_cast<std::size_t>(2 * steps + 1), 0.0);
  std::size_t best = 0;
  for (std::size_t i = 0; i < correlation.size(); ++i) {
    const double offset = about_s + (static_cast<double>(i) - steps) * kGrid_s;
    const Turns turns = turns_at(pairs, imu, Duration::from_seconds(offset));
    if (turns.seen.size() < pairs.size() / 2 || turns.seen.size() < kFewestPairs) continue;
    correlation[i] = similarity(turns).correlation;
    if (correlation[i] > correlation[best]) best = i;
  }
  double shift = 0;
  if (best > 0 && best + 1 < correlation.size()) {
    const double l = correlation[best - 1], m = correlation[best], r = correlation[best + 1];
    if (l > 0 && r > 0 && 2 * m - l - r > 1e-12) shift = 0.5 * (r - l) / (2 * m - l - r);
  }
  out.offset_s = about_s + (static_cast<double>(best) + shift - steps) * kGrid_s;
  out.best = similarity(turns_at(pairs, imu, Duration::from_seconds(out.offset_s)));
  return out;
}

}  // namespace

TurnFit fit_turns(const std::vector<FramePair>& pairs, const ImuSeries& imu, const StereoRig& rig) {
  TurnFit fit;
  if (pairs.size() < kFewestPairs || imu.empty()) return fit;
  double sum = 0;
  for (const FramePair& pair : pairs) sum += pair.turn.squaredNorm();
  fit.turning_rad = std::sqrt(sum / static_cast<double>(pairs.size()));
  if (fit.turning_rad < kLeastTurning_rad) return fit;
  Scan found = scan(pairs, imu, rig.time_offset_s, kNear_s);
  if (found.best.correlation < kSurelyCorrelated) {
    const Scan far = scan(pairs, imu, rig.time_offset_s, kFar_s);
    if (far.best.correlation > found.best.correlation + 0.1) found = far;
  }
  fit.seen = true;
  fit.correlation = found.best.correlation, fit.offset_s = found.offset_s, fit.scale = found.best.scale;
  fit.mirrored = found.best.mirrored, fit.R_CB = found.best.R, fit.spread = found.best.spread * kPair_s;
  return fit;
}

}  // namespace fbvins
