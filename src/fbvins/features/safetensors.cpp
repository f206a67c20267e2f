// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/safetensors.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

namespace fbvins {
namespace {

constexpr std::uint64_t kLargestHeader = 1u << 20;
constexpr std::uint64_t kLargestNumber = std::uint64_t{1} << 40;
constexpr int kDeepest = 3;  ///< a number in a list of an entry of the header
using Json = nlohmann::json;

Error damaged(std::string sentence) { return {ErrorCode::malformed, std::move(sentence)}; }

/// Refuses what JSON leaves open: a name given twice, and nesting without end, which is costly to hold.
Result<Json> parse_header(std::string_view text) {
  std::vector<std::set<std::string>> open_objects;  ///< the names in each
  std::optional<std::string> twice;
  bool too_deep = false;
  const auto watch = [&](int depth, Json::parse_event_t event, Json& parsed) {
    too_deep = too_deep || depth > kDeepest;
    if (too_deep) return false;  // nothing below is kept
    if (event == Json::parse_event_t::object_start) open_objects.emplace_back();
    else if (event == Json::parse_event_t::object_end) open_objects.pop_back();
    else if (event == Json::parse_event_t::key && !open_objects.back().insert(parsed.get<std::string>()).second && !twice)
      twice = parsed.get<std::string>();
    return true;
  };
  try {
    Json header = Json::parse(text.begin(), text.end(), watch);
    if (too_deep) return damaged("the header is nested too deeply");
    if (twice) return damaged(fmt::format("\"{}\" appears twice in the header", *twice));
    if (!header.is_object() || header.empty()) return damaged("the header names no tensors");
    return header;
  } catch (const Json::parse_error& e) {
    return damaged(fmt::format("the header is not valid near byte {}", e.byte));
  } catch (const Json::exception&) {
    return damaged("the header is not valid");
  }
}

struct Entry {
  std::string type;
  std::vector<std::int64_t> shape, place;
};

std::optional<std::vector<std::int64_t>> whole_numbers(const Json& list) {
  if (!list.is_array()) return std::nullopt;
  std::vector<std::int64_t> out;
  for (const Json& value : list) {
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > kLargestNumber) return std::nullopt;
    out.push_back(value.get<std::int64_t>());
  }
  return out;
}

std::optional<std::map<std::string, std::string>> read_metadata(const Json& json) {
  if (!json.is_object()) return std::nullopt;
  std::map<std::string, std::string> out;
  for (const auto& [key, value] : json.items()) {
    if (!value.is_string()) return std::nullopt;
    out[key] = value.get<std::string>();
  }
  return out;
}

std::optional<Entry> read_entry(const Json& json) {
  if (!json.is_object()) return std::nullopt;
  Entry entry;
  for (const auto& [key, value] : json.items()) {
    if (key == "dtype") {
      if (!value.is_string()) return std::nullopt;
      entry.type = value.get<std::string>();
    } else if (key == "shape" || key == "data_offsets") {
      const auto numbers = whole_numbers(value);
      if (!numbers) return std::nullopt;
      (key == "shape" ? entry.shape : entry.place) = *numbers;
    } else {
      return std::nullopt;
    }
  }
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
    return damaged(fmt::format("the header is {} bytes long by its length field, the file has {}", length, bytes.size()));
  const Result<Json> header = parse_header(bytes.substr(sizeof(length), length));
  if (!header) return header.error();
  const std::string_view data = bytes.substr(sizeof(length) + length);
  const auto bad_entry = [](const std::string& name) { return damaged(fmt::format("\"{}\" is not valid in the header", name)); };
  SafeTensors out;
  for (const auto& [name, json] : header->items()) {
    if (name == "__metadata__") {
      auto metadata = read_metadata(json);
      if (!metadata) return bad_entry(name);
      out.metadata = std::move(*metadata);
      continue;
    }
    const auto entry = read_entry(json);
    if (!entry) return bad_entry(name);
    Result<Tensor> tensor = read_tensor(name, *entry, data);
    if (!tensor) return tensor.error();
    out.tensors.emplace(name, std::move(*tensor));
  }
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
