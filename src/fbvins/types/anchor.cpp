// SPDX-License-Identifier: Apache-2.0
#include "fbvins/types/anchor.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

namespace fbvins {
namespace {

template <class Mat>
bool is_covariance(const Mat& m) {
  return m.allFinite() && (m - m.transpose()).norm() <= 1e-9 * m.norm() && Eigen::LLT<Mat>(m).info() == Eigen::Success;
}

std::string fault(const PositionAnchor& a) {
  if (!a.p_A.allFinite() || !a.p_B.allFinite()) return "its position is not finite";
  return is_covariance(a.covariance) ? "" : "its covariance is not one";
}

std::string fault(const HeightAnchor& a) {
  if (!std::isfinite(a.z_A_m) || !a.p_B.allFinite()) return "its height is not finite";
  return std::isfinite(a.sigma_m) && a.sigma_m > 0 ? "" : "its standard deviation is not above 0";
}

std::string fault(const TagAnchor& a) {
  constexpr double kUnit = 1e-6;
  for (const auto& [q, p] : {std::pair(a.T_AT.q, a.has_place() ? a.T_AT.p : a.T_BT.p), std::pair(a.T_BT.q, a.T_BT.p)})
    if (!p.allFinite() || !(std::abs(q.squaredNorm() - 1) < kUnit)) return "a pose of it is none";
  return is_covariance(a.covariance) ? "" : "its covariance is not one";
}

}  // namespace

Time stamp_of(const Anchor& anchor) {
  return std::visit([](const auto& a) { return a.t; }, anchor);
}

std::string impossible(const Anchor& anchor) {
  const std::string why = std::visit([](const auto& a) { return fault(a); }, anchor);
  return why.empty() ? why : fmt::format("the anchor at {} ns is impossible: {}", stamp_of(anchor).ns, why);
}

}  // namespace fbvins
