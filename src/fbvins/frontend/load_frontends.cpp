// SPDX-License-Identifier: Apache-2.0
#include <dlfcn.h>
#include <fmt/format.h>

#include "fbvins/frontend/frontend_plugin.hpp"

namespace fbvins {
namespace {

Error refused(const std::string& plugin, const std::string& why) {
  return {ErrorCode::invalid_argument, fmt::format("{}: {}", plugin, why)};
}

}  // namespace

Result<void> load_frontends(const std::string& plugin) {
  // A name without a slash would be looked for where the system keeps its libraries.
  const std::string path = plugin.find('/') == std::string::npos ? "./" + plugin : plugin;
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return refused(plugin, fmt::format("the plugin cannot be loaded: {}", dlerror()));
  const auto headers = reinterpret_cast<const char* (*)()>(dlsym(library, "fbvins_plugin_headers"));
  const auto frontends = reinterpret_cast<void (*)(const AddFrontend&)>(dlsym(library, "fbvins_plugin_frontends"));
  if (headers == nullptr || frontends == nullptr) return refused(plugin, "no plugin: it has no FBVINS_FRONTENDS (docs/cpp.md)");
  if (const std::string theirs = headers(); theirs != plugin_headers())
    return refused(plugin,
                   fmt::format("built with other headers or another compiler: '{}', here '{}'", theirs, plugin_headers()));
  Result<void> registered;
  frontends([&](FrontendKind kind) {
    Result<void> one = register_frontend(std::move(kind));
    if (!one && registered) registered = refused(plugin, one.error().message);
  });
  return registered;
}

}  // namespace fbvins
