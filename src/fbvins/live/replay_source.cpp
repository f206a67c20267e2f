// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/replay_source.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <utility>

namespace fbvins {
namespace {

/// Stereo frames decoded ahead, against delays of the disk.
constexpr int kDecodedAhead = 40;
constexpr double kSlowest = 0.01, kFastest = 100;

}  // namespace

Result<std::unique_ptr<ReplaySource>> ReplaySource::open(const std::string& where, Options options) {
  auto at = where.rfind('@');
  if (at != std::string::npos && where.find('/', at) != std::string::npos) at = std::string::npos;  // part of a folder's name
  double speed = 1;
  if (at != std::string::npos) {
    char* end = nullptr;
    speed = std::strtod(where.c_str() + at + 1, &end);
    if (end == where.c_str() + at + 1 || *end != '\0' || !(speed >= kSlowest && speed <= kFastest))
      return Error{ErrorCode::invalid_argument,
                   fmt::format("replay:{}: after @ comes a speed from {} to {}", where, kSlowest, kFastest)};
  }
  options.dataset.prefetch_frames = kDecodedAhead;
  auto data = options.open_file(where.substr(0, at), options.dataset);
  if (!data) return data.error();
  return std::unique_ptr<ReplaySource>(new ReplaySource(where.substr(0, at), std::move(options), std::move(*data), speed));
}

ReplaySource::ReplaySource(std::string path, Options options, std::unique_ptr<Dataset> data, double speed)
    : path_(std::move(path)), options_(std::move(options)), data_(std::move(data)), speed_(speed) {
  if (!options_.preload) return;
  while (auto event = data_->next()) loaded_.push_back(std::move(*event));
}

Result<void> ReplaySource::run(SensorInput& input) {
  Duration later;
  for (int lap = 0; lap < options_.laps; ++lap) {
    if (lap > 0) {
      if (!newest_) return {};  // nothing is recorded
      later = *newest_ - *first_ + Duration::from_seconds(1 / data_->rig().image_rate_hz);
      if (!options_.preload) {
        auto again = options_.open_file(path_, options_.dataset);
        if (!again) return again.error();
        data_ = std::move(*again);
      }
    }
    std::size_t k = 0;
    const auto from_memory = [&] { return k < loaded_.size() ? std::optional(loaded_[k++]) : std::nullopt; };
    const auto from_disk = [&] { return data_->next(); };
    if (!(options_.preload ? play(input, later, from_memory) : play(input, later, from_disk))) return {};
  }
  return {};
}

bool ReplaySource::play(SensorInput& input, Duration later, const std::function<std::optional<SensorEvent>()>& next) {
  std::optional<SensorEvent> event = next();  // the first images are decoded before the clock starts
  for (; event; event = next()) {
    Time& t = stamp_of(*event);
    t = t + later;
    if (!first_) {
      first_ = t;
      start_ns_ = std::chrono::steady_clock::now().time_since_epoch().count();
    }
    if (!wait_until(start_ns_ + Duration::from_seconds((t - *first_).seconds() / speed_).ns)) return false;
    newest_ = t;
    push_event(input, *std::move(event));
  }
  return true;
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
