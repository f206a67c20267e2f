// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/booster.hpp"

#include <cstdlib>

#include "fbvins/features/booster_network.hpp"
#include "fbvins/features/data_file.hpp"

namespace fbvins {
namespace {

class BoosterStage final : public DescriptorStage {
 public:
  BoosterStage(const BoosterWeights& weights, BoosterPrecision precision) : network_(weights, precision, best_int8_kernel()) {}

  void improve(int width, int height, OrbFeatures& features) override {
    network_.run(width, height, features.keypoints, features.margins, features.descriptors);
  }
  bool changes_descriptors() const override { return true; }

 private:
  BoosterNetwork network_;
};

}  // namespace

std::string booster_weights_path(const std::string& weights) {
  if (weights.find('/') != std::string::npos || weights.ends_with(".safetensors")) return weights;
  const std::string name = weights + ".safetensors";
  if (const char* folder = std::getenv("FBVINS_WEIGHTS"); folder != nullptr && *folder != '\0') return folder + ("/" + name);
  return data_file(name);
}

Result<std::unique_ptr<DescriptorStage>> make_booster_stage(const BoosterOptions& options) {
  const Result<BoosterWeights> weights = load_booster_weights(booster_weights_path(options.weights));
  if (!weights) return weights.error();
  return std::unique_ptr<DescriptorStage>(std::make_unique<BoosterStage>(*weights, options.precision));
}

}  // namespace fbvins
