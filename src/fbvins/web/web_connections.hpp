// SPDX-License-Identifier: Apache-2.0
// Private: data shared by the server's connections. Used on the server's thread alone, but for the two counts.
#pragma once

#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "fbvins/web/viewer_queue.hpp"
#include "fbvins/web/web_server.hpp"

namespace fbvins {

/// A connection that is no viewer: it waits for a request, or for its peer to read the answer.
class WebVisitor {
 public:
  virtual ~WebVisitor() = default;
  virtual void drop() = 0;
};

/// Lives as long as any connection.
struct WebShared {
  WebOptions options;
  PageFiles files;
  WebServer::Callbacks callbacks;
  std::string machine;          ///< this machine's name
  std::size_t connections = 0;  ///< that are open
  std::atomic<int> viewers{0}, dropped{0};
  std::map<std::uint64_t, WebVisitor*> waiting;  ///< by when they began to: the first has waited longest
  std::uint64_t waits = 0;

  void drop_longest_waiting() {
    if (!waiting.empty()) waiting.begin()->second->drop();
  }
};

/// A visitor's entry in the list of those that wait, for as long as this lives.
class WebWait {
 public:
  WebWait(std::shared_ptr<WebShared> shared, WebVisitor& visitor) : shared_(std::move(shared)), visitor_(visitor) { begin(); }
  ~WebWait() { shared_->waiting.erase(number_); }
  WebWait(const WebWait&) = delete;
  WebWait& operator=(const WebWait&) = delete;
  /// After a request it waits anew.
  void restart() {
    shared_->waiting.erase(number_);
    begin();
  }

 private:
  void begin() { shared_->waiting.emplace(number_ = shared_->waits++, &visitor_); }

  std::shared_ptr<WebShared> shared_;
  WebVisitor& visitor_;
  std::uint64_t number_ = 0;
};

/// Counts a connection while it lives.
class CountedConnection {
 public:
  explicit CountedConnection(std::shared_ptr<WebShared> shared) : shared_(std::move(shared)) { ++shared_->connections; }
  ~CountedConnection() { --shared_->connections; }
  CountedConnection(const CountedConnection&) = delete;
  CountedConnection& operator=(const CountedConnection&) = delete;
  WebShared& operator*() const { return *shared_; }
  WebShared* operator->() const { return shared_.get(); }
  const std::shared_ptr<WebShared>& shared() const { return shared_; }

 private:
  std::shared_ptr<WebShared> shared_;
};

/// A connection that gets the stream of messages.
class WebViewer {
 public:
  virtual ~WebViewer() = default;
  virtual void send(const SharedMessage& message) = 0;
  /// Whether everything has been sent to it.
  virtual bool idle() const = 0;
  /// To be called once a second: drops a viewer that does not read.
  virtual void judge() = 0;
  virtual void close() = 0;
};
using WebViewers = std::set<std::shared_ptr<WebViewer>>;

/// Answers a connection's requests until it ends or becomes one of `viewers`, which must outlive it.
void receive_visitor(boost::asio::ip::tcp::socket&& socket, std::shared_ptr<CountedConnection> place, WebViewers& viewers);

}  // namespace fbvins
