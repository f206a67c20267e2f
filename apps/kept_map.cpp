// SPDX-License-Identifier: Apache-2.0
#include "apps/kept_map.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <utility>

#include "apps/terminal.hpp"
#include "fbvins/loop/map_journal.hpp"

namespace fbvins::app {
namespace {

constexpr Duration kWritePeriod{30'000'000'000};

/// The file, with the journal that belongs to it.
Result<std::string> set_map_aside(const std::string& file) {
  Result<std::string> aside = set_aside(file);
  if (aside) (void)std::rename(journal_of(file).c_str(), journal_of(*aside).c_str());
  return aside;
}

/// Whether the file is out of the way.
bool make_room(const std::string& file, const std::string& problem) {
  const Result<std::string> aside = set_map_aside(file);
  if (aside) warn(fmt::format("{}; it is kept as {}, and the flight begins a new map", problem, *aside));
  else warn(fmt::format("{}; {}: the flight's map will not be written", problem, aside.error().message));
  return aside.ok();
}

}  // namespace

KeptMap::KeptMap(Mapper& map, Source bytes, std::string file, WriteFile write)
    : map_(map), bytes_(std::move(bytes)), file_(std::move(file)), writer_(std::move(write)) {}

MapUpdate KeptMap::process(const Keyframe& keyframe) {
  if (const auto act = (std::lock_guard(mutex_), std::exchange(to_be_done_, nullptr))) act();
  MapUpdate update = map_.process(keyframe);
  if (update.found) note("the flight knows where it is in the map");
  if (!writer_.idle()) return update;
  if (std::vector<Told> wanted = (std::lock_guard(mutex_), std::exchange(wanted_, {})); !wanted.empty()) {
    write(requested_file_, [wanted = std::move(wanted)](const Result<void>& saved) {
      for (const Told& told : wanted) told(saved);
    });
  } else if (due(keyframe.t)) {
    write(file_, [this](const Result<void>& saved) {
      if (!saved && !warned_) warn(saved.error().message);
      warned_ = !saved;
    });
  }
  return update;
}

void KeptMap::write(const std::string& file, const Told& told) {
  const bool kept = !file_.empty() && file == file_;
  Result<std::string> bytes = kept ? bytes_.news(lost_) : bytes_.whole();
  if (!bytes) return told(bytes.error());
  if (bytes->empty()) return told({});
  writer_.write(file, *std::move(bytes), [this, kept, told](const Result<void>& saved) {
    if (kept) lost_ = !saved;
    told(saved);
  });
}

void KeptMap::finish() {
  wait();
  const std::lock_guard lock(mutex_);
  for (const Told& told : std::exchange(wanted_, {}))
    told(Error{ErrorCode::unwritable, "the flight ended before its next keyframe"});
  to_be_done_ = nullptr;
}

bool KeptMap::request_save(Told told) {
  constexpr std::size_t kMostWaiting = 100;
  const std::lock_guard lock(mutex_);
  if (wanted_.size() >= kMostWaiting) return false;
  wanted_.push_back(std::move(told));
  return true;
}

bool KeptMap::before_next_keyframe(std::function<void()> act) {
  const std::lock_guard lock(mutex_);
  if (to_be_done_) return false;
  to_be_done_ = std::move(act);
  return true;
}

bool KeptMap::due(Time t) {
  if (file_.empty()) return false;
  if (written_ == Time{}) written_ = t;
  if (t - written_ < kWritePeriod) return false;
  written_ = t;
  return true;
}

void retire_kept_map(const std::string& file, const std::string& damage) {
  const Result<std::string> aside = set_map_aside(file);
  if (aside) warn(fmt::format("{}; it is kept as {}, and the next flight begins a new map", damage, *aside));
  else warn(fmt::format("{}; {}", damage, aside.error().message));
}

Result<std::unique_ptr<LoopMap>> make_kept_map(MapArguments& arguments, const StereoRig& rig, const LoopOptions& options) {
  auto map = make_map(arguments, rig, options);
  if (map) return map;
  const Error problem = map.error();
  MapArguments other = arguments;
  if (problem.code == ErrorCode::unwritable) {  // no folder for it
    warn(problem.message + ": the flight's map will not be written");
    other.save.clear();
    other.load.clear();
    other.loop = true;
  } else {
    if (arguments.load.empty()) return problem;
    other.load.clear();
  }
  map = make_map(other, rig, options);
  if (!map) return problem;  // not the old file's fault
  if (problem.code != ErrorCode::unwritable && !make_room(arguments.load, problem.message)) {
    other.loop = true;
    other.save.clear();
  }
  arguments = other;
  return map;
}

}  // namespace fbvins::app
