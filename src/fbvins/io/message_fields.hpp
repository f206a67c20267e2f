// SPDX-License-Identifier: Apache-2.0
// Private: the fields of a message one after the other, in ROS 1's encoding (packed) or in CDR of either byte order, as ROS 2 has
// it. Messages that both have in common are read by one function. After the first incomplete field all are zero or empty.
//
//   MessageFields in(bytes, Encoding::ros1);
//   const Time t = in.header();
//   if (!in.ok()) ...
#pragma once

#include <algorithm>
#include <cstdint>
#include <string_view>

#include "fbvins/core/time.hpp"
#include "fbvins/geometry/so3.hpp"
#include "fbvins/io/little_endian.hpp"

namespace fbvins {

enum class Encoding { ros1, cdr };

class MessageFields {
 public:
  MessageFields(std::string_view bytes, Encoding encoding) : in_(bytes), cdr_(encoding == Encoding::cdr) {
    if (!cdr_) return;
    const std::string_view kind = in_.take(kCdrHead_bytes);  // plain
    ok_ = kind.size() == kCdrHead_bytes && kind[0] == 0 && (kind[1] == 0 || kind[1] == 1);
    swaps_ = ok_ && kind[1] == 0;
  }

  bool ok() const { return ok_ && in_.ok(); }

  template <class Number>
  Number get() {
    if (cdr_) {
      const std::size_t behind = (in_.position() - kCdrHead_bytes) % sizeof(Number);
      if (behind != 0) in_.skip(sizeof(Number) - behind);
    }
    Number value = in_.get<Number>();
    if (swaps_) {
      auto* bytes = reinterpret_cast<unsigned char*>(&value);
      std::reverse(bytes, bytes + sizeof value);
    }
    return value;
  }
  std::string_view text() {
    const std::string_view out = bytes();
    return cdr_ && !out.empty() ? out.substr(0, out.size() - 1) : out;  // without the zero at its end
  }
  std::string_view bytes() { return in_.take(get<std::uint32_t>()); }
  Vec3 vector() {
    const double x = get<double>(), y = get<double>(), z = get<double>();
    return {x, y, z};
  }
  /// As sent.
  Quat quaternion() {
    const Vec3 xyz = vector();
    const double w = get<double>();
    return {w, xyz.x(), xyz.y(), xyz.z()};
  }
  void skip_doubles(int count) {
    for (int i = 0; i < count; ++i) get<double>();
  }
  /// A std_msgs/Header: its stamp.
  Time header() {
    if (!cdr_) get<std::uint32_t>();  // sequence
    const std::int64_t seconds = cdr_ ? std::int64_t{get<std::int32_t>()} : std::int64_t{get<std::uint32_t>()};
    const auto nanoseconds = get<std::uint32_t>();
    frame_ = text();
    if (seconds < 0 || nanoseconds >= kSecond_ns) ok_ = false;
    return {seconds * kSecond_ns + nanoseconds};
  }
  /// Of the last header.
  std::string_view frame() const { return frame_; }

 private:
  static constexpr std::size_t kCdrHead_bytes = 4;
  static constexpr std::int64_t kSecond_ns = 1'000'000'000;

  ByteCursor in_;
  std::string_view frame_;
  bool cdr_, ok_ = true, swaps_ = false;  ///< big-endian
};

}  // namespace fbvins
