// SPDX-License-Identifier: Apache-2.0
// Devices whose maker has a library for Python (docs/devices.md): the program that reads one of them is started here, sends over
// a private socket, and ends with this source.
//
//   if (is_bridged("oak")) return open_bridged("oak", "640x400@20", options);
#pragma once

#include <memory>
#include <string>

#include "fbvins/live/make_source.hpp"

namespace fbvins::app {

/// d435i and realsense, oak, orbbec, zed.
bool is_bridged(const std::string& kind);

/// `where`: [DEVICE][:WIDTHxHEIGHT[@HZ]] as `kind` has it. Waits for the device until `options.give_up`; the program's failure
/// before it has sent anything, a package that is not installed for one, is an error.
Result<std::unique_ptr<Source>> open_bridged(const std::string& kind, const std::string& where, const SourceOptions& options);

/// The folder of the programs: FBVINS_BRIDGES, else beside this program, where it was installed, or in the sources.
Result<std::string> bridge_script(const std::string& name);

}  // namespace fbvins::app
