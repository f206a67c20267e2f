// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/hub.hpp"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "fbvins/pipeline/stage_runner.hpp"

namespace fbvins {
namespace {

using SharedEvent = std::shared_ptr<const LiveEvent>;

bool is_image(const SharedEvent& event) { return std::holds_alternative<StereoFrame>(*event); }

}  // namespace

/// A sink, its queue and its thread.
class Hub::SinkQueue {
 public:
  SinkQueue(std::unique_ptr<Sink> sink, Limits limits) : sink_(std::move(sink)), limits_(limits) {
    report_.name = sink_->name();
    thread_ = std::thread([this] { work(); });
  }
  ~SinkQueue() { finish(); }

  void put(const SharedEvent& event) {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    if (is_image(event) && ++images_ > limits_.images) drop_oldest_image();
    if (queue_.size() >= limits_.events) drop(queue_.begin());
    queue_.push_back(event);
    filled_.notify_one();
  }

  bool wants_views() const { return sink_->wants_views(); }

  SinkReport report() const {
    std::string passing = sink_->problem();
    std::vector<OutputFigure> figures = sink_->figures();
    const std::lock_guard lock(mutex_);
    SinkReport report = report_;
    report.passing = std::move(passing);
    report.figures = std::move(figures);
    return report;
  }

  void finish() {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
      filled_.notify_one();
    }
    if (thread_.joinable()) thread_.join();
  }

 private:
  void drop(std::deque<SharedEvent>::iterator event) {
    if (is_image(*event)) --images_;
    queue_.erase(event);
    ++report_.dropped;
  }
  void drop_oldest_image() {
    const auto oldest = std::find_if(queue_.begin(), queue_.end(), is_image);
    if (oldest != queue_.end()) drop(oldest);
  }

  void work() {
    while (const SharedEvent event = next()) note(guarded_call([&] { return sink_->take(*event); }));
    note(guarded_call([&] { return sink_->finish(); }));
  }

  SharedEvent next() {
    std::unique_lock lock(mutex_);
    filled_.wait(lock, [&] { return closed_ || !queue_.empty(); });
    if (queue_.empty()) return nullptr;
    SharedEvent event = std::move(queue_.front());
    queue_.pop_front();
    if (is_image(event)) --images_;
    ++report_.taken;
    return event;
  }

  /// An exception of a sink becomes its error.
  template <class Call>
  Result<void> guarded_call(const Call& call) {
    Result<void> result;
    const Result<void> ran = guarded(report_.name.c_str(), [&] { result = call(); });
    return ran ? result : ran;
  }

  void note(const Result<void>& result) {
    if (result) return;
    const std::lock_guard lock(mutex_);
    if (report_.problem.empty()) report_.problem = result.error().message;
  }

  std::unique_ptr<Sink> sink_;
  Limits limits_;
  mutable std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<SharedEvent> queue_;
  std::size_t images_ = 0;
  bool closed_ = false;
  SinkReport report_;
  std::thread thread_;
};

Hub::Hub(Limits limits) : limits_(limits) {}
Hub::~Hub() = default;

void Hub::add(std::unique_ptr<Sink> sink) { queues_.push_back(std::make_unique<SinkQueue>(std::move(sink), limits_)); }

bool Hub::wants_views() const {
  return std::any_of(queues_.begin(), queues_.end(), [](const auto& queue) { return queue->wants_views(); });
}

void Hub::publish(LiveEvent event) {
  if (queues_.empty()) return;
  const auto shared = std::make_shared<const LiveEvent>(std::move(event));
  for (const auto& queue : queues_) queue->put(shared);
}

std::vector<Hub::SinkReport> Hub::reports() const {
  std::vector<SinkReport> reports;
  for (const auto& queue : queues_) reports.push_back(queue->report());
  return reports;
}

Result<void> Hub::finish() {
  for (const auto& queue : queues_) queue->finish();
  for (const SinkReport& report : reports())
    if (!report.problem.empty()) return Error{ErrorCode::stage_failed, report.name + ": " + report.problem};
  return {};
}

}  // namespace fbvins
