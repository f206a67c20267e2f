// SPDX-License-Identifier: Apache-2.0
#include "fbvins/v4l2/imu_feed.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <array>
#include <atomic>
#include <utility>

#include "fbvins/live/byte_link.hpp"
#include "fbvins/live/host_clock.hpp"
#include "fbvins/live/mavlink_imu.hpp"
#include "fbvins/live/socket_source.hpp"
#include "fbvins/live/wake_event.hpp"

namespace fbvins {
namespace {

constexpr int kTick_ms = 20;
constexpr Duration kOpenAgainAfter{500'000'000};

class MavlinkFeed final : public ImuFeed {
 public:
  MavlinkFeed(std::string where, LinkAddress address, Say say)
      : where_(std::move(where)), say_(std::move(say)), link_(std::move(address)) {}

  Result<void> run(SensorInput& input) override {
    while (!stopped_) {
      keep_open(host_now());
      for (const auto& frame : imu_.tick(host_now())) link_.send(frame);
      link_.flush();
      std::array<pollfd, 2> watched = {{{wake_.fd(), POLLIN, 0}, {link_.descriptor(), POLLIN, 0}}};
      ::poll(watched.data(), watched.size(), kTick_ms);
      const std::vector<std::uint8_t> bytes = link_.receive();
      for (const ImuSample& sample : imu_.receive(bytes, host_now())) input.push(sample);
      tell(host_now());
    }
    return {};
  }

  void stop() override {
    stopped_ = true;
    wake_.signal();
  }

 private:
  void keep_open(Time now) {
    if (link_.is_open() || now < next_try_) return;
    next_try_ = now + kOpenAgainAfter;
    if (link_.open()) imu_.restart();
  }
  /// Reports the connection's state when it has changed.
  void tell(Time now) {
    const bool heard = imu_.peer().is_heard(now), known = imu_.peer().clock().known();
    const std::string state = !link_.is_open() ? link_.problem()
                              : !heard         ? "no flight controller is heard"
                              : !known         ? "a flight controller is heard, its clock is not known yet"
                                               : "the flight controller's IMU";
    if (state != told_) say_(fmt::format("{}: {}", where_, state));
    told_ = state;
    if (imu_.refused() > 0 && !std::exchange(told_refused_, true))
      say_(fmt::format("{}: readings with stamps that cannot be right, or numbers that are not finite, are left out", where_));
    if (link_.newest_stranger() == told_stranger_) return;
    told_stranger_ = link_.newest_stranger();
    say_(fmt::format("{}: packets of {} are ignored: it is not the flight controller's address", where_, told_stranger_));
  }

  std::string where_, told_, told_stranger_;
  Say say_;
  ByteLink link_;
  MavlinkImu imu_;
  Time next_try_{};
  const WakeEvent wake_;
  std::atomic<bool> stopped_ = false;
  bool told_refused_ = false;
};

/// Another process's readings without its images.
class SocketFeed final : public ImuFeed {
 public:
  explicit SocketFeed(std::unique_ptr<SocketSource> source) : source_(std::move(source)) {}

  Result<void> run(SensorInput& input) override {
    struct ReadingsOnly final : SensorInput {
      explicit ReadingsOnly(SensorInput& input) : all(input) {}
      void push(const ImuSample& sample) override { all.push(sample); }
      void push(StereoFrame) override {}
      void push_aiding(const AidingSample& reading) override { all.push_aiding(reading); }
      SensorInput& all;
    } readings(input);
    return source_->run(readings);
  }
  void stop() override { source_->stop(); }

 private:
  std::unique_ptr<SocketSource> source_;
};

}  // namespace

Result<std::unique_ptr<ImuFeed>> ImuFeed::open(const std::string& where, const StereoRig& rig, Say say) {
  const std::string socket = "socket:";
  if (where.starts_with(socket)) {
    auto source = SocketSource::open(where.substr(socket.size()), {.rig = rig, .say = std::move(say)});
    if (!source) return source.error();
    return std::unique_ptr<ImuFeed>(std::make_unique<SocketFeed>(*std::move(source)));
  }
  Result<LinkAddress> address = parse_link_address(where, kOwnUdpPortForImu);
  if (!address) return address.error();
  return std::unique_ptr<ImuFeed>(std::make_unique<MavlinkFeed>(where, *std::move(address), std::move(say)));
}

}  // namespace fbvins
