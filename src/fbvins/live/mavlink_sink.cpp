// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/mavlink_sink.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

#include "fbvins/core/options.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/live/byte_link.hpp"
#include "fbvins/live/host_clock.hpp"
#include "fbvins/live/mavlink_session.hpp"
#include "fbvins/live/signing_time.hpp"
#include "fbvins/live/wake_event.hpp"

namespace fbvins {
namespace {

constexpr int kTick_ms = 20;
constexpr Duration kTryAgainAfter{500'000'000};
constexpr std::size_t kWaiting = 64;  // events
constexpr Duration kStrangersAreToldFor{5'000'000'000};
constexpr std::uint64_t kLongestKeyFile_bytes = 4096;

std::uint64_t signing_time_now() {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return mavlink_signing_time(Time{std::chrono::duration_cast<std::chrono::nanoseconds>(since_1970).count()});
}

/// Null where frames are not to be signed.
Result<std::unique_ptr<MavlinkSigner>> make_signer(const std::string& key_file, std::uint64_t first) {
  if (key_file.empty()) return std::unique_ptr<MavlinkSigner>();
  const auto text = read_file(key_file, kLongestKeyFile_bytes);
  if (!text) return text.error();
  const auto key = parse_mavlink_key(*text);
  if (!key) return Error{key.error().code, fmt::format("{}: {}", key_file, key.error().message)};
  return std::make_unique<MavlinkSigner>(*key, first);
}

/// Without all keyframes of the map.
MapUpdate where_M_is(const MapUpdate& update) {
  MapUpdate out;
  out.localised = update.localised;
  out.found = update.found;
  out.T_MW_smooth = update.T_MW_smooth;
  out.anchored = update.anchored;
  out.M_moved = update.M_moved;
  out.reset_counter = update.reset_counter;
  return out;
}

}  // namespace

struct MavlinkSink::Impl {
  using Event = std::variant<LivePose, LiveStatus, MapUpdate>;
  Impl(const std::string& address, LinkAddress link_address, const MavlinkOptions& options, SigningTime time,
       std::unique_ptr<MavlinkSigner> signer)
      : name(fmt::format("mavlink {}", address)),
        link(std::move(link_address)),
        session(options, std::move(signer)),
        signing_time(std::move(time)),
        worker([this] { work(); }) {}
  ~Impl() { stop(); }

  void stop() {
    ending = true;
    wake.signal();
    if (worker.joinable()) worker.join();
  }
  void work();
  void wait();
  void keep_open(Time now);
  void send(const MavlinkSession::Frames& frames);
  void mind_peer(Time now);
  void mind_signing_time();
  std::string problem(Time now);
  void publish(Time now);
  void hand_on(const std::vector<AidingSample>& readings);

  const std::string name;
  // Used by the worker alone.
  ByteLink link;
  MavlinkSession session;
  SigningTime signing_time;
  bool signing_time_is_kept = true;
  MavlinkLinkState seen;
  Time next_try{};
  std::optional<Time> stranger_at;

  const WakeEvent wake;
  std::atomic<bool> ending{false};
  std::mutex mutex;  // guards what follows, but for the thread
  std::deque<Event> waiting;
  std::int64_t overrun = 0;
  MavlinkLinkState state;
  std::mutex reading_mutex;  // guards on_reading, also while it runs
  std::function<void(const AidingSample&)> on_reading;
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

/// Whose packet has a flight controller's heartbeat is the peer that was to be learnt, until it is silent.
void MavlinkSink::Impl::mind_peer(Time now) {
  if (!link.has_peer() && session.heard_at() == now) link.pin_to_sender();
  else if (link.has_peer() && !session.flight_controller_heard(now)) link.forget_peer();
}

void MavlinkSink::Impl::mind_signing_time() {
  MavlinkSigner* signer = session.signer();
  if (signer == nullptr) return;
  signer->advance(signing_time_now());
  signing_time_is_kept = signing_time.keep(signer->time());
}

std::string MavlinkSink::Impl::problem(Time now) {
  if (!link.problem().empty()) return link.problem() + "; it is tried again twice a second";
  if (const std::string why = session.problem(now); !why.empty()) return why;
  if (!signing_time_is_kept)
    return fmt::format("{} cannot be written: after a restart a flight controller may refuse signed messages",
                       signing_time.file());
  if (link.strangers() > seen.packets_refused) stranger_at = now;
  if (stranger_at && now - *stranger_at < kStrangersAreToldFor)
    return fmt::format("packets of {} are ignored: it is not the flight controller's address", link.newest_stranger());
  return {};
}

void MavlinkSink::Impl::wait() {
  std::array<pollfd, 2> fds = {{{wake.fd(), POLLIN, 0}, {link.descriptor(), POLLIN, 0}}};
  if (link.has_unsent()) fds[1].events |= POLLOUT;
  ::poll(fds.data(), fds.size(), kTick_ms);  // ignores a descriptor of -1
  wake.clear();
}

void MavlinkSink::Impl::publish(Time now) {
  seen.connected = link.is_open();
  seen.flight_controller = session.flight_controller_heard(now);
  seen.clock_known = session.clock_is_sure(now);
  seen.clock_offset_s = seen.clock_known ? session.clock().value().seconds() : 0;
  seen.round_trip_ms = session.clock().known() ? session.clock().round_trip().seconds() * 1e3 : 0;
  seen.poses_sent = session.poses();
  seen.frames_received = session.frames_received();
  seen.poses_withheld = session.poses_withheld();
  seen.frames_refused = session.frames_refused();
  seen.problem = problem(now);
  seen.packets_refused = link.strangers();
  const std::lock_guard lock(mutex);
  state = seen;
  state.frames_dropped += overrun;
}

void MavlinkSink::Impl::hand_on(const std::vector<AidingSample>& readings) {
  const std::lock_guard lock(reading_mutex);
  for (const AidingSample& reading : readings)
    if (on_reading) on_reading(reading), ++seen.readings;
}

void MavlinkSink::Impl::work() {
  for (bool last = false; !last;) {
    last = ending;  // what was taken before the end is still sent
    keep_open(host_now());
    std::deque<Event> events;
    {
      const std::lock_guard lock(mutex);
      events.swap(waiting);
    }
    for (const auto& event : events) {
      if (const auto* pose = std::get_if<LivePose>(&event)) send(session.take(*pose));
      else if (const auto* status = std::get_if<LiveStatus>(&event)) send(session.take(*status, host_now()));
      else session.take(std::get<MapUpdate>(event));
    }
    link.flush();
    const std::vector<std::uint8_t> bytes = link.receive();
    const Time now = host_now();
    send(session.receive(bytes, now));
    hand_on(session.take_readings());
    mind_peer(now);
    mind_signing_time();
    send(session.tick(now));
    publish(now);
    if (!last) wait();
  }
}

Result<std::unique_ptr<MavlinkSink>> MavlinkSink::create(const std::string& address, const MavlinkOptions& options) {
  Result<LinkAddress> link = parse_link_address(address);
  if (!link) return link.error();
  if (const Result<void> valid = validate(options); !valid) return valid.error();
  if (const auto origin = parse_mavlink_origin(options.origin); !origin) return origin.error();
  if (auto* udp = std::get_if<UdpAddress>(&*link)) udp->peer_is_learnt = options.udp_peer == MavlinkUdpPeer::first;
  SigningTime time(options.key_file.empty() ? std::string() : options.key_time_file);
  auto signer = make_signer(options.key_file, std::max(time.first(), signing_time_now()));
  if (!signer) return signer.error();
  return std::unique_ptr<MavlinkSink>(
      new MavlinkSink(std::make_unique<Impl>(address, *std::move(link), options, std::move(time), *std::move(signer))));
}

MavlinkSink::MavlinkSink(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
MavlinkSink::~MavlinkSink() = default;

std::string_view MavlinkSink::name() const { return impl_->name; }

Result<void> MavlinkSink::take(const LiveEvent& event) {
  const std::lock_guard lock(impl_->mutex);
  if (const auto* pose = std::get_if<LivePose>(&event)) impl_->waiting.emplace_back(*pose);
  else if (const auto* status = std::get_if<LiveStatus>(&event)) impl_->waiting.emplace_back(*status);
  else if (const auto* update = std::get_if<MapUpdate>(&event)) impl_->waiting.emplace_back(where_M_is(*update));
  else return {};
  if (impl_->waiting.size() > kWaiting) impl_->waiting.pop_front(), ++impl_->overrun;
  impl_->wake.signal();
  return {};
}

void MavlinkSink::on_reading(std::function<void(const AidingSample&)> callback) {
  const std::lock_guard lock(impl_->reading_mutex);
  impl_->on_reading = std::move(callback);
}

std::string MavlinkSink::problem() const { return state().problem; }

std::vector<OutputFigure> MavlinkSink::figures() const {
  const MavlinkLinkState s = state();
  return {{"connected", s.connected},           {"flight_controller", s.flight_controller}, {"clock_known", s.clock_known},
          {"clock_offset_s", s.clock_offset_s}, {"round_trip_ms", s.round_trip_ms},         {"poses_sent", s.poses_sent},
          {"poses_withheld", s.poses_withheld}, {"frames_dropped", s.frames_dropped},       {"readings", s.readings}};
}

Result<void> MavlinkSink::finish() {
  impl_->stop();
  return {};
}

MavlinkLinkState MavlinkSink::state() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->state;
}

}  // namespace fbvins
