// SPDX-License-Identifier: Apache-2.0
// MAVLink frames to and from text, for a comparison with another implementation, one line each from the standard input:
//   encode NUMBER SYSTEM COMPONENT SEQUENCE VALUE...   prints the frame in hexadecimal; values in the order of the wire
//   decode HEXADECIMAL                                 prints NUMBER SYSTEM COMPONENT SEQUENCE VALUE... for each frame, then "."
//   key HEXADECIMAL TIME                               from here on frames are signed, the first at TIME, and must be signed
#include <fmt/format.h>

#include <iostream>
#include <optional>
#include <sstream>
#include <string>

#include "fbvins/mavlink/wire.hpp"

namespace fbvins {
namespace {

struct TextReader {
  std::istream& in;
  template <class T>
  void operator()(T& value) {
    std::string text;
    in >> text;
    if constexpr (std::is_same_v<T, float>) {
      value = std::stof(text);
    } else if constexpr (std::is_unsigned_v<T>) {
      value = static_cast<T>(std::stoull(text));
    } else {
      value = static_cast<T>(std::stoll(text));
    }
  }
  template <class T, std::size_t N>
  void operator()(std::array<T, N>& values) {
    for (T& value : values) (*this)(value);
  }
};

struct TextWriter {
  std::string text;
  template <class T>
  void operator()(T value) {
    if constexpr (std::is_same_v<T, float>) {
      text += fmt::format(" {:.9g}", value);
    } else {
      text += fmt::format(" {}", static_cast<std::conditional_t<std::is_unsigned_v<T>, std::uint64_t, std::int64_t>>(value));
    }
  }
  template <class T, std::size_t N>
  void operator()(const std::array<T, N>& values) {
    for (const T value : values) (*this)(value);
  }
};

template <std::size_t I = 0>
MavlinkMessage read_message(std::uint32_t id, std::istream& in) {
  if constexpr (I < std::variant_size_v<MavlinkMessage>) {
    std::variant_alternative_t<I, MavlinkMessage> message;
    if (message.kId != id) return read_message<I + 1>(id, in);
    message.wire(TextReader{in});
    return message;
  }
  throw std::invalid_argument(fmt::format("message {} is not known", id));
}

std::vector<std::uint8_t> read_bytes(const std::string& text) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  return bytes;
}

/// One for each direction, as two programs would have.
struct Signers {
  std::optional<MavlinkSigner> out, in;
};

int set_key(std::istream& in, Signers& signers) {
  std::string text;
  std::uint64_t time = 0;
  in >> text >> time;
  const auto key = parse_mavlink_key(text);
  if (!key) return fmt::print("{}\n", key.error().message), 77;
  signers.out.emplace(*key, time - 1), signers.in.emplace(*key, time - 1);
  return fmt::print("signed\n"), 0;
}

void encode(std::istream& in, Signers& signers) {
  int id = 0, system = 0, component = 0, sequence = 0;
  in >> id >> system >> component >> sequence;
  const MavlinkAddress from{static_cast<std::uint8_t>(system), static_cast<std::uint8_t>(component)};
  const MavlinkMessage message = read_message(static_cast<std::uint32_t>(id), in);
  MavlinkSigner* signer = signers.out ? &*signers.out : nullptr;
  for (const std::uint8_t byte : encode_mavlink(message, from, static_cast<std::uint8_t>(sequence), signer))
    fmt::print("{:02x}", byte);
  fmt::print("\n");
}

void decode(std::istream& in, Signers& signers) {
  std::string text;
  in >> text;
  for (const MavlinkFrame& frame : MavlinkDecoder(signers.in ? &*signers.in : nullptr).push(read_bytes(text))) {
    TextWriter writer;
    std::uint32_t id = 0;
    std::visit([&](auto message) { message.wire(writer), id = message.kId; }, frame.message);
    fmt::print("{} {} {} {}{}\n", id, frame.from.system, frame.from.component, frame.sequence, writer.text);
  }
  fmt::print(".\n");
}

}  // namespace
}  // namespace fbvins

int main() {
  fbvins::Signers signers;
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream in(line);
    std::string what;
    in >> what;
    if (what == "encode") fbvins::encode(in, signers);
    else if (what == "decode") fbvins::decode(in, signers);
    else if (const int code = fbvins::set_key(in, signers); code != 0) return code;
  }
}
