// SPDX-License-Identifier: Apache-2.0
// What a configuration file holds: the odometry's options, and loop closure's beside them.
#pragma once

#include "fbvins/loop/loop_options.hpp"
#include "fbvins/pipeline/system_options.hpp"

namespace fbvins {

struct Config : SystemOptions {
  LoopOptions loop;

  template <class V>
  void visit(V&& v) {
    SystemOptions::visit(v);
    v.group("loop", loop, "loop closure, where it is asked for");
  }
};

}  // namespace fbvins
