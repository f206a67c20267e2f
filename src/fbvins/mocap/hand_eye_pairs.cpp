// SPDX-License-Identifier: Apache-2.0
#include "fbvins/mocap/hand_eye_pairs.hpp"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>

#include "fbvins/core/median.hpp"
#include "fbvins/geometry/heading.hpp"
#include "fbvins/geometry/ldlt.hpp"

namespace fbvins {
namespace {

constexpr double kTurn_s = 0.5, kLongestTurn_s = 0.8;  // over which turns of body and markers are compared
constexpr double kCandidate_s = 3;                     // of flight, from which one candidate of R_BK is made
constexpr double kTurnSlack_rad = 0.02, kTurnSlack_share = 0.1;
constexpr double kFewestFit = 0.5;
constexpr double kWidestSlope_s = 0.3;  // between the neighbours from which a velocity is taken

/// The same rotation vector in B and in K: a = R_BK * b.
struct Turn {
  Time t;
  Vec3 a_B, b_K;
};

std::vector<Turn> turns_of(const std::vector<HandEyePair>& pairs) {
  std::vector<Turn> turns;
  for (std::size_t i = 0, k = 0; i < pairs.size(); ++i) {
    while (k < pairs.size() && (pairs[k].t - pairs[i].t).seconds() < kTurn_s) ++k;
    if (k == pairs.size()) break;
    if ((pairs[k].t - pairs[i].t).seconds() > kLongestTurn_s) continue;
    turns.push_back({pairs[i].t, so3_log(pairs[i].T_WB.q.conjugate() * pairs[k].T_WB.q),
                     so3_log(pairs[i].T_VK.q.conjugate() * pairs[k].T_VK.q)});
  }
  return turns;
}

/// The rotation that aligns the b with the a (Kabsch).
template <class Chosen>
Quat rotation_between(const std::vector<Turn>& turns, Chosen&& chosen) {
  Mat3 sum = Mat3::Zero();
  for (const Turn& turn : turns)
    if (chosen(turn)) sum += turn.a_B * turn.b_K.transpose();
  const Eigen::JacobiSVD<Mat3> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vec3 s = Vec3::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) s(2) = -1;
  return Quat(Mat3(svd.matrixU() * s.asDiagonal() * svd.matrixV().transpose())).normalized();
}

bool fits(const Turn& turn, const Quat& q_BK) {
  return (turn.a_B - q_BK * turn.b_K).norm() < kTurnSlack_rad + kTurnSlack_share * turn.a_B.norm();
}

/// Whether a turn is large enough to test a rotation: at rest every rotation fits.
bool is_large(const Turn& turn) { return turn.a_B.norm() > 2 * kTurnSlack_rad || turn.b_K.norm() > 2 * kTurnSlack_rad; }

struct RotationFit {
  Quat q_BK = Quat::Identity();
  double share = 0;  ///< of the large turns, those that fit
};

/// Of candidates from pieces of the flight the one with which most turns agree, refined with these.
RotationFit fit_rotation(const std::vector<Turn>& turns) {
  std::size_t large = 0, most = 0;
  for (const Turn& turn : turns) large += is_large(turn);
  RotationFit best;
  if (large == 0) return best;
  const auto count = [&](const Quat& q) {
    return static_cast<std::size_t>(
        std::count_if(turns.begin(), turns.end(), [&](const Turn& turn) { return is_large(turn) && fits(turn, q); }));
  };
  const Duration piece = Duration::from_seconds(kCandidate_s);
  for (Time from = turns.front().t; from <= turns.back().t; from = from + piece) {
    const Quat q = rotation_between(turns, [&](const Turn& turn) { return turn.t >= from && turn.t < from + piece; });
    if (const std::size_t agree = count(q); agree > most) most = agree, best.q_BK = q;
  }
  for (int i = 0; i < 5; ++i) best.q_BK = rotation_between(turns, [&](const Turn& turn) { return fits(turn, best.q_BK); });
  best.share = static_cast<double>(count(best.q_BK)) / static_cast<double>(large);
  return best;
}

double angle(const Quat& a, const Quat& b) { return so3_log(a.conjugate() * b).norm(); }

/// R_VW from all pairs: the medoid of some, then a weighted mean of all.
Quat fit_world(const std::vector<HandEyePair>& pairs, const Quat& q_BK) {
  std::vector<Quat> each;
  for (const HandEyePair& pair : pairs) each.push_back(pair.T_VK.q * q_BK.conjugate() * pair.T_WB.q.conjugate());
  constexpr std::size_t kSome = 100;
  const std::size_t stride = std::max<std::size_t>(1, each.size() / kSome);
  Quat q = each.front();
  double least = 10;
  for (std::size_t i = 0; i < each.size(); i += stride) {
    std::vector<double> distances;
    for (std::size_t k = 0; k < each.size(); k += stride) distances.push_back(angle(each[i], each[k]));
    if (const double d = median_of(distances); d < least) least = d, q = each[i];
  }
  constexpr double kScale_rad = 0.03;
  for (int i = 0; i < 10; ++i) {
    Vec3 sum = Vec3::Zero();
    double weights = 0;
    for (const Quat& other : each) {
      const Vec3 d = so3_log(q.conjugate() * other);
      const double weight = 1 / (1 + d.squaredNorm() / (kScale_rad * kScale_rad));
      sum += weight * weight * d, weights += weight * weight;
    }
    q = (q * so3_exp(sum / weights)).normalized();
  }
  return q;
}

/// Lever arm and translation, linear once the rotations are known; reweighted (Cauchy).
void fit_translations(const std::vector<HandEyePair>& pairs, MarkerCalibration& c) {
  constexpr double kSmallestScale_m = 0.01, kLever_m = 1;  // a weak prior: without turns the lever arm is unobservable
  double scale = 1e3;
  for (int i = 0; i < 20; ++i) {
    Mat6 A = Mat6::Zero();
    Vec6 b = Vec6::Zero();
    A.topLeftCorner<3, 3>() = 1e-4 / (kLever_m * kLever_m) * Mat3::Identity();
    std::vector<double> sizes;
    for (const HandEyePair& pair : pairs) {
      const double size = residual_of(pair, c).head<3>().norm();
      sizes.push_back(size);
      const double weight = 1 / (1 + size * size / (scale * scale));
      Eigen::Matrix<double, 3, 6> J;
      J << pair.T_WB.R(), Mat3::Identity();
      A += weight * J.transpose() * J;
      b += weight * J.transpose() * (c.T_VW.q.conjugate() * pair.T_VK.p - pair.T_WB.p);
    }
    const Vec6 x = Ldlt<6>(A).solve(b);
    c.T_BK.p = x.head<3>();
    c.T_VW.p = c.T_VW.q * Vec3(x.tail<3>());
    if (i > 0) scale = std::max(1.5 * median_of(sizes), kSmallestScale_m);
  }
}

}  // namespace

std::vector<HandEyePair> pair_up(const MarkerCurve& curve, const Trajectory<W>& estimate, const MarkerCalibration& clocks) {
  std::vector<HandEyePair> pairs;
  for (std::size_t i = 1; i + 1 < estimate.size(); ++i) {
    const StampedPose<W>&before = estimate[i - 1], &here = estimate[i], &after = estimate[i + 1];
    const double dt = (after.t - before.t).seconds();
    if (dt > kWidestSlope_s) continue;
    const auto T_VK = curve.at(clocks.to_marker(here.t));
    if (!T_VK) continue;
    pairs.push_back({here.t, here.T, (after.T.p - before.T.p) / dt, so3_log(before.T.q.conjugate() * after.T.q) / dt, *T_VK});
  }
  return pairs;
}

Result<MarkerCalibration> start_hand_eye(const std::vector<HandEyePair>& pairs, const MarkerCalibration& clocks,
                                         bool level_world) {
  MarkerCalibration c = clocks;
  const std::vector<Turn> turns = turns_of(pairs);
  const RotationFit rotation = fit_rotation(turns);
  if (rotation.share == 0)
    return Error{ErrorCode::invalid_argument,
                 "the motion is too poor: the body hardly turns, so that the markers' rotation on it is not shown"};
  if (rotation.share < kFewestFit)
    return Error{
        ErrorCode::invalid_argument,
        fmt::format(
            "markers and estimate turn equally fast but only {:.0f} % of the turns fit one rotation between them: are the axes "
            "mirrored, or is the body flipped for half of the flight?",
            100 * rotation.share)};
  c.T_BK.q = rotation.q_BK;
  c.T_VW.q = fit_world(pairs, c.T_BK.q);
  if (level_world) c.T_VW.q = Quat(Eigen::AngleAxisd(heading_between(Quat::Identity(), c.T_VW.q), Vec3::UnitZ()));
  fit_translations(pairs, c);
  return c;
}

Vec6 residual_of(const HandEyePair& pair, const MarkerCalibration& c) {
  const Quat q_WV = c.T_VW.q.conjugate();
  Vec6 r;
  r << q_WV * (pair.T_VK.p - c.T_VW.p) - pair.T_WB * c.T_BK.p,
      so3_log(q_WV * pair.T_VK.q * c.T_BK.q.conjugate() * pair.T_WB.q.conjugate());
  return r;
}

}  // namespace fbvins
