// SPDX-License-Identifier: Apache-2.0
// Private: a connection that has requested the stream. On the server's thread.
#pragma once

#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <memory>

#include "fbvins/web/web_connections.hpp"

namespace fbvins {

/// Completes the WebSocket handshake; then the connection is one of `viewers` until it ends.
void accept_viewer(boost::beast::tcp_stream&& stream, const boost::beast::http::request<boost::beast::http::empty_body>& request,
                   std::shared_ptr<CountedConnection> place, WebViewers& viewers);

}  // namespace fbvins
