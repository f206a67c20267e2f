// SPDX-License-Identifier: Apache-2.0
// Against a small flight controller of the test's, over loopback UDP.
#include "fbvins/live/parameter_reader.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <set>
#include <thread>

#include "fbvins/mavlink/px4_parameters.hpp"
#include "fbvins/mavlink/wire.hpp"

namespace fbvins {
namespace parameter_reader_test {

/// Answers as PX4 does, whole numbers in the bytes of the float; loses the first request of each name.
class SmallFlightController {
 public:
  explicit SmallFlightController(std::map<std::string, Px4Parameter> parameters) : parameters_(std::move(parameters)) {
    socket_ = ::socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&own), sizeof own), 0);
    socklen_t length = sizeof own;
    ::getsockname(socket_, reinterpret_cast<sockaddr*>(&own), &length);
    port_ = ntohs(own.sin_port);
    thread_ = std::thread([this] { work(); });
  }
  ~SmallFlightController() {
    stop_ = true;
    thread_.join();
    ::close(socket_);
  }
  /// With a port of its own for the reader, whichever is free.
  std::string address() const { return fmt::format("udp:127.0.0.1:{}:0", port_); }

 private:
  void work() {
    while (!stop_) {
      pollfd fd{socket_, POLLIN, 0};
      if (::poll(&fd, 1, 20) <= 0) continue;
      std::uint8_t bytes[2048];
      sockaddr_in from{};
      socklen_t length = sizeof from;
      const ssize_t n = ::recvfrom(socket_, bytes, sizeof bytes, 0, reinterpret_cast<sockaddr*>(&from), &length);
      if (n <= 0) continue;
      for (const MavlinkFrame& frame : decoder_.push({bytes, static_cast<std::size_t>(n)})) answer(frame, from);
    }
  }
  void answer(const MavlinkFrame& frame, const sockaddr_in& to) {
    HeartbeatMessage beat;
    beat.autopilot = 12;
    if (std::holds_alternative<HeartbeatMessage>(frame.message)) return send(beat, to);
    const auto* request = std::get_if<ParameterRequestMessage>(&frame.message);
    if (request == nullptr || lost_.insert(text_of(request->param_id)).second) return;
    const auto found = parameters_.find(text_of(request->param_id));
    if (found == parameters_.end()) return;
    ParameterValueMessage value;
    value.param_id = request->param_id;
    value.param_type = found->second.whole ? ParameterValueMessage::kInt32 : ParameterValueMessage::kReal32;
    value.param_value = found->second.whole ? std::bit_cast<float>(static_cast<std::int32_t>(found->second.value))
                                            : static_cast<float>(found->second.value);
    send(value, to);
  }
  void send(const MavlinkMessage& message, const sockaddr_in& to) {
    const auto bytes = encode_mavlink(message, {1, 1}, sequence_++);
    ::sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }

  std::map<std::string, Px4Parameter> parameters_;
  std::set<std::string> lost_;
  MavlinkDecoder decoder_;
  std::uint8_t sequence_ = 0;
  int socket_ = -1;
  std::uint16_t port_ = 0;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

std::map<std::string, Px4Parameter> wanted(const Px4VisionSetup& setup) {
  std::map<std::string, Px4Parameter> out;
  for (const Px4Parameter& p : px4_parameters(setup)) out[p.name] = p;
  return out;
}

TEST(ParameterReader, ReadsWhatIsThereAlthoughRequestsAreLost) {
  const Px4VisionSetup setup{.link = Px4Link::serial};
  auto parameters = wanted(setup);
  parameters["EKF2_EV_CTRL"].value = 11;
  parameters.erase("EKF2_EV_QMIN");
  const SmallFlightController controller(parameters);
  const auto values = read_parameters(controller.address(), px4_parameter_names(setup), {.answer_s = 0.1});
  ASSERT_TRUE(values) << values.error().message;
  EXPECT_EQ(values->size(), parameters.size());
  EXPECT_EQ(values->at("SER_TEL2_BAUD"), 921600);
  const auto found = judge_px4(setup, *values);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].name, "EKF2_EV_CTRL");
  EXPECT_EQ(found[1].name, "EKF2_EV_QMIN");
}

TEST(ParameterReader, ASilentFlightControllerIsOneSentence) {
  const SmallFlightController controller({});
  const auto other_vehicle = read_parameters(controller.address(), {"A"}, {.system_id = 9, .heard_within_s = 0.2});
  ASSERT_FALSE(other_vehicle);
  EXPECT_EQ(other_vehicle.error().message, controller.address() + ": no flight controller of system 9 is heard within 0.2 s");
  EXPECT_FALSE(read_parameters("udp:nowhere", {"A"}, {}));
}

}  // namespace parameter_reader_test
}  // namespace fbvins
