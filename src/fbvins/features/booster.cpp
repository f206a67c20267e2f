// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/booster.hpp"

#include <algorithm>
#include <cstdlib>

#include "fbvins/features/booster_network.hpp"
#include "fbvins/features/data_file.hpp"

namespace fbvins {
namespace {

/// Keypoints, spread over the image and its levels, that an image's summary is taken from.
constexpr std::size_t kSample = 64;

class BoosterStage final : public DescriptorStage {
 public:
  BoosterStage(const BoosterWeights& weights, BoosterPrecision precision) : network_(weights, precision, best_int8_kernel()) {}

  void improve(int width, int height, OrbFeatures& features) override {
    network_.run(width, height, features.keypoints, features.margins, features.descriptors);
  }
  void look_at(int width, int height, const OrbFeatures& features, ImageContext& out) override;
  void improve(const ImageContext& context, std::span<const DescriptorInput> inputs, std::span<Descriptor> descriptors) override;
  bool changes_descriptors() const override { return true; }

 private:
  void add(const ImageContext& context, const Keypoint& keypoint, const Margins& margins, double mean_log_score);

  BoosterNetwork network_;
  std::vector<float> geometry_;
  std::vector<Margins> margins_;
};

void BoosterStage::look_at(int width, int height, const OrbFeatures& features, ImageContext& out) {
  out.width = width, out.height = height;
  out.mean_log_score = mean_log_score(features.keypoints);
  geometry_.clear();
  margins_.clear();
  const std::size_t all = features.margins.size(), some = std::min(all, kSample);
  for (std::size_t i = 0; i < some; ++i) {
    const std::size_t k = i * all / some;
    add(out, features.keypoints[k], features.margins[k], out.mean_log_score);
  }
  network_.summarise(geometry_, margins_, out.summary);
}

void BoosterStage::improve(const ImageContext& context, std::span<const DescriptorInput> inputs,
                           std::span<Descriptor> descriptors) {
  geometry_.clear();
  margins_.clear();
  for (const DescriptorInput& input : inputs) add(context, input.keypoint, input.margins, input.mean_log_score);
  network_.run(geometry_, margins_, context.summary, descriptors);
}

void BoosterStage::add(const ImageContext& context, const Keypoint& keypoint, const Margins& margins, double mean_log_score) {
  geometry_.resize(geometry_.size() + kBoosterGeometry);
  booster_geometry(context.width, context.height, keypoint, mean_log_score,
                   geometry_.data() + geometry_.size() - kBoosterGeometry);
  margins_.push_back(margins);
}

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
