// SPDX-License-Identifier: Apache-2.0
#include "fbvins/eval/alignment.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <limits>

#include "fbvins/geometry/heading.hpp"
#include "fbvins/geometry/svd3.hpp"

namespace fbvins {
namespace {

constexpr std::array<std::string_view, 4> kNames = {"none", "yaw", "se3", "sim3"};

/// First and second moments of the two point sets.
struct Moments {
  Vec3 mean_truth = Vec3::Zero();
  Vec3 mean_estimate = Vec3::Zero();
  Mat3 covariance = Mat3::Zero();  ///< of truth with estimate, Umeyama's eq. 38, m^2
  double variance_estimate = 0;    ///< eq. 37, m^2
};

Moments moments_of(const std::vector<PosePair>& pairs) {
  const double weight = 1.0 / static_cast<double>(pairs.size());
  Moments m;
  for (const PosePair& pair : pairs) {
    m.mean_truth += weight * pair.truth.T.p;
    m.mean_estimate += weight * pair.estimate.T.p;
  }
  for (const PosePair& pair : pairs) {
    const Vec3 estimate = pair.estimate.T.p - m.mean_estimate;
    m.covariance += weight * (pair.truth.T.p - m.mean_truth) * estimate.transpose();
    m.variance_estimate += weight * estimate.squaredNorm();
  }
  return m;
}

Similarity around_means(const Moments& m, const Quat& q, double scale) {
  return {scale, q, Vec3(m.mean_truth - scale * (q * m.mean_estimate))};
}

/// The yaw that maximises the trace of Rz^T * covariance.
Similarity align_yaw(const Moments& m) {
  const Mat3& c = m.covariance;
  const double yaw = std::atan2(c(1, 0) - c(0, 1), c(0, 0) + c(1, 1));
  return around_means(m, Quat(Eigen::AngleAxisd(yaw, Vec3::UnitZ())), 1.0);
}

Result<Similarity> align_umeyama(const Moments& m, bool with_scale) {
  const Svd3 svd = svd3(m.covariance);
  const Vec3 d = svd.values;
  if (!(d(1) > std::numeric_limits<double>::epsilon()))
    return Error{ErrorCode::invalid_argument,
                 fmt::format("the positions do not span two directions (singular values {:.1e} {:.1e} {:.1e} m^2): "
                             "no SE3 or Sim3 alignment; align yaw only, or not at all",
                             d(0), d(1), d(2))};
  Vec3 s = Vec3::Ones();  // eq. 39: a rotation, not a mirror
  if (svd.U.determinant() * svd.V.determinant() < 0) s(2) = -1;
  const Mat3 R = svd.U * s.asDiagonal() * svd.V.transpose();
  const double scale = with_scale ? d.dot(s) / m.variance_estimate : 1.0;
  return around_means(m, Quat(R).normalized(), scale);
}

}  // namespace

std::string_view to_string(Alignment alignment) { return kNames[static_cast<std::size_t>(alignment)]; }

std::optional<Alignment> alignment_from_string(std::string_view name) {
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (kNames[i] == name) return static_cast<Alignment>(i);
  return std::nullopt;
}

Result<Similarity> align(const std::vector<PosePair>& pairs, Alignment alignment) {
  if (alignment == Alignment::none) return Similarity{};
  if (pairs.size() < 3)
    return Error{ErrorCode::invalid_argument, fmt::format("{} pairs of poses are too few to align", pairs.size())};
  const Moments m = moments_of(pairs);
  if (alignment == Alignment::yaw) return align_yaw(m);
  return align_umeyama(m, alignment == Alignment::sim3);
}

Result<Similarity> align_start(const std::vector<PosePair>& pairs) {
  if (pairs.empty()) return Error{ErrorCode::invalid_argument, "no pair of poses to align"};
  std::vector<PosePair> first;
  double sine = 0, cosine = 0;
  for (const PosePair& pair : pairs) {
    if ((pair.truth.t - pairs.front().truth.t).seconds() > 1) break;
    first.push_back(pair);
    const double yaw = heading_between(pair.estimate.T.q, pair.truth.T.q);
    sine += std::sin(yaw), cosine += std::cos(yaw);
  }
  const Quat about_z(Eigen::AngleAxisd(std::atan2(sine, cosine), Vec3::UnitZ()));
  return around_means(moments_of(first), about_z, 1.0);
}

Result<LevelledStart> align_start_levelled(const std::vector<PosePair>& pairs) {
  Vec3 up_in_truth = Vec3::Zero();
  for (std::size_t i = pairs.size() / 2; i < pairs.size(); ++i)
    up_in_truth += pairs[i].truth.T.q * (pairs[i].estimate.T.q.conjugate() * Vec3::UnitZ());
  const Quat level = up_in_truth.isZero() ? Quat::Identity() : so3_between(up_in_truth, Vec3::UnitZ());
  std::vector<PosePair> levelled = pairs;
  for (PosePair& pair : levelled) pair.truth.T = Similarity{1, level, Vec3::Zero()} * pair.truth.T;
  const Result<Similarity> start = align_start(levelled);
  if (!start) return start.error();
  const Quat back = level.conjugate();
  return LevelledStart{{1, (back * start->q).normalized(), Vec3(back * start->p)}, so3_log(level).norm()};
}

std::vector<PosePair> apply(const Similarity& similarity, std::vector<PosePair> pairs) {
  for (PosePair& pair : pairs) pair.estimate.T = similarity * pair.estimate.T;
  return pairs;
}

}  // namespace fbvins
