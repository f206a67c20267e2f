// SPDX-License-Identifier: Apache-2.0
// The compiled part of the package `fbvins`; the rest is in python/fbvins.
#include "bindings.hpp"

NB_MODULE(_fbvins, m) {
  using namespace fbvins::python;
  m.doc() = "Stereo visual-inertial odometry: the compiled part of fbvins.";
  m.attr("__version__") = FBVINS_VERSION;
  bind_rig(m);
  bind_config(m);
  bind_aiding(m);
  bind_recording(m);
  bind_trajectory(m);
  bind_frontend(m);
  bind_odometry(m);
  bind_map(m);
  bind_system(m);
  bind_run(m);
  bind_features(m);
  bind_tools(m);
}
