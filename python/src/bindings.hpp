// SPDX-License-Identifier: Apache-2.0
// The parts of the module fbvins._fbvins, one function each.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"

namespace fbvins::python {

using namespace nanobind::literals;  // NOLINT: "name"_a of nanobind's

void bind_rig(nb::module_& m);
void bind_config(nb::module_& m);
void bind_aiding(nb::module_& m);
void bind_recording(nb::module_& m);
void bind_trajectory(nb::module_& m);
void bind_frontend(nb::module_& m);
void bind_odometry(nb::module_& m);
void bind_system(nb::module_& m);
void bind_map(nb::module_& m);
void bind_run(nb::module_& m);
void bind_features(nb::module_& m);
void bind_tools(nb::module_& m);

}  // namespace fbvins::python
