// SPDX-License-Identifier: Apache-2.0
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <optional>

#include "fbvins/web/web_routes.hpp"
#include "fbvins/web/web_viewer.hpp"

namespace fbvins {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using Failure = beast::error_code;
using Request = http::request<http::empty_body>;
using Response = http::response<http::span_body<const char>>;

constexpr std::uint32_t kMostHeader_bytes = 8192;
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

WebRequest seen_as(const Request& request) {
  return {.host = view(request[http::field::host]),
          .origin = view(request[http::field::origin]),
          .target = view(request.target()),
          .reads = request.method() == http::verb::get || request.method() == http::verb::head,
          .upgrades = beast::websocket::is_upgrade(request)};
}

/// Answers the requests of one connection, one after the other.
class Visitor final : public WebVisitor, public std::enable_shared_from_this<Visitor> {
 public:
  Visitor(asio::ip::tcp::socket&& socket, std::shared_ptr<CountedConnection> place, WebViewers& viewers)
      : stream_(std::move(socket)), place_(std::move(place)), viewers_(viewers) {
    wait_.emplace(place_->shared(), *this);
  }

  void drop() override {
    Failure ignored;
    stream_.socket().close(ignored);
    wait_.reset();
    place_.reset();
  }

  void read() {
    parser_.emplace();
    parser_->header_limit(kMostHeader_bytes);
    stream_.expires_after((*place_)->options.header_patience);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](Failure failure, std::size_t) {
      if (!failure && self->place_) self->answer();
    });
  }

 private:
  void answer() {
    const Request& request = parser_->get();
    const WebShared& shared = **place_;
    const WebAnswer answer = answer_to(seen_as(request), shared.options, shared.files, shared.machine, viewers_.size());
    if (answer.status == 101) {
      wait_.reset();
      return accept_viewer(std::move(stream_), request, place_, viewers_);
    }
    wait_->restart();
    respond(request, answer);
  }

  void respond(const Request& request, const WebAnswer& answer) {
    response_ = {http::int_to_status(static_cast<unsigned>(answer.status)), request.version()};
    response_.set(http::field::content_type, beast::string_view(answer.type.data(), answer.type.size()));
    if (answer.gzip) response_.set(http::field::content_encoding, "gzip");
    response_.set(http::field::cache_control, "no-cache");
    response_.set("Content-Security-Policy", kPolicy);
    response_.set("X-Content-Type-Options", "nosniff");
    response_.set("X-Frame-Options", "DENY");
    response_.set("Referrer-Policy", "no-referrer");
    response_.keep_alive(request.keep_alive() && answer.status == 200);
    response_.body() = {answer.bytes.data(), request.method() == http::verb::head ? 0 : answer.bytes.size()};
    response_.content_length(answer.bytes.size());
    stream_.expires_after((*place_)->options.patience);
    http::async_write(stream_, response_, [self = shared_from_this()](Failure failure, std::size_t) {
      if (!self->place_) return;
      if (!failure && self->response_.keep_alive()) {
        self->wait_->restart();
        return self->read();
      }
      Failure ignored;
      self->stream_.socket().shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
    });
  }

  beast::tcp_stream stream_;
  std::shared_ptr<CountedConnection> place_;  ///< null: dropped
  std::optional<WebWait> wait_;
  WebViewers& viewers_;
  beast::flat_buffer buffer_{2 * kMostHeader_bytes};
  std::optional<http::request_parser<http::empty_body>> parser_;
  Response response_;
};

}  // namespace

void receive_visitor(asio::ip::tcp::socket&& socket, std::shared_ptr<CountedConnection> place, WebViewers& viewers) {
  std::make_shared<Visitor>(std::move(socket), std::move(place), viewers)->read();
}

}  // namespace fbvins
