// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/parameter_reader.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>

#include "fbvins/live/byte_link.hpp"
#include "fbvins/live/host_clock.hpp"
#include "fbvins/mavlink/wire.hpp"

namespace fbvins {
namespace {

constexpr std::size_t kAtOnce = 6;  // requests under way: a serial port has a small queue

struct Request {
  std::string name;
  int sent = 0;
  Time due{};
};

class Conversation {
 public:
  Conversation(LinkAddress address, const ParameterReaderOptions& options)
      : link_(std::move(address)),
        options_(options),
        us_{static_cast<std::uint8_t>(options.system_id), MavlinkAddress{}.component} {}

  Result<void> begin(const std::string& address) {
    if (!link_.open()) return Error{ErrorCode::unreadable, fmt::format("{}: {}", address, link_.problem())};
    const Time end = host_now() + Duration::from_seconds(options_.heard_within_s);
    for (Time beat{}; !heard_ && host_now() < end; listen()) {
      if (host_now() < beat) continue;
      send(HeartbeatMessage{});  // a flight controller answers whom it has heard
      beat = host_now() + Duration{500'000'000};
    }
    if (heard_) return {};
    return Error{ErrorCode::not_found, fmt::format("{}: no flight controller of system {} is heard within {:g} s", address,
                                                   options_.system_id, options_.heard_within_s)};
  }

  void read(const std::vector<std::string>& names) {
    for (const std::string& name : names) requests_.push_back({name});
    while (!requests_.empty()) {
      const Time now = host_now();
      for (std::size_t i = 0; i < std::min(kAtOnce, requests_.size()); ++i) ask(requests_[i], now);
      listen();
      std::erase_if(requests_, [&](const Request& r) {
        return values_.contains(r.name) || (r.sent >= options_.tries && host_now() >= r.due);
      });
    }
  }

  std::map<std::string, double> take() { return std::move(values_); }

 private:
  void ask(Request& request, Time now) {
    if (now < request.due || request.sent >= options_.tries) return;
    ParameterRequestMessage message;
    message.target_system = us_.system;
    message.param_id = parameter_name(request.name);
    send(message);
    ++request.sent;
    request.due = now + Duration::from_seconds(options_.answer_s);
  }
  void send(const MavlinkMessage& message) {
    (void)link_.send(encode_mavlink(message, us_, sequence_++));
    link_.flush();
  }
  void listen() {
    constexpr int kWait_ms = 20;
    pollfd fd{link_.descriptor(), POLLIN, 0};
    ::poll(&fd, 1, kWait_ms);
    for (const MavlinkFrame& frame : decoder_.push(link_.receive())) {
      if (frame.from.system != us_.system) continue;
      if (const auto* beat = std::get_if<HeartbeatMessage>(&frame.message))
        heard_ |= beat->autopilot != HeartbeatMessage::kNoAutopilot;
      if (const auto* value = std::get_if<ParameterValueMessage>(&frame.message))
        values_[text_of(value->param_id)] = value->value();
    }
  }

  ByteLink link_;
  MavlinkDecoder decoder_;
  ParameterReaderOptions options_;
  MavlinkAddress us_;
  std::uint8_t sequence_ = 0;
  bool heard_ = false;
  std::vector<Request> requests_;
  std::map<std::string, double> values_;
};

}  // namespace

Result<std::map<std::string, double>> read_parameters(const std::string& address, const std::vector<std::string>& names,
                                                      const ParameterReaderOptions& options) {
  Result<LinkAddress> link = parse_link_address(address);
  if (!link) return link.error();
  Conversation conversation(*std::move(link), options);
  if (Result<void> begun = conversation.begin(address); !begun) return begun.error();
  conversation.read(names);
  return conversation.take();
}

}  // namespace fbvins
