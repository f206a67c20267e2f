// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/two_view.hpp"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "fbvins/core/median.hpp"
#include "fbvins/geometry/ldlt.hpp"
#include "fbvins/optim/robust_loss.hpp"

namespace fbvins {
namespace {

constexpr double kEpipole = 0.1;
/// Features that move less count alike.
constexpr double kLeastNormal_rad = 1e-3;
constexpr std::size_t kFewestFeatures = 20;
constexpr int kIterations = 12;
constexpr double kSigmas = 2, kLeast_px = 0.1, kMost_px = 5;
/// Of an angle's median magnitude, for a normal distribution.
constexpr double kSigmaOfMedian = 1.4826;
/// Of the translation's direction beside what the features say, where they lie far away, per feature.
constexpr double kPrior = 1e-6;

/// What turns the rays of a into those of b as well as a rotation alone can: the start of the search.
Quat turn_alone(const RayPairs& rays) {
  Quat q = Quat::Identity();  // R_ba
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    std::vector<double> norms;
    for (std::size_t i = 0; i < rays.a.size(); ++i) norms.push_back((q * rays.a[i] - rays.b[i]).norm());
    const double threshold = std::max(median(norms), 1e-6);
    Mat3 H = 1e-12 * Mat3::Identity();
    Vec3 g = Vec3::Zero();
    for (std::size_t i = 0; i < rays.a.size(); ++i) {
      const Vec3 seen = q * rays.a[i], r = seen - rays.b[i];
      const Mat3 J = -hat(seen);  // Exp(d) q
      const double weight = huber(r.squaredNorm(), threshold).weight;
      H += weight * J.transpose() * J, g += weight * J.transpose() * r;
    }
    const Vec3 d = -Ldlt<3>(H).solve(g);
    if (!d.allFinite()) return Quat::Identity();
    q = (so3_exp(d) * q).normalized();
    if (d.norm() < 1e-7) break;
  }
  return q;
}

struct Step {
  Eigen::Matrix<double, 5, 5> H = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> g = Eigen::Matrix<double, 5, 1>::Zero();
};

/// By a small turn of the rays of a (Exp(d) q_ba), and the direction of p along e and f.
Step linearise(const RayPairs& rays, const Quat& q_ba, const Vec3& p, const Vec3& e, const Vec3& f, double threshold) {
  Step out;
  for (std::size_t i = 0; i < rays.a.size(); ++i) {
    const Vec3 seen = q_ba * rays.a[i], n = seen.cross(rays.b[i]);
    const double scale = 1 / std::max(kEpipole, p.cross(seen).norm()), r = epipolar_angle(seen, rays.b[i], p);
    Eigen::Matrix<double, 5, 1> J;
    J << scale * (hat(seen) * rays.b[i].cross(p)), scale * e.dot(n), scale * f.dot(n);
    const double weight = huber(r * r, threshold).weight;
    out.H += weight * J * J.transpose(), out.g += weight * r * J;
  }
  out.H.diagonal().tail<2>().array() += kPrior * static_cast<double>(rays.a.size());
  return out;
}

}  // namespace

Vec3 translation_direction(const RayPairs& rays) {
  Mat3 spread = Mat3::Zero(), by_noise = 1e-9 * Mat3::Identity();
  for (std::size_t i = 0; i < rays.a.size(); ++i) {
    const Vec3 n = rays.a[i].cross(rays.b[i]);
    const double weight = 1 / std::max(n.norm(), kLeastNormal_rad);
    spread += weight * n * n.transpose();
    by_noise += weight * (Mat3::Identity() - rays.a[i] * rays.a[i].transpose());
  }
  return Eigen::GeneralizedSelfAdjointEigenSolver<Mat3>(spread, by_noise).eigenvectors().col(0).normalized();
}

double epipolar_angle(const Vec3& a, const Vec3& b, const Vec3& p) {
  return p.dot(a.cross(b)) / std::max(kEpipole, p.cross(a).norm());
}

bool estimate_without_depths(const Camera& camera, FramePair& pair) {
  RayPairs rays;
  std::vector<PairedFeature> features;
  for (const PairedFeature& feature : pair.features) {
    const auto a = camera.undistort(feature.a_px), b = camera.undistort(feature.b_px);
    if (!a || !b) continue;
    rays.a.push_back(a->homogeneous().normalized()), rays.b.push_back(b->homogeneous().normalized());
    features.push_back(feature);
  }
  if (features.size() < kFewestFeatures) return false;
  pair.features = std::move(features);
  Quat q = turn_alone(rays);
  RayPairs turned = rays;
  for (Vec3& ray : turned.a) ray = q * ray;
  Vec3 p = translation_direction(turned);
  double sigma = 0;
  Step step;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    std::vector<double> angles;
    for (std::size_t i = 0; i < rays.a.size(); ++i) angles.push_back(std::abs(epipolar_angle(q * rays.a[i], rays.b[i], p)));
    sigma = std::max(kSigmaOfMedian * median(angles), kLeast_px / camera.focal_px());
    const Vec3 e = p.unitOrthogonal(), f = p.cross(e);
    step = linearise(rays, q, p, e, f, kSigmas * sigma);
    const Eigen::Matrix<double, 5, 1> d = -Ldlt<5>(step.H).solve(step.g);
    if (!d.allFinite()) return false;
    q = (so3_exp(Vec3(d.head<3>())) * q).normalized();
    p = (p + d(3) * e + d(4) * f).normalized();
    if (iteration > 3 && d.head<3>().norm() < 1e-7) break;
  }
  pair.turn = so3_log(q.conjugate());
  pair.p_CaCb = q.conjugate() * p;
  pair.rms_px = sigma * camera.focal_px();
  pair.covariance.setZero();
  pair.covariance.topLeftCorner<3, 3>() = sigma * sigma * step.H.inverse().topLeftCorner<3, 3>();
  return pair.rms_px < kMost_px && pair.turn.allFinite();
}

}  // namespace fbvins
