// SPDX-License-Identifier: Apache-2.0
// What a configuration file holds: the odometry's options, and those of loop closure and of live sensors beside them.
#pragma once

#include "fbvins/live/live_options.hpp"
#include "fbvins/loop/loop_options.hpp"
#include "fbvins/pipeline/system_options.hpp"

namespace fbvins {

struct Config : SystemOptions {
  LoopOptions loop;
  LiveOptions live;

  template <class V>
  void visit(V&& v) {
    SystemOptions::visit(v);
    v.group("loop", loop, "loop closure, where it is asked for");
    v.group("live", live, "sensors in wall time (fbvins live)");
  }
};

}  // namespace fbvins
