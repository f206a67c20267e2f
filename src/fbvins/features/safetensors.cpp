// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/safetensors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>

namespace fbvins {
namespace {

constexpr std::uint64_t kLargestHeader = 1u << 20;
constexpr std::int64_t kLargestNumber = std::int64_t{1} << 40;

Error damaged(std::string sentence) { return {ErrorCode::malformed, std::move(sentence)}; }

/// The JSON that safetensors headers are made of: objects, strings and lists of whole numbers.
class HeaderReader {
 public:
  explicit HeaderReader(std::string_view text) : text_(text) {}

  /// Skips spaces; true and past it if the next character is `c`.
  bool take(char c) {
    skip_spaces();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  bool at_end() {
    skip_spaces();
    return at_ == text_.size();
  }

  std::optional<std::string> string() {
    if (!take('"')) return std::nullopt;
    std::string out;
    for (; at_ < text_.size() && text_[at_] != '"'; ++at_) {
      if (static_cast<unsigned char>(text_[at_]) < 0x20) return std::nullopt;
      if (text_[at_] == '\\' && (++at_ == text_.size() || (text_[at_] != '"' && text_[at_] != '\\' && text_[at_] != '/')))
        return std::nullopt;
      out += text_[at_];
    }
    if (at_ == text_.size()) return std::nullopt;
    ++at_;
    return out;
  }

  std::optional<std::vector<std::int64_t>> numbers() {
    std::vector<std::int64_t> out;
    if (!take('[')) return std::nullopt;
    if (take(']')) return out;
    do {
      skip_spaces();
      std::int64_t value = 0;
      const std::size_t first = at_;
      for (; at_ < text_.size() && text_[at_] >= '0' && text_[at_] <= '9'; ++at_)
        if (value = 10 * value + (text_[at_] - '0'); value > kLargestNumber) return std::nullopt;
      if (at_ == first) return std::nullopt;
      out.push_back(value);
    } while (take(','));
    if (!take(']')) return std::nullopt;
    return out;
  }

  std::size_t at() const { return at_; }

 private:
  void skip_spaces() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\n' || text_[at_] == '\r' || text_[at_] == '\t')) ++at_;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

struct Entry {
  std::string type;
  std::vector<std::int64_t> shape, place;
};

std::optional<std::map<std::string, std::string>> read_metadata(HeaderReader& header) {
  std::map<std::string, std::string> out;
  if (!header.take('{')) return std::nullopt;
  if (header.take('}')) return out;
  do {
    auto key = header.string();
    if (!key || !header.take(':')) return std::nullopt;
    auto value = header.string();
    if (!value) return std::nullopt;
    out[*key] = *value;
  } while (header.take(','));
  if (!header.take('}')) return std::nullopt;
  return out;
}

std::optional<Entry> read_entry(HeaderReader& header) {
  Entry entry;
  if (!header.take('{')) return std::nullopt;
  do {
    const auto key = header.string();
    if (!key || !header.take(':')) return std::nullopt;
    if (*key == "dtype") {
      const auto type = header.string();
      if (!type) return std::nullopt;
      entry.type = *type;
    } else if (*key == "shape" || *key == "data_offsets") {
      const auto numbers = header.numbers();
      if (!numbers) return std::nullopt;
      (*key == "shape" ? entry.shape : entry.place) = *numbers;
    } else {
      return std::nullopt;
    }
  } while (header.take(','));
  if (!header.take('}')) return std::nullopt;
  return entry;
}

Result<Tensor> read_tensor(const std::string& name, const Entry& entry, std::string_view data) {
  const bool half = entry.type == "F16";
  if (!half && entry.type != "F32")
    return Error{ErrorCode::unsupported, fmt::format("tensor \"{}\" has type \"{}\", not F32 or F16", name, entry.type)};
  if (entry.shape.empty() || entry.shape.size() > 2)
    return damaged(fmt::format("tensor \"{}\" has {} dimensions, not 1 or 2", name, entry.shape.size()));
  std::int64_t count = 1;
  for (const std::int64_t side : entry.shape) {
    if (side < 1 || side > (1 << 20)) return damaged(fmt::format("tensor \"{}\" has a side of {}", name, side));
    count *= side;
  }
  const std::int64_t bytes = count * (half ? 2 : 4);
  if (entry.place.size() != 2 || entry.place[1] - entry.place[0] != bytes)
    return damaged(fmt::format("data_offsets of tensor \"{}\" do not span the {} bytes of its shape", name, bytes));
  if (entry.place[1] > static_cast<std::int64_t>(data.size()))
    return damaged(fmt::format("tensor \"{}\" ends at byte {} of {}: the file is cut off", name, entry.place[1], data.size()));
  Tensor out;
  for (const std::int64_t side : entry.shape) out.shape.push_back(static_cast<int>(side));
  out.values.resize(static_cast<std::size_t>(count));
  const char* from = data.data() + entry.place[0];
  for (std::size_t i = 0; i < out.values.size(); ++i) {
    if (half) {
      std::uint16_t value;
      std::memcpy(&value, from + 2 * i, 2);
      out.values[i] = half_to_float(value);
    } else {
      std::memcpy(&out.values[i], from + 4 * i, 4);
    }
    if (!std::isfinite(out.values[i])) return damaged(fmt::format("tensor \"{}\" holds a number that is not finite", name));
  }
  return out;
}

}  // namespace

float half_to_float(std::uint16_t half) {
  const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000u) << 16, exponent = (half >> 10) & 31u,
                      fraction = half & 1023u;
  if (exponent == 31) return std::bit_cast<float>(sign | 0x7f800000u | fraction << 13);
  if (exponent != 0) return std::bit_cast<float>(sign | (exponent + 112) << 23 | fraction << 13);
  const float small = static_cast<float>(fraction) * 0x1p-24f;
  return sign != 0 ? -small : small;
}

Result<SafeTensors> parse_safetensors(std::string_view bytes) {
  static_assert(std::endian::native == std::endian::little, "weights are stored little-endian");
  std::uint64_t length = 0;
  if (bytes.size() < sizeof(length)) return damaged("the file is too short for a header");
  std::memcpy(&length, bytes.data(), sizeof(length));
  if (length > kLargestHeader || length > bytes.size() - sizeof(length))
    return damaged(fmt::format("the header is said to have {} bytes, the file has {}", length, bytes.size()));
  HeaderReader header(bytes.substr(sizeof(length), length));
  const std::string_view data = bytes.substr(sizeof(length) + length);
  SafeTensors out;
  const auto bad_header = [&] { return damaged(fmt::format("the header is not valid near byte {}", header.at())); };
  if (!header.take('{')) return bad_header();
  do {
    const auto name = header.string();
    if (!name || !header.take(':')) return bad_header();
    if (*name == "__metadata__") {
      auto metadata = read_metadata(header);
      if (!metadata) return bad_header();
      out.metadata = std::move(*metadata);
      continue;
    }
    const auto entry = read_entry(header);
    if (!entry) return bad_header();
    Result<Tensor> tensor = read_tensor(*name, *entry, data);
    if (!tensor) return tensor.error();
    if (!out.tensors.emplace(*name, std::move(*tensor)).second) return damaged(fmt::format("tensor \"{}\" appears twice", *name));
  } while (header.take(','));
  if (!header.take('}') || !header.at_end()) return bad_header();
  return out;
}

Result<SafeTensors> read_safetensors(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return Error{ErrorCode::not_found, path + ": cannot be opened"};
  const std::streamoff size = file.tellg();
  if (size < 0 || static_cast<std::uint64_t>(size) > kLargestWeightsFile)
    return Error{ErrorCode::unreadable, fmt::format("{}: {} bytes are no weights", path, size)};
  std::string bytes(static_cast<std::size_t>(size), '\0');
  file.seekg(0);
  if (!file.read(bytes.data(), size)) return Error{ErrorCode::unreadable, path + ": cannot be read"};
  Result<SafeTensors> out = parse_safetensors(bytes);
  if (!out) return Error{out.error().code, path + ": " + out.error().message};
  return out;
}

}  // namespace fbvins
