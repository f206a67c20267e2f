// SPDX-License-Identifier: Apache-2.0
// Private to io: numbers in binary files, least significant byte first. Pure functions and a value, any thread.
//
//   append_le(out, std::uint32_t{7});
//   ByteCursor in(bytes);
//   const auto length = in.get<std::uint32_t>();
//   if (!in.ok()) ...                            // the bytes ended before; what was got is zero or empty
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

namespace fbvins {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie in memory");

template <class Number>
void append_le(std::string& out, Number value) {
  static_assert(std::is_arithmetic_v<Number>);
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  out.append(bytes, sizeof value);
}

/// Over bytes that are already there.
template <class Number>
void overwrite_le(std::string& out, std::size_t at, Number value) {
  std::memcpy(out.data() + at, &value, sizeof value);
}

/// Reads from the front of bytes that it does not own. After the first incomplete value everything is zero or empty.
class ByteCursor {
 public:
  explicit ByteCursor(std::string_view bytes) : bytes_(bytes) {}

  bool ok() const { return ok_; }
  std::size_t position() const { return position_; }
  std::size_t left() const { return bytes_.size() - position_; }

  template <class Number>
  Number get() {
    static_assert(std::is_arithmetic_v<Number>);
    Number value{};
    if (const std::string_view raw = take(sizeof value); ok_) std::memcpy(&value, raw.data(), sizeof value);
    return value;
  }
  std::string_view take(std::uint64_t count) {
    if (!ok_ || count > left()) {
      ok_ = false;
      return {};
    }
    const std::string_view out = bytes_.substr(position_, count);
    position_ += count;
    return out;
  }
  void skip(std::uint64_t count) { take(count); }

 private:
  std::string_view bytes_;
  std::size_t position_ = 0;
  bool ok_ = true;
};

}  // namespace fbvins
