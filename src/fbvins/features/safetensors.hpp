// SPDX-License-Identifier: Apache-2.0
// Reads .safetensors: eight bytes of length, a JSON header of names, types, shapes and places, then the numbers.
// Everything is checked; a damaged file is one sentence that names the field. Pure functions, any thread.
//
//   Result<SafeTensors> file = parse_safetensors(bytes);
//   const Tensor& w = file->tensors.at("head.weight");      // w.shape, w.values
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/result.hpp"

namespace fbvins {

struct Tensor {
  std::vector<int> shape;
  std::vector<float> values;  ///< row-major; F16 and F32 are read
};

struct SafeTensors {
  std::map<std::string, Tensor> tensors;
  std::map<std::string, std::string> metadata;
};

inline constexpr std::size_t kLargestWeightsFile = std::size_t{256} << 20;

Result<SafeTensors> parse_safetensors(std::string_view bytes);

/// The same from a file; the message begins with the path.
Result<SafeTensors> read_safetensors(const std::string& path);

/// IEEE 754 half precision to single.
float half_to_float(std::uint16_t half);

}  // namespace fbvins
