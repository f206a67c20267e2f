// SPDX-License-Identifier: Apache-2.0
// Options of the input of a System: `input` in a configuration.
#pragma once

namespace fbvins {

/// How images and IMU readings are joined.
struct InputOptions {
  double max_imu_wait_s = 0.25;

  template <class V>
  void visit(V&& v) {
    v("max_imu_wait_s", max_imu_wait_s, "s", "an image is processed without its IMU readings once newer images are ahead by this",
      0.0, 10.0);
  }
};

}  // namespace fbvins
