// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/web_access.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

namespace fbvins {
namespace {

bool is_ip(const std::string& host) {
  std::array<unsigned char, sizeof(in6_addr)> bytes{};
  return inet_pton(AF_INET, host.c_str(), bytes.data()) == 1 || inet_pton(AF_INET6, host.c_str(), bytes.data()) == 1;
}

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; });
  return out;
}

struct HostPort {
  std::string host;
  std::optional<std::string> port;
};

/// HOST[:PORT], [IPV6][:PORT]; nullopt for anything else.
std::optional<HostPort> split(std::string_view text) {
  HostPort out;
  if (text.starts_with('[')) {
    const auto end = text.find(']');
    if (end == std::string_view::npos) return std::nullopt;
    out.host = text.substr(1, end - 1);
    text.remove_prefix(end + 1);
  } else {
    const auto colon = std::min(text.find(':'), text.size());
    out.host = text.substr(0, colon);
    text.remove_prefix(colon);
  }
  if (text.empty()) return out;
  if (text.front() != ':') return std::nullopt;
  out.port = text.substr(1);
  return out;
}

bool is_port(std::string_view text, std::uint16_t& port) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

bool WebAddress::loopback() const { return host.starts_with("127.") || host == "::1"; }

std::string page_url(const WebAddress& address, std::uint16_t port, const std::string& token) {
  std::string host = address.host.find(':') == std::string::npos ? address.host : "[" + address.host + "]";
  if (host == "0.0.0.0" || host == "[::]") {
    std::array<char, 256> name{};
    host = gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "localhost";
  }
  // A browser does not send what follows the #: the token gets into no log.
  return fmt::format("http://{}:{}/{}{}", host, port == 0 ? address.port : port, token.empty() ? "" : "#token=", token);
}

Result<WebAddress> parse_web_address(const std::string& text) {
  const Error wrong{ErrorCode::invalid_argument,
                    fmt::format("--web {}: wanted is [ADDRESS:]PORT, such as 8080, 0.0.0.0:8080 or [::1]:8080", text)};
  WebAddress address;
  if (is_port(text, address.port)) return address;
  const auto parts = split(text);
  if (!parts || !parts->port || !is_port(*parts->port, address.port) || !is_ip(parts->host)) return wrong;
  address.host = parts->host;
  return address;
}

bool host_allowed(std::string_view host_header, std::string_view machine) {
  const auto parts = split(host_header);
  if (!parts) return false;
  std::string host = lower(parts->host);
  if (is_ip(host) || host == "localhost") return true;
  if (host.ends_with(".local")) host.resize(host.size() - 6);
  return !host.empty() && host == lower(machine);
}

bool origin_allowed(std::string_view origin_header, std::string_view host_header) {
  if (origin_header.empty()) return true;
  return lower(origin_header) == "http://" + lower(host_header);
}

bool token_equal(std::string_view given, std::string_view token) {
  unsigned difference = given.size() == token.size() ? 0 : 1;
  for (std::size_t i = 0; i < token.size(); ++i)
    difference |= static_cast<unsigned char>(token[i]) ^ static_cast<unsigned char>(given.empty() ? 0 : given[i % given.size()]);
  return difference == 0;
}

std::string_view token_of(std::string_view target) {
  constexpr std::string_view kKey = "token=";
  auto begin = target.find('?');
  while (begin != std::string_view::npos) {
    std::string_view rest = target.substr(begin + 1);
    if (rest.starts_with(kKey)) {
      rest.remove_prefix(kKey.size());
      return rest.substr(0, rest.find('&'));
    }
    begin = target.find('&', begin + 1);
  }
  return {};
}

bool token_usable(std::string_view token) {
  constexpr std::string_view kUsable = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  return token.size() >= 8 && token.find_first_not_of(kUsable) == std::string_view::npos;
}

Result<std::string> make_token() {
  std::array<unsigned char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    return Error{ErrorCode::stage_failed, "the system gave no random numbers for the page's token"};
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

}  // namespace fbvins
