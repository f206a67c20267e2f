// SPDX-License-Identifier: Apache-2.0
#include "fbvins/flight/live_link.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <mutex>
#include <thread>
#include <utility>

#include "fbvins/flight/socket_sender.hpp"
#include "fbvins/live/host_clock.hpp"
#include "fbvins/live/latency_histogram.hpp"
#include "fbvins/live/live_system.hpp"
#include "fbvins/live/socket_source.hpp"

namespace fbvins {
namespace {

/// Collects estimates until they are taken.
class Inbox {
 public:
  void sent_image(Time t) {
    const std::lock_guard lock(mutex_);
    sent_.push_back({t, host_now()});
  }
  void add(const Odometry& odometry) {
    const std::lock_guard lock(mutex_);
    known_.push_back({odometry, {}});
    while (!sent_.empty() && sent_.front().first < odometry.t) sent_.pop_front();  // dropped
    if (!sent_.empty() && sent_.front().first == odometry.t) answers_.add(host_now() - sent_.front().second);
  }
  void add(const MapUpdate& update) {
    const std::lock_guard lock(mutex_);
    updates_.push_back(update);
  }
  /// Map updates go with the newest estimate.
  std::vector<KnownEstimate> take() {
    const std::lock_guard lock(mutex_);
    if (!known_.empty()) known_.back().updates = std::exchange(updates_, {});
    return std::exchange(known_, {});
  }
  LatencySummary answers() const { return answers_.summary(); }

 private:
  std::mutex mutex_;
  std::deque<std::pair<Time, Time>> sent_;  ///< stamps of images, and the times when they were sent
  LatencyHistogram answers_;
  std::vector<KnownEstimate> known_;
  std::vector<MapUpdate> updates_;
};

class InboxSink final : public Sink {
 public:
  explicit InboxSink(Inbox& inbox) : inbox_(inbox) {}
  std::string_view name() const override { return "the vehicle's controller"; }
  Result<void> take(const LiveEvent& event) override {
    if (const auto* odometry = std::get_if<Odometry>(&event)) inbox_.add(*odometry);
    if (const auto* update = std::get_if<MapUpdate>(&event)) inbox_.add(*update);
    return {};
  }

 private:
  Inbox& inbox_;
};

/// Ties simulated time to the machine's clock.
class Pace {
 public:
  explicit Pace(double rate) : rate_(rate) {}
  void wait_for(Time t) {
    const Time now = host_now();
    if (!first_) first_ = {t, now};
    const Time due = first_->second + Duration::from_seconds((t - first_->first).seconds() / rate_);
    if (due > now) std::this_thread::sleep_for(std::chrono::nanoseconds((due - now).ns));
    else behind_s_ = std::max(behind_s_, (now - due).seconds());
  }
  double rate() const { return rate_; }
  double behind_s() const { return behind_s_; }

 private:
  double rate_;
  std::optional<std::pair<Time, Time>> first_;
  double behind_s_ = 0;
};

std::string free_socket_path() {
  static int count = 0;
  return (std::filesystem::temp_directory_path() / fmt::format("fbvins-fly-{}-{}.sock", ::getpid(), count++)).string();
}

}  // namespace

struct LiveLink::Impl {
  Impl(LiveSystem made, std::unique_ptr<SocketSource> listening, double rate)
      : live(std::move(made)), source(std::move(listening)), pace(rate) {}
  ~Impl() { (void)finish(); }

  Result<void> finish() {
    source->stop();
    if (delivery.joinable()) delivery.join();
    const Result<void> done = live.finish();
    return delivered ? done : delivered;
  }

  Inbox inbox;
  LiveSystem live;
  std::unique_ptr<SocketSource> source;
  std::unique_ptr<SocketSender> sender;
  Pace pace;
  std::thread delivery;
  Result<void> delivered;
};

Result<std::unique_ptr<OdometryLink>> LiveLink::create(const EstimatorSetup& setup, const LiveOptions& options,
                                                       const StereoRig& rig, double rate) {
  Result<LiveSystem> live = LiveSystem::create(setup.options, options, rig, rate, {.mapper = setup.mapper});
  if (!live) return live.error();
  if (setup.on_tracked_frame) live->on_tracked_frame(setup.on_tracked_frame);
  const std::string path = free_socket_path();
  Result<std::unique_ptr<SocketSource>> source = SocketSource::open(path, {.rig = rig});
  if (!source) return source.error();
  auto impl = std::make_unique<Impl>(*std::move(live), *std::move(source), rate);
  Impl* to = impl.get();
  to->live.add_sink(std::make_unique<InboxSink>(to->inbox));
  to->delivery = std::thread([to] { to->delivered = to->source->run(to->live.input()); });
  Result<std::unique_ptr<SocketSender>> sender = SocketSender::connect(path, rig);
  if (!sender) return sender.error();
  to->sender = *std::move(sender);
  return std::unique_ptr<OdometryLink>(new LiveLink(std::move(impl)));
}

LiveLink::LiveLink(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LiveLink::~LiveLink() = default;

Result<void> LiveLink::push(SensorEvent event) {
  return std::visit(Overloaded{[this](const StereoFrame& frame) {
                                 impl_->inbox.sent_image(frame.t);
                                 return impl_->sender->send(frame);
                               },
                               [this](const ImuSample& reading) {
                                 impl_->pace.wait_for(reading.t);
                                 return impl_->sender->send(reading);
                               },
                               [this](const AidingSample& reading) { return impl_->sender->send(reading); }},
                    event);
}

Result<std::vector<KnownEstimate>> LiveLink::known_at(Time /*newest_image*/) { return impl_->inbox.take(); }

Result<void> LiveLink::finish() { return impl_->finish(); }

std::optional<WallTime> LiveLink::wall_time() const {
  return WallTime{impl_->pace.rate(), impl_->pace.behind_s(), impl_->inbox.answers(), impl_->live.status()};
}

}  // namespace fbvins
