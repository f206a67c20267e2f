// SPDX-License-Identifier: Apache-2.0
// Private: the server's answers to requests. Pure, without a socket; any thread.
#pragma once

#include <string_view>

#include "fbvins/web/web_server.hpp"

namespace fbvins {

/// The parts of a request that matter. Views into its bytes.
struct WebRequest {
  std::string_view host = {}, origin = {};  ///< the headers; empty where they are missing
  std::string_view target = {};             ///< path and query
  bool reads = false;                       ///< GET or HEAD
  bool upgrades = false;                    ///< to a WebSocket
};

struct WebAnswer {
  int status = 200;  ///< of HTTP; 101: the stream of messages
  std::string_view bytes = {};
  std::string_view type = "text/plain; charset=utf-8";  ///< MIME
  bool gzip = false;
};

/// `machine`: this machine's own name; `viewers`: how many there are. The answer's bytes are those of `files`, or constants.
WebAnswer answer_to(const WebRequest& request, const WebOptions& options, const PageFiles& files, std::string_view machine,
                    std::size_t viewers);

}  // namespace fbvins
