// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/mavlink_sink.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <array>
#include <atomic>
#include <mutex>
#include <thread>

#include "fbvins/core/options.hpp"
#include "fbvins/live/bell.hpp"
#include "fbvins/live/byte_link.hpp"
#include "fbvins/live/host_clock.hpp"
#include "fbvins/live/mavlink_session.hpp"

namespace fbvins {
namespace {

constexpr int kTick_ms = 20;
constexpr Duration kTryAgainAfter{500'000'000};
constexpr std::size_t kWaiting = 64;  // events

}  // namespace

struct MavlinkSink::Impl {
  Impl(const std::string& address, LinkAddress link_address, const MavlinkOptions& options)
      : name(fmt::format("mavlink {}", address)), link(std::move(link_address)), session(options), worker([this] { work(); }) {}
  ~Impl() { stop(); }

  void stop() {
    ending = true;
    bell.ring();
    if (worker.joinable()) worker.join();
  }
  void work();
  void wait();
  void keep_open(Time now);
  void send(const MavlinkSession::Frames& frames);
  void publish(Time now);

  const std::string name;
  // Used by the worker alone.
  ByteLink link;
  MavlinkSession session;
  MavlinkLinkState seen;
  Time next_try{};

  const WakeEvent bell;
  std::atomic<bool> ending{false};
  std::mutex mutex;  // guards what follows, but for the thread
  std::deque<std::variant<LivePose, LiveStatus>> waiting;
  std::int64_t overrun = 0;
  MavlinkLinkState state;
  std::thread worker;  // last: starts when everything else exists
};

void MavlinkSink::Impl::keep_open(Time now) {
  if (link.is_open() || now < next_try) return;
  next_try = now + kTryAgainAfter;
  if (!link.open()) return;
  ++seen.times_opened;
  session.restart();
}

void MavlinkSink::Impl::send(const MavlinkSession::Frames& frames) {
  for (const auto& frame : frames) ++(link.send(frame) ? seen.frames_sent : seen.frames_dropped);
}

void MavlinkSink::Impl::wait() {
  std::array<pollfd, 2> fds = {{{bell.fd(), POLLIN, 0}, {link.descriptor(), POLLIN, 0}}};
  if (link.has_unsent()) fds[1].events |= POLLOUT;
  ::poll(fds.data(), fds.size(), kTick_ms);  // ignores a descriptor of -1
  bell.silence();
}

void MavlinkSink::Impl::publish(Time now) {
  seen.connected = link.is_open();
  seen.flight_controller = session.flight_controller_heard(now);
  seen.clock_known = session.clock().known();
  seen.clock_offset_s = seen.clock_known ? session.clock().value().seconds() : 0;
  seen.poses_sent = session.poses();
  seen.frames_received = session.frames_received();
  seen.problem = link.problem();
  if (!seen.problem.empty()) seen.problem += "; it is tried again twice a second";
  const std::lock_guard lock(mutex);
  state = seen;
  state.frames_dropped += overrun;
}

void MavlinkSink::Impl::work() {
  for (bool last = false; !last;) {
    last = ending;  // what was taken before the end is still sent
    keep_open(host_now());
    std::deque<std::variant<LivePose, LiveStatus>> events;
    {
      const std::lock_guard lock(mutex);
      events.swap(waiting);
    }
    for (const auto& event : events) {
      if (const auto* pose = std::get_if<LivePose>(&event)) send(session.take(*pose));
      else send(session.take(std::get<LiveStatus>(event), host_now()));
    }
    link.flush();
    const std::vector<std::uint8_t> bytes = link.receive();
    const Time now = host_now();
    send(session.receive(bytes, now));
    send(session.tick(now));
    publish(now);
    if (!last) wait();
  }
}

Result<std::unique_ptr<MavlinkSink>> MavlinkSink::create(const std::string& address, const MavlinkOptions& options) {
  Result<LinkAddress> link = parse_link_address(address);
  if (!link) return link.error();
  if (const Result<void> valid = validate(options); !valid) return valid.error();
  return std::unique_ptr<MavlinkSink>(new MavlinkSink(std::make_unique<Impl>(address, *std::move(link), options)));
}

MavlinkSink::MavlinkSink(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
MavlinkSink::~MavlinkSink() = default;

std::string_view MavlinkSink::name() const { return impl_->name; }

Result<void> MavlinkSink::take(const LiveEvent& event) {
  const std::lock_guard lock(impl_->mutex);
  if (const auto* pose = std::get_if<LivePose>(&event)) impl_->waiting.emplace_back(*pose);
  else if (const auto* status = std::get_if<LiveStatus>(&event)) impl_->waiting.emplace_back(*status);
  else return {};
  if (impl_->waiting.size() > kWaiting) impl_->waiting.pop_front(), ++impl_->overrun;
  impl_->bell.ring();
  return {};
}

std::string MavlinkSink::problem() const { return state().problem; }

Result<void> MavlinkSink::finish() {
  impl_->stop();
  return {};
}

MavlinkLinkState MavlinkSink::state() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->state;
}

}  // namespace fbvins
