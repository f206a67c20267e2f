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
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <future>
#include <optional>
#include <set>
#include <thread>

namespace fbvins {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Failure = beast::error_code;
using Clock = std::chrono::steady_clock;
using Request = http::request<http::empty_body>;
using Response = http::response<http::span_body<const char>>;

constexpr std::uint32_t kMostHeader_bytes = 8192;
constexpr std::size_t kMostCommand_bytes = 1024;
constexpr int kMostCommandsPerSecond = 40;
/// Messages that may wait for the server's thread.
constexpr int kMostPosted = 256;
/// What the kernel may hold for a viewer: seconds of the stream, not minutes.
constexpr int kSendBuffer_bytes = 256 * 1024;
constexpr std::chrono::seconds kSweepPeriod{1};
/// A viewer that has answered no ping for so long is gone: a phone out of reach.
constexpr std::chrono::seconds kIdle{30};
constexpr std::chrono::milliseconds kAcceptPause{100};
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string machine_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

/// What all connections share; lives as long as any of them.
struct Shared {
  WebOptions options;
  PageFiles files;
  WebServer::Callbacks callbacks;
  std::string machine = machine_name();
  std::size_t connections = 0;  ///< open now
  std::atomic<int> viewers{0}, dropped{0};
};

/// Counts a connection while it lives.
class Place {
 public:
  explicit Place(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) { ++shared_->connections; }
  ~Place() { --shared_->connections; }
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;
  Shared& operator*() const { return *shared_; }
  Shared* operator->() const { return shared_.get(); }

 private:
  std::shared_ptr<Shared> shared_;
};

class Viewer;
using Viewers = std::set<std::shared_ptr<Viewer>>;

/// One page that looks. Leaves `viewers` when it ends, whatever ends it.
class Viewer : public std::enable_shared_from_this<Viewer> {
 public:
  Viewer(beast::tcp_stream&& stream, std::shared_ptr<Place> place, Viewers& viewers)
      : socket_(std::move(stream)), place_(std::move(place)), viewers_(viewers) {}

  void accept(const Request& request) {
    beast::get_lowest_layer(socket_).expires_never();
    Failure ignored;
    beast::get_lowest_layer(socket_).socket().set_option(asio::socket_base::send_buffer_size(kSendBuffer_bytes), ignored);
    beast::get_lowest_layer(socket_).socket().set_option(asio::ip::tcp::no_delay(true), ignored);
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = (*place_)->options.patience;
    timeout.idle_timeout = kIdle;
    timeout.keep_alive_pings = true;
    socket_.set_option(timeout);
    socket_.read_message_max(kMostCommand_bytes);
    socket_.auto_fragment(false);
    socket_.async_accept(request, [self = shared_from_this()](Failure failure) { self->begin(failure); });
  }

  void send(const SharedMessage& message) {
    queue_.push(message);
    write();
  }
  bool idle() const { return !writing_; }

  /// Once a second. One that takes nothing, or says too much, is left.
  void judge() {
    commands_ = 0;
    if (!writing_ || Clock::now() - write_began_ < (*place_)->options.patience) return;
    ++(*place_)->dropped;
    close();
  }
  void close() {
    Failure ignored;
    beast::get_lowest_layer(socket_).socket().close(ignored);
  }

 private:
  void begin(Failure failure) {
    if (failure) return;
    viewers_.insert(shared_from_this());
    (*place_)->viewers = static_cast<int>(viewers_.size());
    for (const SharedMessage& message : (*place_)->callbacks.greet()) queue_.push(message);
    write();
    read();
  }
  void leave() {
    viewers_.erase(shared_from_this());
    (*place_)->viewers = static_cast<int>(viewers_.size());
  }

  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](Failure failure, std::size_t) { self->on_read(failure); });
  }
  void on_read(Failure failure) {
    if (failure || ++commands_ > kMostCommandsPerSecond) return close(), leave();
    const auto bytes = buffer_.data();
    if (socket_.got_text()) (*place_)->callbacks.command({static_cast<const char*>(bytes.data()), bytes.size()});
    buffer_.consume(buffer_.size());
    read();
  }

  void write() {
    if (writing_) return;
    now_ = queue_.pop();
    if (!now_) return;
    writing_ = true;
    write_began_ = Clock::now();
    socket_.binary(now_->binary);
    socket_.async_write(asio::buffer(now_->bytes), [self = shared_from_this()](Failure failure, std::size_t) {
      self->writing_ = false;
      self->now_.reset();
      if (failure) return self->close(), self->leave();
      self->write();
    });
  }

  websocket::stream<beast::tcp_stream> socket_;
  std::shared_ptr<Place> place_;
  Viewers& viewers_;
  beast::flat_buffer buffer_{kMostCommand_bytes};
  ViewerQueue queue_;
  SharedMessage now_;  ///< being written
  bool writing_ = false;
  Clock::time_point write_began_;
  int commands_ = 0;  ///< in this second
};

/// A connection until it becomes a viewer: requests for files, one after the other.
class Visitor : public std::enable_shared_from_this<Visitor> {
 public:
  Visitor(asio::ip::tcp::socket&& socket, std::shared_ptr<Place> place, Viewers& viewers)
      : stream_(std::move(socket)), place_(std::move(place)), viewers_(viewers) {}

  void read() {
    parser_.emplace();
    parser_->header_limit(kMostHeader_bytes);
    stream_.expires_after((*place_)->options.patience);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](Failure failure, std::size_t) {
      if (!failure) self->answer();
    });
  }

 private:
  void answer() {
    const Request& request = parser_->get();
    const std::string_view host = view(request[http::field::host]), origin = view(request[http::field::origin]);
    const std::string_view target = view(request.target()), path = target.substr(0, target.find('?'));
    if (!host_allowed(host, (*place_)->machine)) return refuse(http::status::forbidden, "another host is meant\n");
    if (!origin_allowed(origin, host)) return refuse(http::status::forbidden, "another page asks\n");
    if (path == "/stream") return stream(request, token_of(target));
    if (request.method() != http::verb::get && request.method() != http::verb::head)
      return refuse(http::status::method_not_allowed, "only GET\n");
    const std::string_view wanted = path == "/" ? "/index.html" : path;
    const PageFiles& files = (*place_)->files;
    const auto file = std::find_if(files.begin(), files.end(), [&](const PageFile& f) { return f.path == wanted; });
    if (file == files.end()) return refuse(http::status::not_found, "there is no such file\n");
    respond(http::status::ok, file->bytes, file->type, file->gzip);
  }

  void stream(const Request& request, std::string_view token) {
    const WebOptions& options = (*place_)->options;
    if (!options.token.empty() && !token_equal(token, options.token)) return refuse(http::status::unauthorized, "wrong token\n");
    if (!websocket::is_upgrade(request)) return refuse(http::status::upgrade_required, "a WebSocket is wanted\n");
    if (viewers_.size() >= options.most_viewers) return refuse(http::status::service_unavailable, "too many viewers\n");
    std::make_shared<Viewer>(std::move(stream_), place_, viewers_)->accept(request);
  }

  void refuse(http::status status, std::string_view sentence) { respond(status, sentence, "text/plain; charset=utf-8", false); }

  void respond(http::status status, std::string_view bytes, std::string_view type, bool gzip) {
    const Request& request = parser_->get();
    response_ = {status, request.version()};
    response_.set(http::field::content_type, beast::string_view(type.data(), type.size()));
    if (gzip) response_.set(http::field::content_encoding, "gzip");
    response_.set(http::field::cache_control, "no-cache");
    response_.set("Content-Security-Policy", kPolicy);
    response_.set("X-Content-Type-Options", "nosniff");
    response_.set("X-Frame-Options", "DENY");
    response_.set("Referrer-Policy", "no-referrer");
    response_.keep_alive(request.keep_alive() && status == http::status::ok);
    response_.body() = {bytes.data(), request.method() == http::verb::head ? 0 : bytes.size()};
    response_.content_length(bytes.size());
    stream_.expires_after((*place_)->options.patience);
    http::async_write(stream_, response_, [self = shared_from_this()](Failure failure, std::size_t) {
      if (!failure && self->response_.keep_alive()) return self->read();
      Failure ignored;
      self->stream_.socket().shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
    });
  }

  beast::tcp_stream stream_;
  std::shared_ptr<Place> place_;
  Viewers& viewers_;
  beast::flat_buffer buffer_{2 * kMostHeader_bytes};
  std::optional<http::request_parser<http::empty_body>> parser_;
  Response response_;
};

}  // namespace

class WebServer::Impl {
 public:
  Impl(const WebOptions& options, PageFiles files, Callbacks callbacks)
      : shared_(std::make_shared<Shared>()), acceptor_(context_), sweep_(context_), pause_(context_) {
    shared_->options = options;
    shared_->files = std::move(files);
    shared_->callbacks = std::move(callbacks);
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
    if (!failure) return {};
    return Error{ErrorCode::unreadable,
                 fmt::format("the page cannot be served at {} port {}: {}", address.host, address.port, failure.message())};
  }

  void start() {
    accept();
    sweep();
    thread_ = std::thread([this] { context_.run(); });
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
      for (const auto& viewer : Viewers(viewers_)) viewer->send(message);
    });
  }

  void drain(std::chrono::milliseconds patience) {
    const auto end = Clock::now() + patience;
    while (shared_->viewers > 0 && !all_sent() && Clock::now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }

  std::uint16_t port() const { return acceptor_.local_endpoint().port(); }
  const Shared& shared() const { return *shared_; }

 private:
  void accept() {
    acceptor_.async_accept([this](Failure failure, asio::ip::tcp::socket socket) {
      if (failure) return accept_later();
      if (shared_->connections < shared_->options.most_connections)
        std::make_shared<Visitor>(std::move(socket), std::make_shared<Place>(shared_), viewers_)->read();
      accept();
    });
  }
  /// Most likely there are no more descriptors.
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
      for (const auto& viewer : Viewers(viewers_)) viewer->judge();
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

  std::shared_ptr<Shared> shared_;
  Viewers viewers_;  ///< outlives the connections that end with the context
  asio::io_context context_{1};
  asio::ip::tcp::acceptor acceptor_;
  asio::steady_timer sweep_, pause_;
  std::atomic<int> posted_{0};
  std::thread thread_;
};

Result<std::unique_ptr<WebServer>> WebServer::start(const WebOptions& options, PageFiles files, Callbacks callbacks) {
  auto impl = std::make_unique<Impl>(options, std::move(files), std::move(callbacks));
  if (Result<void> listens = impl->listen(); !listens) return listens.error();
  impl->start();
  return std::unique_ptr<WebServer>(new WebServer(std::move(impl)));
}

WebServer::WebServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WebServer::~WebServer() = default;

void WebServer::stop() { impl_->stop(); }
void WebServer::send(SharedMessage message) { impl_->send(std::move(message)); }
int WebServer::viewers() const { return impl_->shared().viewers; }
int WebServer::dropped_viewers() const { return impl_->shared().dropped; }
std::uint16_t WebServer::port() const { return impl_->port(); }
void WebServer::drain(std::chrono::milliseconds patience) { impl_->drain(patience); }

}  // namespace fbvins
