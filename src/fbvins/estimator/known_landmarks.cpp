// SPDX-License-Identifier: Apache-2.0
#include "fbvins/estimator/known_landmarks.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace fbvins {
namespace {

/// The observations of a landmark before it was remembered count in the prior of the window and in its own (K4).
constexpr double kTimesCounted = 2;
/// Landmarks are remembered whose depth has at most this relative standard deviation.
constexpr double kMaxRelativeDepthSigma = 0.05;

}  // namespace

void KnownLandmarks::clear() {
  priors_.clear();
  order_.clear();
  uncertainties_.clear();
  first_uncertainty_ = 0;
  next_ = {};
  active_ = {};
  in_use_ = false;
  new_.clear();
}

void KnownLandmarks::remember(TrackId track, const Pose<G, C0>& T_GC, const Vec3& alpha_beta_rho, const Mat3& information) {
  if (priors_.contains(track)) return;
  const double depth = 1.0 / alpha_beta_rho.z();
  const Mat3 covariance = information.inverse();
  const double relative_sigma = depth * std::sqrt(covariance(2, 2));
  if (!(relative_sigma < kMaxRelativeDepthSigma)) return;  // nor NaN

  LandmarkPrior prior;
  const Vec3 p_C = depth * Vec3(alpha_beta_rho.x(), alpha_beta_rho.y(), 1);
  prior.p_G = T_GC * p_C;
  Mat3 J;  // of p_G by (alpha, beta, rho)
  J << depth * T_GC.R().leftCols<2>(), -depth * (T_GC.R() * p_C);
  Mat3 covariance_G = J * covariance * J.transpose();  // (K3)
  covariance_G.diagonal().array() += options_.position_sigma_m * options_.position_sigma_m;
  prior.sqrt_information = Mat3(covariance_G.inverse()).llt().matrixU();
  if (!prior.p_G.allFinite() || !prior.sqrt_information.allFinite()) return;

  if (uncertainties_.empty() || uncertainties_.back().p_G != next_.p_G) uncertainties_.push_back(next_);
  prior.map_uncertainty = first_uncertainty_ + static_cast<std::int64_t>(uncertainties_.size()) - 1;
  priors_.emplace(track, prior);
  order_.push_back(track);
  new_.push_back({track, prior.p_G});
  make_room();
}

void KnownLandmarks::make_room() {
  while (static_cast<int>(order_.size()) > options_.capacity) {
    priors_.erase(order_.front());
    order_.pop_front();
  }
  if (order_.empty()) return;
  for (const std::int64_t needed = priors_.at(order_.front()).map_uncertainty; first_uncertainty_ < needed; ++first_uncertainty_)
    uncertainties_.pop_front();
}

void KnownLandmarks::forget(TrackId track) {
  if (priors_.erase(track) > 0) std::erase(order_, track);
}

std::optional<LandmarkPrior> KnownLandmarks::find(TrackId track) const {
  const auto it = priors_.find(track);
  return it == priors_.end() ? std::nullopt : std::optional<LandmarkPrior>(it->second);
}

/// Covariance of the map at p: an error (dp, dtheta) at p_then is dp - [p - p_then]x dtheta at p (K5).
Mat6 KnownLandmarks::propagated(const MapUncertainty& then, const Vec3& p_G) {
  Mat6 T = Mat6::Identity();
  T.topRightCorner<3, 3>() = -hat(p_G - then.p_G);
  return T * then.covariance * T.transpose();
}

void KnownLandmarks::set_active_priors(const Vec3& p_G, std::span<const LandmarkPrior> in_use) {
  in_use_ = !in_use.empty();
  if (!in_use_ || uncertainties_.empty()) return;  // the last one's share is kept
  MapUncertainty mean{p_G, Mat6::Zero()};
  for (const LandmarkPrior& prior : in_use) {  // (K6)
    const std::int64_t i =
        std::max<std::int64_t>(prior.map_uncertainty - first_uncertainty_, 0);  // dropped since: the oldest kept
    mean.covariance += propagated(uncertainties_[static_cast<std::size_t>(i)], p_G) / static_cast<double>(in_use.size());
  }
  active_ = mean;
}

Mat6 KnownLandmarks::with_map_covariance(const Pose<G, B>& T_GB, const Mat6& window_covariance) const {
  Mat6 from_gauge = Mat6::Identity();
  from_gauge.bottomRightCorner<3, 3>() = T_GB.R().transpose();
  return (in_use_ ? kTimesCounted : 1.0) * window_covariance + from_gauge * propagated(active_, T_GB.p) * from_gauge.transpose();
}

void KnownLandmarks::set_host_uncertainty(const Pose<G, B>& T_GB, const Mat6& window_covariance) {
  Mat6 to_gauge = Mat6::Identity();
  to_gauge.bottomRightCorner<3, 3>() = T_GB.R();
  next_ = {T_GB.p, to_gauge * with_map_covariance(T_GB, window_covariance) * to_gauge.transpose()};
}

}  // namespace fbvins
