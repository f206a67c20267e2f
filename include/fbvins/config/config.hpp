// SPDX-License-Identifier: Apache-2.0
// The contents of a configuration file: the options of the odometry, of loop closure and of live sensors.
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
    v.group("loop", loop, "loop closure, if it is switched on");
    v.group("live", live, "sensors in wall time (fbvins live)");
  }
};

}  // namespace fbvins
