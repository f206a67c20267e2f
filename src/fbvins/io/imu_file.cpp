// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/imu_file.hpp"

#include "fbvins/io/csv.hpp"
#include "fbvins/io/euroc_frames.hpp"
#include "fbvins/io/file_source.hpp"

namespace fbvins {

Result<std::vector<ImuSample>> read_imu_csv(const std::string& path) {
  constexpr std::uint64_t kLargest = 1ULL << 31;  // a day at 1 kHz
  Result<std::string> text = read_file(path, kLargest);
  if (!text) return text.error();
  Result<StampedRows<ImuSample>> rows = read_stamped_rows<ImuSample>(*text, path, ImuRowParser{});
  if (!rows) return rows.error();
  return std::move(rows->rows);
}

}  // namespace fbvins
