// SPDX-License-Identifier: Apache-2.0
// Path of a file that ships with the project: weights, vocabularies. Only reads the file system; any thread.
//
//   std::string path = data_file("boost-s.safetensors");
#pragma once

#include <string>

namespace fbvins {

/// In the folder `data` beside the program or library that this is linked into (a Python package is one), else where it was
/// installed, else in the sources it was built from; this path is returned, too, where the file does not exist.
std::string data_file(const std::string& name);

}  // namespace fbvins
