// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/signing_time.hpp"

#include <fmt/format.h>

#include <chrono>
#include <fstream>
#include <utility>

namespace fbvins {
namespace {

constexpr std::uint64_t kAhead = 6'000'000, kRefresh = kAhead / 2;  // a minute, in tens of microseconds
constexpr std::uint64_t kTimeLimit = std::uint64_t{1} << 48;

}  // namespace

SigningTime::SigningTime(std::string file, WriteFile write) : file_(std::move(file)), write_(std::move(write)) {
  std::uint64_t time = 0;
  if (std::ifstream(file_) >> time && time < kTimeLimit) reserved_ = time;
}

bool SigningTime::keep(std::uint64_t time) {
  if (pending_.valid()) {
    if (pending_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return kept_;
    kept_ = pending_.get();
  }
  // After a failure it is tried again when the next write would be due.
  if (time + kRefresh < reserved_) return kept_;
  reserved_ = time + kAhead;
  pending_ = std::async(std::launch::async,
                        [write = write_, file = file_, text = fmt::format("{}\n", reserved_)] { return write(file, text).ok(); });
  return kept_;
}

}  // namespace fbvins
