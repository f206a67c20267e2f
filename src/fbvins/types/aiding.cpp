// SPDX-License-Identifier: Apache-2.0
#include "fbvins/types/aiding.hpp"

#include <cmath>

namespace fbvins {

Time& stamp_of(AidingSample& reading) {
  return std::visit([](auto& r) -> Time& { return r.t; }, reading);
}

Time stamp_of(const AidingSample& reading) {
  return std::visit([](const auto& r) { return r.t; }, reading);
}

std::string impossible(const VelocitySample& r) {
  if (!r.p_B.allFinite() || !r.q_BS.coeffs().allFinite()) return "a velocity's place or axes are not finite";
  if (std::abs(r.q_BS.norm() - 1) > 1e-3) return "a velocity's axes are not a rotation";
  if (!r.v_mps.allFinite()) return "a velocity is not finite";
  if (!(r.sigma_mps.minCoeff() > 0)) return "a velocity's standard deviation is not positive";
  return "";
}

std::string impossible(const PressureSample& r) {
  constexpr double kLeast_pa = 10'000, kMost_pa = 200'000;
  if (!(r.pressure_pa >= kLeast_pa && r.pressure_pa <= kMost_pa)) return "a pressure is not one of air, 10 to 200 kPa";
  if (!(r.sigma_pa > 0)) return "a pressure's standard deviation is not positive";
  return "";
}

std::string impossible(const AidingSample& reading) {
  return std::visit([](const auto& r) { return impossible(r); }, reading);
}

}  // namespace fbvins
