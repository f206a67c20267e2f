// SPDX-License-Identifier: Apache-2.0
// A CSV file with named columns, as `fbvins run` writes them. Values; one thread.
//
//   Result<CsvTable> table = CsvTable::read("out/trajectory.csv");
//   std::vector<double> x = table->numbers("p_WB_x");        // units in brackets are not part of a name
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/core/time.hpp"

namespace fbvins {

class CsvTable {
 public:
  static Result<CsvTable> read(const std::string& path);
  /// `source` names the text in messages. The first column holds stamps in nanoseconds.
  static Result<CsvTable> parse(std::string_view text, const std::string& source);

  std::size_t rows() const { return stamps_.size(); }
  const std::vector<Time>& stamps() const { return stamps_; }
  bool has(std::string_view column) const { return index(column) >= 0; }
  /// The column, NaN where a field is not a number; empty if there is no such column.
  std::vector<double> numbers(std::string_view column) const;
  std::vector<std::string> texts(std::string_view column) const;

 private:
  int index(std::string_view column) const;

  std::vector<std::string> names_;
  std::vector<Time> stamps_;
  std::vector<std::vector<std::string>> columns_;  ///< without the stamps
};

}  // namespace fbvins
