// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/replay_source.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <utility>

namespace fbvins {
namespace {

/// Stereo frames decoded ahead: enough for a disk that stutters.
constexpr int kDecodedAhead = 40;
constexpr double kSlowest = 0.01, kFastest = 100;

}  // namespace

Result<std::unique_ptr<ReplaySource>> ReplaySource::open(const std::string& where, DatasetOptions options) {
  const auto at = where.rfind('@');
  double speed = 1;
  if (at != std::string::npos) {
    char* end = nullptr;
    speed = std::strtod(where.c_str() + at + 1, &end);
    if (end == where.c_str() + at + 1 || *end != '\0' || !(speed >= kSlowest && speed <= kFastest))
      return Error{ErrorCode::invalid_argument,
                   fmt::format("replay:{}: after @ comes a speed from {} to {}", where, kSlowest, kFastest)};
  }
  options.prefetch_frames = kDecodedAhead;
  auto data = open_dataset(where.substr(0, at), options);
  if (!data) return data.error();
  return std::unique_ptr<ReplaySource>(new ReplaySource(std::move(*data), speed));
}

Result<void> ReplaySource::run(SensorInput& input) {
  using std::chrono::steady_clock;
  std::optional<SensorEvent> event = data_->next();  // the first images are decoded before the clock starts
  if (!event) return {};
  const auto stamp = [](const SensorEvent& e) { return std::visit([](const auto& x) { return x.t; }, e); };
  const Time first = stamp(*event);
  const std::int64_t start_ns = steady_clock::now().time_since_epoch().count();
  for (; event; event = data_->next()) {
    const double since_first_s = (stamp(*event) - first).seconds() / speed_;
    if (!wait_until(start_ns + Duration::from_seconds(since_first_s).ns)) return {};
    std::visit([&](auto& e) { input.push(std::move(e)); }, *event);
  }
  return {};
}

bool ReplaySource::wait_until(std::int64_t host_ns) {
  const std::chrono::steady_clock::time_point due{std::chrono::nanoseconds(host_ns)};
  std::unique_lock lock(mutex_);
  stopped_changed_.wait_until(lock, due, [&] { return stopped_; });
  return !stopped_;
}

void ReplaySource::stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  stopped_changed_.notify_all();
}

}  // namespace fbvins
