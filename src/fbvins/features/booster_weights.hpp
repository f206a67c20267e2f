// SPDX-License-Identifier: Apache-2.0
// What the booster's weights file holds, checked: which size of network, and every tensor by name and shape.
// Written by training/weights.py. Pure functions; a loaded value is read-only.
//
//   Result<BoosterWeights> weights = load_booster_weights("data/boost-s.safetensors");
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/result.hpp"

namespace fbvins {

/// y = W x + b, W row-major [outputs][inputs].
struct LinearWeights {
  int outputs = 0, inputs = 0;
  std::vector<float> weight, bias;
};

/// Scale and shift after normalising to mean 0 and variance 1.
struct NormWeights {
  std::vector<float> weight, bias;
};

struct BoosterLayerWeights {
  LinearWeights query, key, value, out, up, down;
  NormWeights norm1, norm2;
};

struct BoosterWeights {
  int width = 0;
  LinearWeights descriptor1, descriptor2;
  std::vector<LinearWeights> keypoint;
  std::vector<BoosterLayerWeights> layers;
  LinearWeights head;
  LinearWeights skip;    ///< from the input straight to the output; no outputs without the residual
  bool margins = false;  ///< the input is kMarginsPerFeature margins, otherwise 256 bits as +1 and -1
  std::string name;      ///< of the size, as trained
};

/// Length of a keypoint's geometry input: see booster_geometry().
inline constexpr int kBoosterGeometry = 7;

Result<BoosterWeights> parse_booster_weights(std::string_view bytes);

/// The same from a file; the message begins with the path.
Result<BoosterWeights> load_booster_weights(const std::string& path);

}  // namespace fbvins
