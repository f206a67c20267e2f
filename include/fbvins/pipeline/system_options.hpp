// SPDX-License-Identifier: Apache-2.0
// Everything about the odometry that can be configured, with defaults.
#pragma once

#include "fbvins/estimator/estimator_options.hpp"
#include "fbvins/frontend/frontend_options.hpp"

namespace fbvins {

struct SystemOptions {
  FrontendOptions frontend;
  EstimatorOptions estimator;

  template <class V>
  void visit(V&& v) {
    v.group("frontend", frontend, "features and their tracks");
    v.group("estimator", estimator, "sliding window");
  }
};

}  // namespace fbvins
