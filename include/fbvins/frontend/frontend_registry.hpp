// SPDX-License-Identifier: Apache-2.0
// Frontends of your own under a name, for --frontend, configuration files and make_frontend(). To be called before others
// use the names: not thread-safe.
//
//   register_frontend({"dots", "centres of printed dots", [](const StereoRig& rig, const FrontendOptions&) {
//     return for_any_rig(rig, 150, [](const StereoRig& r) { return std::make_unique<DotFrontend>(r); });
//   }});
//   load_frontends("libdots.so");   // the same from a plugin (frontend_plugin.hpp)
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/frontend/frontend.hpp"

namespace fbvins {

struct FrontendOptions;

/// A frontend for a rig; an error where the options do not fit, or something that it needs is not there.
using MakeFrontend = std::function<Result<std::unique_ptr<Frontend>>(const StereoRig& rig, const FrontendOptions& options)>;

struct FrontendKind {
  std::string name;     ///< letters, digits, '-' and '_'
  std::string meaning;  ///< a phrase for the help of options
  MakeFrontend make;
};

/// An error where the name is taken, or is none.
Result<void> register_frontend(FrontendKind kind);

/// Loads a shared library and registers its frontends; it stays loaded. An error where it cannot be loaded, is no plugin, or was
/// built with other headers than this library.
Result<void> load_frontends(const std::string& plugin);

}  // namespace fbvins
