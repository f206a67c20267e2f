// SPDX-License-Identifier: Apache-2.0
// Access control: where the server listens, and which requests it answers. Pure functions, any thread.
//
// A foreign page in a browser on this machine can send requests here. `Host` and `Origin` tell them from our page's: a foreign
// name that resolves to this machine (DNS rebinding) is in `Host`, and the page that sends the request is in `Origin`.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "fbvins/core/result.hpp"

namespace fbvins {

struct WebAddress {
  std::string host = "127.0.0.1";  ///< an IP address
  std::uint16_t port = 0;          ///< 0: any free one

  bool loopback() const;
};

/// Of the page for a browser, with the token; `port`: where the server listens.
std::string page_url(const WebAddress& address, std::uint16_t port, const std::string& token);

/// [ADDRESS:]PORT, an IPv6 address in brackets; without an address this machine alone.
Result<WebAddress> parse_web_address(const std::string& text);

/// Whether `Host` is an IP address, localhost, or `machine` with or without .local. Any other name may have been made to resolve
/// to this machine by its owner.
bool host_allowed(std::string_view host_header, std::string_view machine);
/// Whether the requesting page was served by the requested host. Requests without `Origin` are not a foreign page's.
bool origin_allowed(std::string_view origin_header, std::string_view host_header);
/// In constant time, whatever part of it is right.
bool token_equal(std::string_view given, std::string_view token);
/// The value of `token` in a request's target, "/stream?token=...".
std::string_view token_of(std::string_view target);
/// At least eight letters, digits, - and _, as it is part of a URL.
bool token_usable(std::string_view token);
/// 128 bits of the system's randomness, as text.
Result<std::string> make_token();

}  // namespace fbvins
