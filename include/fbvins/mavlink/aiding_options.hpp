// SPDX-License-Identifier: Apache-2.0
// Which of a flight controller's sensors aid images and IMU: `live.mavlink.sensors` (docs/px4.md, Sensors).
#pragma once

namespace fbvins {

struct MavlinkAidingOptions {
  bool range = false, flow = false, pressure = false;
  int orientation = 25;
  double rate_hz = 20;

  template <class V>
  void visit(V&& v) {
    v("range", range, "", "the flight controller's rangefinder is used (DISTANCE_SENSOR)");
    v("flow", flow, "", "its optical flow is (OPTICAL_FLOW_RAD), where that has a distance");
    v("pressure", pressure, "", "its barometer is (SCALED_PRESSURE)");
    v("orientation", orientation, "",
      "of the rangefinder that is used, others are not: MAV_SENSOR_ORIENTATION; 25: down, 100: as its quaternion says", 0, 100);
    v("rate_hz", rate_hz, "Hz", "at which the messages are asked for", 1.0, 200.0);
  }
  bool any() const { return range || flow || pressure; }
};

}  // namespace fbvins
