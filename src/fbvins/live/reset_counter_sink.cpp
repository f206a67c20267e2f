// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/reset_counter_sink.hpp"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <optional>
#include <utility>

#include "fbvins/core/byte_source.hpp"

namespace fbvins {
namespace {

/// What flight controllers compare has eight bits (MAVLink's ODOMETRY).
constexpr std::uint32_t kDifferent = 256;
constexpr std::uint32_t kUnknown = 128;
constexpr std::uint64_t kLargestFile_bytes = 100;

bool exists(const std::string& file) {
  std::error_code ignored;
  return std::filesystem::exists(file, ignored);
}

std::optional<std::uint32_t> counter_in(const std::string& file) {
  const auto bytes = open_bytes(file);
  if (!bytes || (*bytes)->size() > kLargestFile_bytes) return std::nullopt;
  const std::string text = (*bytes)->read(0, (*bytes)->size());
  std::uint32_t last = 0;
  const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), last);
  if (wrong != std::errc() || end == text.data() + text.size() || *end != '\n') return std::nullopt;
  return last;
}

}  // namespace

ResetCounterSink::ResetCounterSink(std::string file, WriteFile write) : file_(std::move(file)), write_(std::move(write)) {
  const std::optional<std::uint32_t> last = counter_in(file_);
  unreadable_ = !last && exists(file_);
  if (last) first_ = (*last + 1) % kDifferent;
  else if (unreadable_) first_ = kUnknown;
  first_kept_ = keep(first_);
}

Result<void> ResetCounterSink::keep(std::uint32_t counter) {
  kept_ = counter;
  return write_(file_, fmt::format("{}\n", counter));
}

Result<void> ResetCounterSink::take(const LiveEvent& event) {
  if (!first_kept_) return std::exchange(first_kept_, {});
  if (const auto* update = std::get_if<MapUpdate>(&event)) map_.take(*update);
  const auto* pose = std::get_if<LivePose>(&event);
  if (!pose) return {};
  const std::uint32_t published = pose->reset_counter + map_.jumps();
  return published != kept_ ? keep(published) : Result<void>{};
}

}  // namespace fbvins
