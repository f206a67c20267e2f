// SPDX-License-Identifier: Apache-2.0
#include "fbvins/doctor/axes.hpp"

#include <array>

namespace fbvins {

const std::vector<Mat3>& signed_permutations() {
  static const std::vector<Mat3> all = [] {
    std::vector<Mat3> made;
    std::array<int, 3> order{0, 1, 2};
    do
      for (int signs = 0; signs < 8; ++signs) {
        Mat3 P = Mat3::Zero();
        for (int i = 0; i < 3; ++i) P(i, order[static_cast<std::size_t>(i)]) = (signs >> i & 1) != 0 ? -1 : 1;
        made.push_back(P);
      }
    while (std::next_permutation(order.begin(), order.end()));
    return made;
  }();
  return all;
}

Mat3 nearest_axes(const Mat3& R) {
  Mat3 nearest = Mat3::Identity();
  double closest = -4;
  for (const Mat3& P : signed_permutations()) {
    const double cosine = (P.transpose() * R).trace();
    // A reflection is compared with reflections only, a rotation with rotations.
    if (P.determinant() * R.determinant() > 0 && cosine > closest + 1e-9) closest = cosine, nearest = P;
  }
  return nearest;
}

std::string axes_text(const Mat3& axes) {
  std::string text;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (axes(i, j) != 0) text += std::string(i > 0 ? ", " : "") + (axes(i, j) < 0 ? "-" : "") + "xyz"[j];
  return text;
}

}  // namespace fbvins
