// SPDX-License-Identifier: Apache-2.0
// A shared library with frontends of your own, for programs that were built without it (docs/cpp.md):
//
//   FBVINS_FRONTENDS(add) {
//     add({"dots", "centres of printed dots", [](const fbvins::StereoRig& rig, const fbvins::FrontendOptions&) { return ...; }});
//   }
//
//   fbvins run MH_01_easy --plugin ./libdots.so --frontend dots
//
// The library is linked with fbvins::core itself. Compiler, standard library and headers have to be those of the program: C++
// objects cross the border. plugin_headers() is compared, what it does not see is the builder's care.
#pragma once

#include <string>

#include "fbvins/frontend/frontend_options.hpp"
#include "fbvins/frontend/frontend_registry.hpp"

namespace fbvins {

using AddFrontend = std::function<void(FrontendKind)>;

/// What has to be the same on both sides: the version of the interface, the compiler's and the sizes of what crosses the border.
inline std::string plugin_headers() {
  std::string out = "fbvins frontends 1, " __VERSION__;
  for (const std::size_t size : {sizeof(StereoRig), sizeof(SensorPacket), sizeof(StatePrior), sizeof(TrackedFrame),
                                 sizeof(TrackedFeature), sizeof(FrontendOptions), sizeof(FrontendKind)})
    out += ' ' + std::to_string(size);
  return out;
}

}  // namespace fbvins

/// The function that registers a plugin's frontends; its body follows.
#define FBVINS_FRONTENDS(add)                                                             \
  extern "C" __attribute__((visibility("default"))) const char* fbvins_plugin_headers() { \
    static const std::string headers = fbvins::plugin_headers();                          \
    return headers.c_str();                                                               \
  }                                                                                       \
  extern "C" __attribute__((visibility("default"))) void fbvins_plugin_frontends(const fbvins::AddFrontend& add)
