// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/web_server.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <future>
#include <mutex>
#include <thread>

#include "fbvins/web/web_connections.hpp"

namespace fbvins {
namespace {

namespace asio = boost::asio;
using Failure = boost::system::error_code;
using Clock = std::chrono::steady_clock;

/// Messages that may wait for the server's thread.
constexpr int kMostPosted = 256;
constexpr std::chrono::seconds kSweepPeriod{1};
constexpr std::chrono::milliseconds kAcceptPause{100};

std::string machine_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

}  // namespace

class WebServer::Impl {
 public:
  Impl(const WebOptions& options, PageFiles files, Callbacks callbacks)
      : shared_(std::make_shared<WebShared>()), acceptor_(context_), sweep_(context_), pause_(context_), again_(context_) {
    shared_->options = options;
    shared_->files = std::move(files);
    shared_->callbacks = std::move(callbacks);
    shared_->machine = machine_name();
  }

  Result<void> listen() {
    const WebAddress& address = shared_->options.address;
    Failure failure;
    const auto ip = asio::ip::make_address(address.host, failure);
    const asio::ip::tcp::endpoint endpoint(ip, address.port);
    if (!failure) acceptor_.open(endpoint.protocol(), failure);
    if (!failure) acceptor_.set_option(asio::socket_base::reuse_address(true), failure);
    if (!failure) acceptor_.bind(endpoint, failure);
    if (!failure) acceptor_.listen(asio::socket_base::max_listen_connections, failure);
    if (!failure) port_ = acceptor_.local_endpoint().port();
    if (!failure) return {};
    Failure ignored;
    acceptor_.close(ignored);
    return Error{ErrorCode::unreadable,
                 fmt::format("the page cannot be served at {} port {}: {}", address.host, address.port, failure.message())};
  }

  /// The first try is the caller's, so that a wrong address can be its error.
  Result<void> start() {
    const Result<void> listens = listen();
    if (!listens && shared_->options.try_again.count() == 0) return listens;
    if (listens) accept();
    else listen_later(listens.error().message);
    sweep();
    thread_ = std::thread([this] { context_.run(); });
    return {};
  }
  ~Impl() { stop(); }
  void stop() {
    context_.stop();
    if (thread_.joinable()) thread_.join();
    Failure ignored;
    acceptor_.close(ignored);
    for (const auto& viewer : viewers_) viewer->close();
    viewers_.clear();  // before the context, to which their sockets belong
    shared_->viewers = 0;
  }

  void send(SharedMessage message) {
    if (shared_->viewers == 0) return;
    if (++posted_ > kMostPosted) return void(--posted_);
    asio::post(context_, [this, message = std::move(message)] {
      --posted_;
      for (const auto& viewer : WebViewers(viewers_)) viewer->send(message);
    });
  }

  void drain(std::chrono::milliseconds patience) {
    const auto end = Clock::now() + patience;
    while (shared_->viewers > 0 && !all_sent() && Clock::now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }

  std::uint16_t port() const { return port_; }
  std::string problem() const {
    const std::lock_guard lock(problem_mutex_);
    return problem_;
  }
  const WebShared& shared() const { return *shared_; }

 private:
  void accept() {
    acceptor_.async_accept([this](Failure failure, asio::ip::tcp::socket socket) {
      if (failure) return accept_later();
      if (shared_->connections >= shared_->options.most_connections) shared_->drop_longest_waiting();
      if (shared_->connections < shared_->options.most_connections)
        receive_visitor(std::move(socket), std::make_shared<CountedConnection>(shared_), viewers_);
      accept();
    });
  }
  void listen_later(std::string problem) {
    {
      const std::lock_guard lock(problem_mutex_);
      problem_ = std::move(problem);
    }
    again_.expires_after(shared_->options.try_again);
    again_.async_wait([this](Failure failure) {
      if (failure) return;
      if (const Result<void> listens = listen(); !listens) return listen_later(listens.error().message);
      {
        const std::lock_guard lock(problem_mutex_);
        problem_.clear();
      }
      accept();
    });
  }
  /// The likely cause is a lack of file descriptors.
  void accept_later() {
    pause_.expires_after(kAcceptPause);
    pause_.async_wait([this](Failure failure) {
      if (!failure) accept();
    });
  }
  void sweep() {
    sweep_.expires_after(kSweepPeriod);
    sweep_.async_wait([this](Failure failure) {
      if (failure) return;
      for (const auto& viewer : WebViewers(viewers_)) viewer->judge();
      sweep();
    });
  }
  bool all_sent() {
    std::promise<bool> answer;
    asio::post(context_, [&] {
      answer.set_value(std::all_of(viewers_.begin(), viewers_.end(), [](const auto& viewer) { return viewer->idle(); }));
    });
    return answer.get_future().get();
  }

  std::shared_ptr<WebShared> shared_;
  WebViewers viewers_;  ///< outlives the connections that end with the context
  asio::io_context context_{1};
  asio::ip::tcp::acceptor acceptor_;
  asio::steady_timer sweep_, pause_, again_;
  std::atomic<std::uint16_t> port_{0};
  mutable std::mutex problem_mutex_;
  std::string problem_;  ///< guarded by problem_mutex_
  std::atomic<int> posted_{0};
  std::thread thread_;
};

Result<std::unique_ptr<WebServer>> WebServer::start(const WebOptions& options, PageFiles files, Callbacks callbacks) {
  auto impl = std::make_unique<Impl>(options, std::move(files), std::move(callbacks));
  if (Result<void> started = impl->start(); !started) return started.error();
  return std::unique_ptr<WebServer>(new WebServer(std::move(impl)));
}

WebServer::WebServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WebServer::~WebServer() = default;

void WebServer::stop() { impl_->stop(); }
void WebServer::send(SharedMessage message) { impl_->send(std::move(message)); }
int WebServer::viewers() const { return impl_->shared().viewers; }
int WebServer::dropped_viewers() const { return impl_->shared().dropped; }
std::string WebServer::problem() const { return impl_->problem(); }
std::uint16_t WebServer::port() const { return impl_->port(); }
void WebServer::drain(std::chrono::milliseconds patience) { impl_->drain(patience); }

}  // namespace fbvins
