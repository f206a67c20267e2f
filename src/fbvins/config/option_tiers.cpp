// SPDX-License-Identifier: Apache-2.0
#include "fbvins/config/option_tiers.hpp"

#include <algorithm>
#include <array>

namespace fbvins {

std::span<const std::string_view> user_options() {
  using namespace std::string_view_literals;
  static constexpr std::array kPaths = {"frontend.kind"sv,
                                        "frontend.klt.max_features"sv,
                                        "frontend.orb.max_features"sv,
                                        "frontend.boost.booster.weights"sv,
                                        "estimator.keyframes.max_keyframes"sv,
                                        "estimator.known_landmarks.enabled"sv,
                                        "estimator.max_iterations"sv,
                                        "estimator.gravity_mps2"sv,
                                        "estimator.accel_noise_scale"sv,
                                        "estimator.estimate_extrinsics"sv,
                                        "estimator.estimate_time_offset"sv,
                                        "estimator.estimate_line_delay"sv,
                                        "estimator.max_blind_m"sv,
                                        "estimator.max_speed_mps"sv,
                                        "loop.max_keyframes"sv};
  return kPaths;
}

std::vector<OptionField> user_fields(const std::vector<OptionField>& all) {
  const auto chosen = user_options();
  std::vector<OptionField> fields;
  for (const OptionField& field : all) {
    const std::string inside = field.path + ".";
    const bool wanted = std::any_of(chosen.begin(), chosen.end(), [&](std::string_view path) {
      return path == field.path || (field.is_group() && path.starts_with(inside));
    });
    if (wanted) fields.push_back(field);
  }
  return fields;
}

}  // namespace fbvins
