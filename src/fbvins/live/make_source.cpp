// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/make_source.hpp"

#include <fmt/format.h>

#include <utility>

#include "fbvins/live/replay_source.hpp"
#include "fbvins/live/socket_source.hpp"
#include "fbvins/live/source_rig.hpp"

namespace fbvins {
namespace {

Result<std::unique_ptr<Source>> make_socket_source(const std::string& path, const SourceOptions& options) {
  SocketOptions socket{.say = options.say, .give_up = options.give_up, .group = options.socket_group};
  if (options.dataset.brings_rig()) {
    const auto rig = given_rig(options.dataset);
    if (!rig) return rig.error();
    socket.rig = *rig;
  } else {
    socket.rig = options.uncalibrated;
  }
  auto source = SocketSource::open(path, std::move(socket));
  if (!source) return source.error();
  return std::unique_ptr<Source>(std::move(*source));
}

}  // namespace

Result<std::unique_ptr<Source>> make_source(const std::string& name, const SourceOptions& options) {
  const auto colon = name.find(':');
  const std::string kind = name.substr(0, colon), where = colon == std::string::npos ? "" : name.substr(colon + 1);
  if (kind == "replay" && !where.empty()) {
    auto source = ReplaySource::open(where, {.dataset = options.dataset, .laps = options.laps, .preload = options.preload});
    if (!source) return source.error();
    return std::unique_ptr<Source>(std::move(*source));
  }
  if (kind == "socket" && !where.empty()) return make_socket_source(where, options);
  return Error{ErrorCode::invalid_argument, fmt::format("source '{}': it is replay:DATASET[@SPEED] or socket:PATH", name)};
}

}  // namespace fbvins
