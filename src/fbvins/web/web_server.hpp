// SPDX-License-Identifier: Apache-2.0
// A small web server: a handful of files by HTTP, and one stream of messages to every viewer by WebSocket (docs/web.md).
//
//   auto server = WebServer::start({.address = {"127.0.0.1", 8080}}, files, {.greet = ..., .command = ...});
//   (*server)->send(std::make_shared<const WebMessage>(WebMessage{"{}"}));    // any thread; never waits
//
// One thread of its own. Every viewer has a bounded queue that drops its oldest; one that takes nothing for some seconds is
// dropped itself. Nothing that a peer sends, or fails to read, is felt by whoever calls send().
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
  std::string_view path;  ///< as asked for: "/main.js"
  std::string_view type;  ///< MIME
  std::string_view bytes;
  bool gzip = false;
};
using PageFiles = std::vector<PageFile>;

struct WebOptions {
  WebAddress address = {};
  std::string token = {};         ///< asked of every viewer; empty: of none
  std::size_t most_viewers = 32;  ///< further ones are told to come later
  std::size_t most_connections = 128;
  std::chrono::milliseconds patience{10'000};  ///< for a request to come whole, and for a viewer to take what it is sent
};

class WebServer {
 public:
  /// Both on the server's thread, which they must not hold up.
  struct Callbacks {
    std::function<std::vector<SharedMessage>()> greet = [] { return std::vector<SharedMessage>{}; };  ///< to a new viewer, first
    std::function<void(std::string_view)> command = [](std::string_view) {};                          ///< text of a viewer
  };

  /// An error where the address cannot be listened at.
  static Result<std::unique_ptr<WebServer>> start(const WebOptions& options, PageFiles files, Callbacks callbacks);
  ~WebServer();
  /// Leaves everybody; no callback comes afterwards, and what is sent is dropped.
  void stop();

  void send(SharedMessage message);
  int viewers() const;
  /// Viewers that were dropped because they took nothing.
  int dropped_viewers() const;
  std::uint16_t port() const;
  /// Waits until every viewer has what was sent, for no longer than this.
  void drain(std::chrono::milliseconds patience);

 private:
  class Impl;
  explicit WebServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace fbvins
