// SPDX-License-Identifier: Apache-2.0
// The MAVLink messages by which a flight controller's parameters are read. Fields and names are those of the protocol's common
// set, as in messages.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <string_view>

namespace fbvins {

/// A name of up to 16 characters, ending with a zero where it is shorter.
using ParameterName = std::array<char, 16>;

inline ParameterName parameter_name(std::string_view text) {
  ParameterName out{};
  std::copy_n(text.begin(), std::min(text.size(), out.size()), out.begin());
  return out;
}
inline std::string text_of(const ParameterName& name) { return {name.begin(), std::find(name.begin(), name.end(), '\0')}; }

/// PARAM_REQUEST_READ, by name.
struct ParameterRequestMessage {
  static constexpr std::uint32_t kId = 20;
  static constexpr std::uint8_t kCrcExtra = 214;

  std::int16_t param_index = -1;  ///< -1: by its name
  std::uint8_t target_system = 1, target_component = 1;
  ParameterName param_id{};

  template <class V>
  void wire(V&& v) {
    v(param_index), v(target_system), v(target_component), v(param_id);
  }
};

/// PARAM_VALUE.
struct ParameterValueMessage {
  static constexpr std::uint32_t kId = 22;
  static constexpr std::uint8_t kCrcExtra = 220;
  static constexpr std::uint8_t kInt32 = 6, kReal32 = 9;  ///< MAV_PARAM_TYPE

  float param_value = 0;
  std::uint16_t param_count = 0, param_index = 0;
  ParameterName param_id{};
  std::uint8_t param_type = kReal32;

  /// PX4 puts the bytes of a whole number into the float.
  double value() const {
    return param_type == kInt32 ? static_cast<double>(std::bit_cast<std::int32_t>(param_value))
                                : static_cast<double>(param_value);
  }

  template <class V>
  void wire(V&& v) {
    v(param_value), v(param_count), v(param_index), v(param_id), v(param_type);
  }
};

}  // namespace fbvins
