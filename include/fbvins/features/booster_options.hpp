// SPDX-License-Identifier: Apache-2.0
// Which network improves descriptors (paper 2.2.2), and in which numbers.
#pragma once

#include <string>

namespace fbvins {

enum class BoosterPrecision { int8, float32 };

struct BoosterOptions {
  std::string weights = "boost-s";
  BoosterPrecision precision = BoosterPrecision::int8;

  template <class V>
  void visit(V&& v) {
    v("weights", weights, "", "the shipped weights, boost-s, or the path of a .safetensors file");
    v("precision", precision, "int8|float32", "8-bit integers, fast; or single precision, for comparison");
  }
};

}  // namespace fbvins
