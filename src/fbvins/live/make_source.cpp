// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/make_source.hpp"

#include <fmt/format.h>

#include <utility>

#include "fbvins/live/replay_source.hpp"

namespace fbvins {

Result<std::unique_ptr<Source>> make_source(const std::string& name, const SourceOptions& options) {
  const auto colon = name.find(':');
  const std::string kind = name.substr(0, colon), where = colon == std::string::npos ? "" : name.substr(colon + 1);
  if (kind == "replay" && !where.empty()) {
    auto source = ReplaySource::open(where, options.dataset);
    if (!source) return source.error();
    return std::unique_ptr<Source>(std::move(*source));
  }
  return Error{ErrorCode::invalid_argument, fmt::format("source '{}': it is replay:DATASET[@SPEED]", name)};
}

}  // namespace fbvins
