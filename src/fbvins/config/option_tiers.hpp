// SPDX-License-Identifier: Apache-2.0
// Which options a user is shown first. All options of a configuration file are user or expert options; a value that nobody
// should have to set is a constant in the code.
//
//   for (const OptionField& f : user_fields(fields_of(config))) print(f.path);
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "fbvins/config/option_fields.hpp"

namespace fbvins {

/// Paths of the user's options, in the order of the configuration; docs/tutorial.md explains each.
std::span<const std::string_view> user_options();

/// The fields of the user's options, with the headings of their groups.
std::vector<OptionField> user_fields(const std::vector<OptionField>& all);

}  // namespace fbvins
