// SPDX-License-Identifier: Apache-2.0
// Converts a message's fields to little-endian bytes and back, by the message's wire().
#pragma once

#include <array>
#include <bit>
#include <concepts>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace fbvins {

/// The bits of a field as an unsigned integer of its size.
template <class T>
auto wire_bits(T value) {
  if constexpr (std::is_same_v<T, float>) {
    return std::bit_cast<std::uint32_t>(value);
  } else if constexpr (std::is_enum_v<T>) {
    return static_cast<std::make_unsigned_t<std::underlying_type_t<T>>>(value);
  } else {
    return static_cast<std::make_unsigned_t<T>>(value);
  }
}

class PayloadWriter {
 public:
  template <class T>
  void operator()(T value) {
    auto bits = wire_bits(value);
    for (std::size_t i = 0; i < sizeof(bits); ++i) bytes_.push_back(static_cast<std::uint8_t>(bits >> (8 * i)));
  }
  template <class T, std::size_t N>
  void operator()(const std::array<T, N>& values) {
    for (const T value : values) (*this)(value);
  }
  std::vector<std::uint8_t>& bytes() { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// Fields beyond the end read as zero: the sender left zeros out, or its version does not have the field.
class PayloadReader {
 public:
  explicit PayloadReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <class T>
  void operator()(T& value) {
    using Bits = decltype(wire_bits(value));
    Bits bits = 0;
    for (std::size_t i = 0; i < sizeof(bits); ++i) bits = static_cast<Bits>(bits | static_cast<Bits>(Bits{next()} << (8 * i)));
    if constexpr (std::is_same_v<T, float>) {
      value = std::bit_cast<float>(bits);
    } else {
      value = static_cast<T>(bits);
    }
  }
  template <class T, std::size_t N>
  void operator()(std::array<T, N>& values) {
    for (T& value : values) (*this)(value);
  }

 private:
  std::uint8_t next() { return at_ < bytes_.size() ? bytes_[at_++] : std::uint8_t{0}; }
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

}  // namespace fbvins
