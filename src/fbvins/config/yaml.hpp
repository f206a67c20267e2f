// SPDX-License-Identifier: Apache-2.0
// Options structs to YAML and back. What is written reads back to the same bits, and what is read
// and written again gives the same bytes. Pure functions but for read_yaml_file; any thread.
//
//   Result<void> ok = read_yaml(text, "drone.yaml", fields_of(options));
//   std::string effective = write_yaml(fields_of(options));
#pragma once

#include <string>
#include <vector>

#include "fbvins/config/option_fields.hpp"

namespace fbvins {

/// Sets the fields that the text names and leaves the others. Unknown or repeated key, wrong type,
/// value out of range: an error "source:line: ..." with, for an unknown key, the nearest known one.
/// Fields set before the error keep their new values: read into a copy.
Result<void> read_yaml(const std::string& text, const std::string& source, const std::vector<OptionField>& fields);

/// The same from a file, or from the configuration in a flight record.
Result<void> read_yaml_file(const std::string& path, const std::vector<OptionField>& fields);

/// Every field in the order of visit(), each with a comment: meaning, unit, range.
std::string write_yaml(const std::vector<OptionField>& fields);

}  // namespace fbvins
