// SPDX-License-Identifier: Apache-2.0
// For tests: a peer of the server that may do what a browser never would. One thread.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace fbvins {

class TestPeer {
 public:
  explicit TestPeer(std::uint16_t port) : descriptor_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = ::connect(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  ~TestPeer() { ::close(descriptor_); }
  TestPeer(const TestPeer&) = delete;
  TestPeer& operator=(const TestPeer&) = delete;

  bool connected() const { return connected_; }
  /// False where the server has closed.
  bool send(const std::string& bytes) {
    return ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == ssize_t(bytes.size());
  }

  /// All there is until the server closes or is silent for so long.
  std::string receive_all(std::chrono::milliseconds patience = std::chrono::milliseconds(2000)) {
    while (receive(patience)) {
    }
    return std::exchange(received_, {});
  }
  /// True once the server has closed.
  bool closed_within(std::chrono::milliseconds patience) {
    while (receive(patience)) received_.clear();
    return closed_;
  }

  /// Up to the end of an answer's header, and its body where it says how long that is.
  std::string ask(const std::string& request) {
    if (!send(request)) return {};
    return receive_answer();
  }
  std::string receive_answer() {
    std::size_t end = 0;
    while ((end = received_.find("\r\n\r\n")) == std::string::npos)
      if (!receive(std::chrono::seconds(5))) return std::exchange(received_, {});
    std::size_t size = end + 4;
    if (const auto length = received_.find("Content-Length: "); length < end) size += std::stoul(received_.substr(length + 16));
    while (received_.size() < size && receive(std::chrono::seconds(5))) {
    }
    std::string answer = received_.substr(0, size);
    received_.erase(0, size);
    return answer;
  }

  /// Becomes a viewer; the answer's first line.
  std::string watch(const std::string& host = "127.0.0.1", const std::string& more = "", const std::string& target = "/stream") {
    const std::string answer =
        ask("GET " + target + " HTTP/1.1\r\nHost: " + host +
            "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
            "Sec-WebSocket-Version: 13\r\n" +
            more + "\r\n");
    return answer.substr(0, answer.find("\r\n"));
  }
  /// The next message of the stream; pings are passed over.
  std::optional<std::string> message() {
    while (true) {
      if (!have(2)) return std::nullopt;
      const int kind = received_[0] & 15;
      std::size_t size = received_[1] & 127, head = 2;
      const int more = size == 126 ? 2 : size == 127 ? 8 : 0;
      if (!have(head + static_cast<std::size_t>(more))) return std::nullopt;
      if (more > 0) size = 0;
      for (int i = 0; i < more; ++i) size = size << 8 | static_cast<unsigned char>(received_[head++]);
      if (!have(head + size)) return std::nullopt;
      std::string bytes = received_.substr(head, size);
      received_.erase(0, head + size);
      if (kind == 1 || kind == 2) return bytes;
      if (kind == 8) return std::nullopt;
    }
  }
  /// A short text, as a browser sends it.
  bool say(const std::string& text) {
    std::string frame{'\x81'};
    if (text.size() < 126) frame += static_cast<char>(0x80 | text.size());
    else frame += {'\xfe', static_cast<char>(text.size() >> 8), static_cast<char>(text.size() & 255)};
    frame += std::string(4, '\0');  // the mask
    return send(frame + text);
  }

 private:
  bool have(std::size_t bytes) {
    while (received_.size() < bytes)
      if (!receive(std::chrono::seconds(5))) return false;
    return true;
  }
  bool receive(std::chrono::milliseconds patience) {
    pollfd what{descriptor_, POLLIN, 0};
    if (::poll(&what, 1, static_cast<int>(patience.count())) <= 0) return false;
    char bytes[65536];
    const ssize_t size = ::recv(descriptor_, bytes, sizeof bytes, 0);
    closed_ = size <= 0;
    if (closed_) return false;
    received_.append(bytes, static_cast<std::size_t>(size));
    return true;
  }

  int descriptor_;
  bool connected_ = false, closed_ = false;
  std::string received_;
};

}  // namespace fbvins
