// SPDX-License-Identifier: Apache-2.0
// Who may look: where the server listens, and which requests it answers. Pure functions, any thread.
//
// A browser on this machine will send requests here for any page that it shows. Two things tell such a page from ours: a name
// that somebody's DNS made point here is in `Host`, and the page that asks is in `Origin`.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "fbvins/core/result.hpp"

namespace fbvins {

struct WebAddress {
  std::string host = "127.0.0.1";  ///< an IP address
  std::uint16_t port = 0;          ///< 0: any that is free

  bool loopback() const;
};

/// [ADDRESS:]PORT, an IPv6 address in brackets; without an address this machine alone.
Result<WebAddress> parse_web_address(const std::string& text);

/// Is `Host` an IP address, localhost, or `machine` with or without .local? Any other name may be made to point here by whoever
/// owns it.
bool host_allowed(std::string_view host_header, std::string_view machine);
/// Does the page that asks come from the very host that is asked? Without `Origin` no browser asks.
bool origin_allowed(std::string_view origin_header, std::string_view host_header);
/// In a time that does not tell how much of it is right.
bool token_equal(std::string_view given, std::string_view token);
/// The value of `token` in a request's target, "/stream?token=...".
std::string_view token_of(std::string_view target);
/// Letters, digits, - and _, eight at least: it stands in an address.
bool token_usable(std::string_view token);
/// 128 bits of the system's randomness, as text.
Result<std::string> make_token();

}  // namespace fbvins
