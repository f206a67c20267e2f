// SPDX-License-Identifier: Apache-2.0
// Private: KITTI's pose files, twelve numbers a row (R | p, row by row) without a time, with the times that lie beside them in
// another file.
//
//   if (looks_like_kitti(text)) Result<KittiPoses> tum = kitti_with_times(text, "poses/00.txt");
#pragma once

#include <string>
#include <string_view>

#include "fbvins/core/result.hpp"

namespace fbvins {

bool looks_like_kitti(std::string_view text);

struct KittiPoses {
  std::string tum;    ///< the same poses as TUM's rows
  std::string times;  ///< the file of their times
};

/// Times are a number a row, seconds: times.txt or NAME_times.txt beside NAME.txt, or ../sequences/NAME/times.txt as in KITTI. An
/// error where there is none, or one of another number of rows.
Result<KittiPoses> kitti_with_times(std::string_view text, const std::string& path);

}  // namespace fbvins
