// SPDX-License-Identifier: Apache-2.0
// Types that only the Python package has.
#pragma once

#include <memory>

#include "fbvins/eval/association.hpp"
#include "fbvins/io/dataset.hpp"
#include "fbvins/loop/loop_map.hpp"

namespace fbvins::python {

using Recording = std::unique_ptr<Dataset>;

/// A trajectory in any world: Python's types have no frames.
struct PyTrajectory : AnyTrajectory {
  using AnyTrajectory::AnyTrajectory;
};

/// A LoopMap that Python can derive from.
struct PyMap {
  std::unique_ptr<LoopMap> map;
};

}  // namespace fbvins::python
