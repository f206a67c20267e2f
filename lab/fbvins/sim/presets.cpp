// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "fbvins/sim/simulation.hpp"

namespace fbvins {
namespace {

struct Preset {
  const char* name;
  void (*apply)(SimulationOptions& o);
};

void fast(SimulationOptions& o) {
  o.flight.kind = "aggressive";
  o.flight.max_speed_mps = 3.0;
  o.flight.max_accel_mps2 = 6.0;
  o.flight.max_jerk_mps3 = 40;
  o.flight.max_yaw_rate_radps = 2.0;
  o.flight.extent_x_m = 8;
  o.flight.extent_y_m = 6;
  o.flight.extent_z_m = 1.8;
  o.world.height_m = 4;
}

constexpr Preset kPresets[] = {
    {"normal", [](SimulationOptions&) {}},
    {"dim",
     [](SimulationOptions& o) {
       o.light.level = 0.08;
       o.camera.target_level = 45;
       o.camera.max_exposure_ms = 9;
     }},
    {"flicker", [](SimulationOptions& o) { o.light.change = "flicker"; }},
    {"switching", [](SimulationOptions& o) { o.light.change = "switching"; }},
    {"moving-light", [](SimulationOptions& o) { o.light.change = "moving"; }},
    {"weak-texture",
     [](SimulationOptions& o) {
       o.world.plain_share = 0.9;
       o.world.weave_share = 0.1;
       o.world.posters_per_m2 = 0.04;
       o.world.clutter_per_m2 = 0.25;
       o.world.floor_marks = 0.1;
       o.world.repeat_share = 0.1;
     }},
    {"moving-objects", [](SimulationOptions& o) { o.world.movers = 8; }},
    {"glare",
     [](SimulationOptions& o) {
       o.world.lamp_glow = 30;
       o.world.gloss = 1.2;
       o.camera.glare = 0.12;
     }},
    {"fast", fast},
    {"rolling",  // a readout of 20 ms in the turns of "fast"
     [](SimulationOptions& o) {
       fast(o);
       o.camera.line_delay_us = 20e3 / 480;
     }},
    {"untriggered",  // the right camera half an interval before the left one, and earlier from image to image
     [](SimulationOptions& o) {
       o.camera.untriggered_ms = 25;
       o.camera.untriggered_drift_us_per_s = 100;
     }},
    {"handheld", [](SimulationOptions& o) { o.flight.kind = "handheld"; }},
    {"takeoff",
     [](SimulationOptions& o) {
       o.flight.kind = "takeoff";
       o.flight.rest_s = 2;
     }},
    {"hover", [](SimulationOptions& o) { o.flight.kind = "hover"; }},
    {"tour",
     [](SimulationOptions& o) {
       o.flight.kind = "tour";
       o.flight.duration_s = 120;
       o.flight.extent_x_m = 12;
       o.flight.extent_y_m = 8;
       o.world.kind = "corridors";
     }},
    {"hall",
     [](SimulationOptions& o) {
       o.world.kind = "hall";
       o.world.height_m = 6;
       o.world.margin_m = 4;
       o.flight.extent_x_m = 9;
       o.flight.extent_z_m = 2.5;
       o.flight.max_speed_mps = 1.5;
     }},
    {"mono", [](SimulationOptions& o) { o.rig = "mono"; }},
    {"quad", [](SimulationOptions& o) { o.rig = "quad"; }},
    {"rgbd", [](SimulationOptions& o) { o.rig = "rgbd"; }},
    {"fisheye", [](SimulationOptions& o) { o.rig = "fisheye"; }},
    {"back-to-back", [](SimulationOptions& o) { o.rig = "back-to-back"; }},
    {"legs", [](SimulationOptions& o) { o.camera.legs = 3; }},
    {"propellers", [](SimulationOptions& o) { o.camera.propellers = 2; }},
};

}  // namespace

std::vector<std::string> simulation_presets() {
  std::vector<std::string> names;
  for (const Preset& preset : kPresets) names.emplace_back(preset.name);
  return names;
}

Result<SimulationOptions> simulation_preset(const std::string& name) {
  for (const Preset& preset : kPresets)
    if (name == preset.name) {
      SimulationOptions options;
      preset.apply(options);
      return options;
    }
  std::string known;
  for (const Preset& preset : kPresets) known += fmt::format("{}{}", known.empty() ? "" : ", ", preset.name);
  return Error{ErrorCode::invalid_argument, fmt::format("there is no preset '{}'; there are {}", name, known)};
}

StereoRig euroc_rig() {
  // Burri et al., The EuRoC micro aerial vehicle datasets, IJRR 2016: cam0, cam1 and imu0 of the VI-sensor.
  const Camera left(PinholeRadtan{458.654, 457.296, 367.215, 248.375, -0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}, 752,
                    480);
  const Camera right(PinholeRadtan{457.587, 456.134, 379.999, 255.238, -0.28368365, 0.07451284, -0.00010473, -3.55590700e-05},
                     752, 480);
  Mat3 R0, R1;
  R0 << 0.0148655429818, -0.999880929698, 0.00414029679422, 0.999557249008, 0.0149672133247, 0.025715529948, -0.0257744366974,
      0.00375618835797, 0.999660727178;
  R1 << 0.0125552670891, -0.999755099723, 0.0182237714554, 0.999598781151, 0.0130119051815, 0.0251588363115, -0.0253898008918,
      0.0179005838253, 0.999517347078;
  return with_cameras({}, {{left, {R0, Vec3(-0.0216401454975, -0.064676986768, 0.00981073058949)}},
                           {right, {R1, Vec3(-0.0198435579556, 0.0453689425024, 0.00786212447038)}}});
}

}  // namespace fbvins
