// SPDX-License-Identifier: Apache-2.0
// How many data rows of a file were usable. A value.
#pragma once

#include <string>

namespace fbvins {

/// Unusable rows are counted and left out.
struct RowCounts {
  int rows = 0;           ///< data rows in the file
  int malformed = 0;      ///< wrong number of columns, not a number, stamp out of range
  int not_finite = 0;     ///< NaN, infinite or absurdly large values
  int duplicates = 0;     ///< stamp already seen
  int backwards = 0;      ///< stamp out of order
  int wraps = 0;          ///< a counter of 32 bits of microseconds began again at 0, and is continued
  std::string first_bad;  ///< "file:line: sentence" about the first row left out

  int bad() const { return malformed + not_finite + duplicates + backwards; }
  RowCounts& operator+=(const RowCounts& other) {
    rows += other.rows, malformed += other.malformed, not_finite += other.not_finite;
    duplicates += other.duplicates, backwards += other.backwards;
    wraps += other.wraps;
    if (first_bad.empty()) first_bad = other.first_bad;
    return *this;
  }
};

}  // namespace fbvins
