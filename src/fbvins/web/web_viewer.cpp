// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/web_viewer.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>

namespace fbvins {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Failure = beast::error_code;
using Clock = std::chrono::steady_clock;
using Request = http::request<http::empty_body>;

constexpr std::size_t kMostCommand_bytes = 1024;
constexpr int kMostCommandsPerSecond = 40;
/// The kernel's buffer for a viewer: seconds of the stream, not minutes.
constexpr int kSendBuffer_bytes = 256 * 1024;
/// A viewer that answers no ping for this long is dropped: a phone out of reach.
constexpr std::chrono::seconds kIdle{30};

/// Leaves `viewers` when it ends.
class StreamViewer : public WebViewer, public std::enable_shared_from_this<StreamViewer> {
 public:
  StreamViewer(beast::tcp_stream&& stream, std::shared_ptr<CountedConnection> place, WebViewers& viewers)
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

  void send(const SharedMessage& message) override {
    queue_.push(message);
    write();
  }
  bool idle() const override { return !writing_; }

  void judge() override {
    commands_ = 0;
    if (!writing_ || Clock::now() - write_began_ < (*place_)->options.patience) return;
    ++(*place_)->dropped;
    close();
  }
  void close() override {
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
  std::shared_ptr<CountedConnection> place_;
  WebViewers& viewers_;
  beast::flat_buffer buffer_{kMostCommand_bytes};
  ViewerQueue queue_;
  SharedMessage now_;  ///< being written
  bool writing_ = false;
  Clock::time_point write_began_;
  int commands_ = 0;  ///< in this second
};

}  // namespace

void accept_viewer(beast::tcp_stream&& stream, const Request& request, std::shared_ptr<CountedConnection> place,
                   WebViewers& viewers) {
  std::make_shared<StreamViewer>(std::move(stream), std::move(place), viewers)->accept(request);
}

}  // namespace fbvins
