// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/data_file.hpp"

#include <dlfcn.h>
#include <unistd.h>

namespace fbvins {
namespace {

/// The folder of the program or shared library that holds this function; "." where its name has no folder.
std::string own_folder() {
  Dl_info self{};
  if (dladdr(reinterpret_cast<const void*>(&own_folder), &self) == 0 || self.dli_fname == nullptr) return ".";
  const std::string path = self.dli_fname;
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? "." : path.substr(0, slash);
}

bool exists(const std::string& path) { return access(path.c_str(), R_OK) == 0; }

}  // namespace

std::string data_file(const std::string& name) {
  // In the Python package the programs lie in a folder beside the data.
  for (const std::string& path :
       {own_folder() + "/data/" + name, own_folder() + "/../data/" + name, FBVINS_INSTALLED_DATA "/" + name})
    if (exists(path)) return path;
  return FBVINS_SOURCE_DATA "/" + name;
}

}  // namespace fbvins
