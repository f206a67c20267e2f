// SPDX-License-Identifier: Apache-2.0
// Private to io: CDR, in which ROS 2 sends its messages (XCDR1, little-endian): numbers aligned to their size, counted from the
// end of the four-byte header. One thread a value.
//
//   CdrWriter cdr(bytes);
//   cdr.put(7.0);
//   cdr.text("imu");
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "fbvins/io/little_endian.hpp"

namespace fbvins {

class CdrWriter {
 public:
  /// Appends to `out`, which must outlive this.
  explicit CdrWriter(std::string& out) : out_(out) {
    out_.append("\0\1\0\0", 4);
    origin_ = out_.size();
  }

  template <class Number>
  void put(Number value) {
    const std::size_t behind = (out_.size() - origin_) % sizeof value;
    if (behind != 0) out_.append(sizeof value - behind, '\0');
    append_le(out_, value);
  }
  /// The number of elements of a sequence; the elements follow.
  void count(std::size_t elements) { put(static_cast<std::uint32_t>(elements)); }
  void text(std::string_view text) {
    count(text.size() + 1);
    out_.append(text);
    out_.push_back('\0');
  }
  /// An array of fixed length: no count.
  void array(std::span<const double> values) {
    for (const double value : values) put(value);
  }
  void raw(const void* bytes, std::size_t size) { out_.append(static_cast<const char*>(bytes), size); }

 private:
  std::string& out_;
  std::size_t origin_ = 0;
};

/// After the first incomplete value everything is zero or empty, and ok() is false.
class CdrReader {
 public:
  explicit CdrReader(std::string_view bytes) : in_(bytes) {
    const std::string_view kind = in_.take(4);
    known_ = kind.size() == 4 && kind[0] == 0 && kind[1] == 1;
  }

  bool ok() const { return known_ && in_.ok(); }
  /// From the start of the message.
  std::size_t position() const { return in_.position(); }

  template <class Number>
  Number get() {
    const std::size_t behind = (in_.position() - 4) % sizeof(Number);
    if (behind != 0) in_.skip(sizeof(Number) - behind);
    return in_.get<Number>();
  }
  std::string_view text() {
    const std::string_view out = in_.take(get<std::uint32_t>());
    return out.empty() ? out : out.substr(0, out.size() - 1);  // without the zero at its end
  }
  std::string_view bytes() { return in_.take(get<std::uint32_t>()); }

 private:
  ByteCursor in_;
  bool known_ = false;
};

}  // namespace fbvins
