// SPDX-License-Identifier: Apache-2.0
// A small web server: a handful of files by HTTP, and one stream of messages to every viewer by WebSocket (docs/web.md).
//
//   auto server = WebServer::start({.address = {"127.0.0.1", 8080}}, files, {.greet = ..., .command = ...});
//   (*server)->send(std::make_shared<const WebMessage>(WebMessage{"{}"}));    // any thread; never waits
//
// One thread of its own. Every viewer has a bounded queue that drops its oldest messages; one that does not read for some seconds
// is dropped itself. When there are as many connections as may be, the one that has waited longest for a request or for
// its peer to read makes room for the next, so that slow ones keep nobody out. Nothing that a peer sends, or fails to read,
// delays a caller of send().
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/web/viewer_queue.hpp"
#include "fbvins/web/web_access.hpp"

namespace fbvins {

/// A file of the page, embedded in the program.
struct PageFile {
  std::string_view path;  ///< of the URL: "/main.js"
  std::string_view type;  ///< MIME
  std::string_view bytes;
  bool gzip = false;
};
using PageFiles = std::vector<PageFile>;

struct WebOptions {
  WebAddress address = {};
  std::string token = {};         ///< that every viewer must give; empty: none is needed
  std::size_t most_viewers = 32;  ///< further ones are refused
  std::size_t most_connections = 128;
  std::chrono::milliseconds header_patience{3'000};  ///< for a complete request, from the connection or the last answer
  std::chrono::milliseconds patience{10'000};        ///< for a peer to read what it gets
  /// Where the address is in use it is tried again after so long, for as long as the server lives; zero: an error.
  std::chrono::milliseconds try_again{0};
};

class WebServer {
 public:
  /// Both are called on the server's thread and must not block.
  struct Callbacks {
    std::function<std::vector<SharedMessage>()> greet = [] { return std::vector<SharedMessage>{}; };  ///< to a new viewer, first
    std::function<void(std::string_view)> command = [](std::string_view) {};                          ///< text of a viewer
  };

  /// An error where it cannot listen at the address, unless it is to try again.
  static Result<std::unique_ptr<WebServer>> start(const WebOptions& options, PageFiles files, Callbacks callbacks);
  ~WebServer();
  /// Closes all connections; afterwards no callback comes, and messages are dropped.
  void stop();

  void send(SharedMessage message);
  int viewers() const;
  /// Viewers that were dropped because they did not read.
  int dropped_viewers() const;
  /// Why it does not listen at its address; empty: it does. From any thread.
  std::string problem() const;
  /// Zero while it does not listen.
  std::uint16_t port() const;
  /// Waits until every viewer has received what was sent, for no longer than `patience`.
  void drain(std::chrono::milliseconds patience);

 private:
  class Impl;
  explicit WebServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace fbvins
