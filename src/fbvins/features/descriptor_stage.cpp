// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/descriptor_stage.hpp"

namespace fbvins {
namespace {

class IdentityStage final : public DescriptorStage {
 public:
  void improve(int, int, OrbFeatures&) override {}
  bool changes_descriptors() const override { return false; }
};

}  // namespace

std::unique_ptr<DescriptorStage> make_identity_stage() { return std::make_unique<IdentityStage>(); }

}  // namespace fbvins
