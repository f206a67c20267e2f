// SPDX-License-Identifier: Apache-2.0
// For tests of the live commands: a source with a rig that delivers nothing.
#pragma once

#include "fbvins/live/source.hpp"

namespace fbvins::app::test {

class NoSensors final : public Source {
 public:
  NoSensors() {
    rig_.cameras.assign(2, {Camera(PinholeRadtan{40, 41, 15, 11}, 32, 24), {}});
    rig_.cameras[1].T_BC.p = Vec3(0.1, 0, 0);
  }
  const StereoRig& rig() const override { return rig_; }
  Result<void> run(SensorInput&) override { return {}; }
  void stop() override {}

 private:
  StereoRig rig_;
};

}  // namespace fbvins::app::test
