// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/live_system.hpp"

#include <fmt/format.h>

#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include "fbvins/core/overloaded.hpp"
#include "fbvins/estimator/estimator_setup.hpp"
#include "fbvins/live/host_clock.hpp"
#include "fbvins/live/hub.hpp"
#include "fbvins/live/ingest.hpp"
#include "fbvins/live/latency_histogram.hpp"
#include "fbvins/live/live_estimate.hpp"
#include "fbvins/live/view_maker.hpp"

namespace fbvins {
namespace {

constexpr Duration kWatchPeriod = Duration::from_seconds(0.02);
constexpr Duration kStatusPeriod = Duration::from_seconds(1);
/// So long the status speaks of a clock that was set back.
constexpr Duration kToldFor = Duration::from_seconds(5);

}  // namespace

// sensors' threads -> Ingest -[one waiting image, all readings]-> feeder -> System -> Odometry
//                       '-[each reading, at once]-> LiveEstimate -> LivePose          '-> LiveEstimate
//                                                                     all of it -> Hub -> sinks
// While the IMU is silent the estimates of the images are the LivePoses.
struct LiveSystem::Impl {
  Impl(const SystemOptions& system_options, const LiveOptions& options, const StereoRig& rig, double clock_rate,
       std::uint32_t first_reset_counter, System made)
      : first_reset(first_reset_counter),
        ingest(
            clock_rate, host_now, [this](const ImuSample& s, Time host_t) { on_reading(s, host_t); }, rig.imu_noise,
            Duration::from_seconds(rig.time_offset_s), rig.camera_count()),
        system(std::move(made)),
        estimate(PosePropagator(assumed_noise(rig.imu_noise, system_options.estimator), Duration::from_seconds(rig.time_offset_s),
                                options.smoothing_s, system_options.estimator.gravity_mps2),
                 SensorWatch(options, system_options.estimator), first_reset_counter, host_now()),
        views(rig) {
    system.on_tracked_frame([this](const TrackedFrame& f) { on_frame(f); });
    system.on_window([this](const WindowSnapshot& window) { views.add(window); }, [this] { return views_wanted; });
    system.on_odometry([this](Odometry o) { on_odometry(std::move(o)); });
    system.on_map_update([this](MapUpdate u) {
      u.reset_counter += first_reset;
      hub.publish(std::move(u));
    });
  }
  ~Impl() { (void)finish(); }

  // Readings and estimates.

  void on_reading(const ImuSample& sample, Time host_t) {
    if (std::optional<LivePose> pose = estimate.add(sample, host_t)) hub.publish(*std::move(pose));
  }

  void on_frame(const TrackedFrame& frame) {
    if (on_tracked_frame) on_tracked_frame(frame);
    views_wanted = hub.wants_views();
    if (views_wanted) views.add(frame);
  }

  void on_odometry(Odometry o) {
    o.reset_counter += first_reset;
    const Time image_host_t = ingest.host_of(o.t);
    const Duration latency = host_now() - image_host_t;
    shutter_to_pose.add(latency);
    if (std::optional<LivePose> pose = estimate.add(o, image_host_t)) hub.publish(*std::move(pose));
    if (views_wanted) hub.publish(views.view_of(o, latency.seconds() * 1e3));
    hub.publish(std::move(o));
    look(false);
  }

  // Threads.

  void start() {
    if (std::exchange(running, true)) return;
    feeder = std::thread([this] { feed(); });
    watcher = std::thread([this] { watch_sensors(); });
  }

  void feed() {
    while (std::optional<SensorEvent> event = ingest.pop()) {
      std::visit(Overloaded{[this](const ImuSample& sample) { hub.publish(sample); },
                            [this](const StereoFrame& frame) { hub.publish(frame); },
                            [this](const AidingSample& reading) { hub.publish(reading); }},
                 *event);
      for (Anchor& anchor : ingest.take_anchors()) (void)system.push(std::move(anchor));  // impossible ones are left out
      if (Result<void> taken = system.push(std::move(*event)); !taken) return;            // the watcher reports it
    }
  }

  void watch_sensors() {
    Time told = host_now();
    bool failed = false;
    std::unique_lock lock(end_mutex);
    while (!end.wait_for(lock, std::chrono::nanoseconds(kWatchPeriod.ns), [&] { return ended; })) {
      ingest.tick();
      const bool fails_now = !failed && !system.status();
      if (fails_now) {
        failed = true;
        ingest.close();
        if (on_failure) on_failure();
      }
      const Time now = host_now();
      const bool due = fails_now || now - told >= kStatusPeriod;
      if (due) told = now;
      look(due);
    }
  }

  /// Updates health; publishes a status if it has changed, or if `due`.
  void look(bool due) {
    const Ingest::Arrival arrivals = ingest.arrivals();
    const bool changed = estimate.judge(arrivals, host_now());
    if (changed || due) hub.publish(status());
  }

  LiveStatus status() {
    LiveStatus s;
    const Ingest::Arrival arrivals = ingest.arrivals();
    s.t = arrivals.newest;
    s.host_t = host_now();
    s.counts = ingest.counts();
    s.counts.keyframes_left_out = system.keyframes_left_out();
    s.shutter_to_pose = shutter_to_pose.summary();
    estimate.tell(s);
    for (const Hub::SinkReport& report : hub.reports()) {
      s.counts.events_lost += report.dropped;
      const std::string& problem = report.problem.empty() ? report.passing : report.problem;
      if (!problem.empty()) s.problem = report.name + ": " + problem;
      if (!report.figures.empty()) s.outputs.push_back({report.name, report.figures});
    }
    if (arrivals.set_back_at && s.host_t - *arrivals.set_back_at < kToldFor)
      s.problem = fmt::format("the sensors' clock was set back by {:.3f} s, or began again: the estimate begins anew",
                              arrivals.set_back.seconds());
    if (const Result<void> state = system.status(); !state) s.problem = state.error().message;
    return s;
  }

  Result<void> finish() {
    if (std::exchange(finished, true)) return result;
    {
      const std::lock_guard lock(end_mutex);
      ended = true;
      end.notify_all();
    }
    if (watcher.joinable()) watcher.join();  // first, so that silent sensors are not reported from here on
    ingest.close();
    if (feeder.joinable()) feeder.join();
    result = system.finish();
    hub.publish(status());
    const Result<void> sinks = hub.finish();
    if (result) result = sinks;
    return result;
  }

  std::uint32_t first_reset;  ///< what all outputs see is the System's counter plus this
  Hub hub;
  Ingest ingest;
  System system;
  LiveEstimate estimate;
  LatencyHistogram shutter_to_pose;

  ViewMaker views;            ///< used on the estimator's thread alone
  bool views_wanted = false;  ///< with this image; likewise
  std::function<void(const TrackedFrame&)> on_tracked_frame;
  std::function<void()> on_failure;

  std::thread feeder, watcher;
  std::mutex end_mutex;
  std::condition_variable end;
  bool ended = false, running = false, finished = false;
  Result<void> result;
};

Result<LiveSystem> LiveSystem::create(const SystemOptions& system, const LiveOptions& options, const StereoRig& rig,
                                      double clock_rate, SystemParts parts, std::uint32_t first_reset_counter) {
  if (Result<void> valid = validate(options); !valid) return valid.error();
  Result<System> made = System::create(system, rig, RunMode::live, std::move(parts));
  if (!made) return made.error();
  return LiveSystem(std::make_unique<Impl>(system, options, rig, clock_rate, first_reset_counter, std::move(*made)));
}

LiveSystem::LiveSystem(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LiveSystem::~LiveSystem() = default;
LiveSystem::LiveSystem(LiveSystem&&) noexcept = default;
LiveSystem& LiveSystem::operator=(LiveSystem&&) noexcept = default;

void LiveSystem::add_sink(std::unique_ptr<Sink> sink) { impl_->hub.add(std::move(sink)); }
void LiveSystem::on_tracked_frame(std::function<void(const TrackedFrame&)> callback) {
  impl_->on_tracked_frame = std::move(callback);
}

void LiveSystem::on_failure(std::function<void()> callback) { impl_->on_failure = std::move(callback); }

void LiveSystem::push_of_host(AidingSample reading) {
  const Time image = impl_->ingest.arrivals().newest;
  if (image.ns == 0) return;
  stamp_of(reading) = stamp_of(reading) + (image - impl_->ingest.host_of(image));
  impl_->ingest.push_corrected(std::move(reading));
}

SensorInput& LiveSystem::input() {
  impl_->start();
  return impl_->ingest;
}

void LiveSystem::start_again() { impl_->system.start_again(); }
void LiveSystem::mark(std::string text) { impl_->hub.publish(LiveMark{impl_->ingest.arrivals().newest, std::move(text)}); }
LiveStatus LiveSystem::status() const { return impl_->status(); }
Result<void> LiveSystem::finish() { return impl_->finish(); }

}  // namespace fbvins
