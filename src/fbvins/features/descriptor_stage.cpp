// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/descriptor_stage.hpp"

#include <algorithm>

namespace fbvins {
namespace {

class IdentityStage final : public DescriptorStage {
 public:
  void improve(int, int, OrbFeatures&) override {}
  bool changes_descriptors() const override { return false; }
};

}  // namespace

void DescriptorStage::look_at(int width, int height, const OrbFeatures&, ImageContext& out) {
  out.width = width, out.height = height;
}

void DescriptorStage::improve(const ImageContext& context, std::span<const DescriptorInput> inputs,
                              std::span<Descriptor> descriptors) {
  OrbFeatures features;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    features.keypoints.push_back(inputs[i].keypoint);
    features.margins.push_back(inputs[i].margins);
    Descriptor& descriptor = features.descriptors.emplace_back();  // as extracted: the signs of the margins
    for (std::size_t b = 0; b < 256; ++b)
      descriptor.bits[b / 64] |= static_cast<std::uint64_t>(inputs[i].margins.of_bit[b] > 0) << (b % 64);
  }
  improve(context.width, context.height, features);
  std::copy(features.descriptors.begin(), features.descriptors.end(), descriptors.begin());
}

std::unique_ptr<DescriptorStage> make_identity_stage() { return std::make_unique<IdentityStage>(); }

}  // namespace fbvins
