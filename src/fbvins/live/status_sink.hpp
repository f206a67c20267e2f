// SPDX-License-Identifier: Apache-2.0
// The state of a live system as one JSON object a line, for programs and people: whenever health changes, and once a
// second. The fields are in docs/live.md.
#pragma once

#include <cstdio>
#include <string>

#include "fbvins/live/sink.hpp"

namespace fbvins {

/// One line without its end.
std::string to_json_line(const LiveStatus& status, const LivePose& newest);

class StatusSink final : public Sink {
 public:
  /// `file` stays the caller's.
  explicit StatusSink(std::FILE* file) : file_(file) {}
  std::string_view name() const override { return "status"; }
  Result<void> take(const LiveEvent& event) override;

 private:
  std::FILE* file_;
  LivePose newest_;
};

}  // namespace fbvins
