// SPDX-License-Identifier: Apache-2.0
// What became of the data rows of one file. A value.
#pragma once

#include <string>

namespace fbvins {

/// Damage is counted, never used.
struct RowCounts {
  int rows = 0;           ///< data rows in the file
  int malformed = 0;      ///< wrong number of columns, not a number, stamp out of range
  int not_finite = 0;     ///< NaN, infinite or absurdly large values
  int duplicates = 0;     ///< stamp already seen
  int backwards = 0;      ///< stamp out of order
  std::string first_bad;  ///< "file:line: sentence" about the first row left out

  int bad() const { return malformed + not_finite + duplicates + backwards; }
};

}  // namespace fbvins
