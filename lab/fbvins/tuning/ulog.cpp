// SPDX-License-Identifier: Apache-2.0
#include "fbvins/tuning/ulog.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>

#include "fbvins/io/file_source.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargest_bytes = 2ULL << 30;
constexpr std::size_t kHead_bytes = 16, kMessageHead_bytes = 3, kLargestMessage_bytes = 65535;
constexpr std::string_view kMagic = "ULog\x01\x12\x35";
constexpr std::string_view kStampField = "timestamp";

/// 'u' and 'i': integers, 'f': floating point, 'x': not read.
struct Type {
  std::string_view name;
  char kind;
  std::size_t size;
};
constexpr std::array<Type, 12> kTypes{{{"int8_t", 'i', 1},
                                       {"uint8_t", 'u', 1},
                                       {"int16_t", 'i', 2},
                                       {"uint16_t", 'u', 2},
                                       {"int32_t", 'i', 4},
                                       {"uint32_t", 'u', 4},
                                       {"int64_t", 'i', 8},
                                       {"uint64_t", 'u', 8},
                                       {"float", 'f', 4},
                                       {"double", 'f', 8},
                                       {"bool", 'u', 1},
                                       {"char", 'x', 1}}};

template <class T>
double number_as(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value);
}

double number_at(const char* at, char kind, std::size_t size) {
  if (kind == 'f') return size == 4 ? number_as<float>(at) : number_as<double>(at);
  if (kind == 'i')
    return size == 1   ? number_as<std::int8_t>(at)
           : size == 2 ? number_as<std::int16_t>(at)
           : size == 4 ? number_as<std::int32_t>(at)
                       : number_as<std::int64_t>(at);
  return size == 1   ? number_as<std::uint8_t>(at)
         : size == 2 ? number_as<std::uint16_t>(at)
         : size == 4 ? number_as<std::uint32_t>(at)
                     : number_as<std::uint64_t>(at);
}

std::uint16_t word_at(std::string_view bytes, std::size_t at) {
  return static_cast<std::uint16_t>(static_cast<unsigned char>(bytes[at]) | static_cast<unsigned char>(bytes[at + 1]) << 8);
}

Error broken(const std::string& what) { return {ErrorCode::invalid_argument, what}; }

}  // namespace

Result<Ulog> Ulog::read(const std::string& path) {
  const Result<std::string> bytes = read_file(path, kLargest_bytes);
  if (!bytes) return bytes.error();
  return parse(*bytes, path);
}

Result<Ulog> Ulog::parse(std::string_view bytes, const std::string& source) {
  if (bytes.size() < kHead_bytes || bytes.substr(0, kMagic.size()) != kMagic)
    return broken(fmt::format("{}: this is not a PX4 log (.ulg)", source));
  Ulog log;
  for (std::size_t at = kHead_bytes; at + kMessageHead_bytes <= bytes.size();) {
    const std::size_t size = word_at(bytes, at);
    if (at + kMessageHead_bytes + size > bytes.size()) break;  // truncated, by a power cut for example
    if (Result<void> done = log.take(bytes[at + 2], bytes.substr(at + kMessageHead_bytes, size)); !done)
      return broken(fmt::format("{}: {} at byte {}", source, done.error().message, at));
    at += kMessageHead_bytes + size;
  }
  if (log.topics_.empty()) return broken(fmt::format("{}: a log without topics", source));
  return log;
}

Result<void> Ulog::take(char type, std::string_view body) {
  if (type == 'F') return take_format(body);
  if (type == 'P') take_parameter(body);
  if (type == 'A' && body.size() > 3 && body[0] == 0) {
    const std::string topic(body.substr(3));
    subscriptions_[word_at(body, 1)] = topic;
    topics_[topic].format = topic;
  }
  if (type == 'D' && body.size() > 2) {
    const auto found = subscriptions_.find(word_at(body, 0));
    if (found != subscriptions_.end()) topics_[found->second].messages.emplace_back(body.substr(2));
  }
  return {};
}

/// "name:type field;type[count] field;..."
Result<void> Ulog::take_format(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) return broken("a format without a name");
  Format& format = formats_[std::string(text.substr(0, colon))];
  format = {};
  for (std::string_view rest = text.substr(colon + 1); !rest.empty();) {
    const std::string_view one = rest.substr(0, rest.find(';'));
    rest.remove_prefix(std::min(rest.size(), one.size() + 1));
    const std::size_t space = one.find(' ');
    if (space == std::string_view::npos) return broken("a field without a name");
    std::string_view type = one.substr(0, space);
    const std::string name(one.substr(space + 1));
    int count = 0;
    if (const std::size_t bracket = type.find('['); bracket != std::string_view::npos) {
      const auto [end, error] = std::from_chars(type.data() + bracket + 1, type.data() + type.size(), count);
      if (error != std::errc() || count < 1 || count > 65535) return broken(fmt::format("'{}' is no array", std::string(type)));
      type = type.substr(0, bracket);
    }
    const auto* known = std::find_if(kTypes.begin(), kTypes.end(), [&](const Type& t) { return t.name == type; });
    if (known != kTypes.end() && format.size + known->size * static_cast<std::size_t>(std::max(1, count)) > kLargestMessage_bytes)
      return broken(fmt::format("'{}' is larger than a message can be", name.substr(0, 40)));
    // Nested formats are not supported: this field and those after it are not read.
    if (known == kTypes.end()) return {};
    for (int i = 0; i < std::max(1, count); ++i) {
      if (known->kind != 'x')
        format.fields[count > 0 ? fmt::format("{}[{}]", name, i) : name] = {format.size, known->kind, known->size};
      format.size += known->size;
    }
  }
  return {};
}

/// One byte with the length of the key, the key "type name", and the value.
void Ulog::take_parameter(std::string_view body) {
  if (body.empty()) return;
  const auto length = static_cast<std::size_t>(static_cast<unsigned char>(body[0]));
  if (body.size() < 1 + length + 4) return;
  const std::string_view key = body.substr(1, length);
  const std::size_t space = key.find(' ');
  if (space == std::string_view::npos) return;
  const char* value = body.data() + 1 + length;
  const bool whole = key.substr(0, space) == "int32_t";
  parameters_.try_emplace(std::string(key.substr(space + 1)), number_at(value, whole ? 'i' : 'f', 4));
}

std::vector<double> Ulog::numbers(const std::string& topic, const std::string& field) const {
  const auto found = topics_.find(topic);
  if (found == topics_.end()) return {};
  const auto format = formats_.find(found->second.format);
  if (format == formats_.end() || !format->second.fields.contains(field)) return {};
  const Field& where = format->second.fields.at(field);
  std::vector<double> values;
  for (const std::string& message : found->second.messages)
    if (message.size() >= where.offset + where.size)
      values.push_back(number_at(message.data() + where.offset, where.kind, where.size));
  return values;
}

std::vector<double> Ulog::seconds(const std::string& topic) const {
  std::vector<double> t = numbers(topic, std::string(kStampField));
  for (double& x : t) x *= 1e-6;
  return t;
}

std::optional<double> Ulog::parameter(const std::string& name) const {
  const auto found = parameters_.find(name);
  return found == parameters_.end() ? std::nullopt : std::optional<double>(found->second);
}

}  // namespace fbvins
