// SPDX-License-Identifier: Apache-2.0
// Private to io: a row of a stamp and numbers, as the folders of aiding sensors have (aiding_folders.hpp). Pure.
//
//   read_stamped_rows<StampedNumbers>(csv, file, NumbersRowParser({1}, 1e4));
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fbvins/core/time.hpp"
#include "fbvins/io/csv.hpp"

namespace fbvins {

struct StampedNumbers {
  Time t;
  std::array<double, 6> values{};  ///< of which the first `count` were there
  std::size_t count = 0;
};

class NumbersRowParser {
 public:
  /// `counts`: how many numbers a row may have. Where `sees_nothing`, `inf` stands for the largest.
  NumbersRowParser(std::vector<std::size_t> counts, double largest, bool sees_nothing = false)
      : counts_(std::move(counts)), largest_(largest), sees_nothing_(sees_nothing) {}
  RowVerdict operator()(std::string_view line, StampedNumbers& row, std::string& problem);

 private:
  std::vector<std::size_t> counts_;
  double largest_;
  bool sees_nothing_;
  std::vector<std::string_view> fields_;
};

}  // namespace fbvins
