// SPDX-License-Identifier: Apache-2.0
// A synthetic recording with exact truth. Everything follows from the options and the seed.
//
//   Result<SimulationOptions> options = simulation_preset("normal");
//   Result<DatasetContents> contents = simulate(*options);
//   Dataset data(*std::move(contents), {});       // renders images on demand
//   while (auto event = data.next()) system.push(std::move(*event));
//
// simulate() is a pure function, but for reading a recorded flight's files; the Dataset is used as any other.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "fbvins/io/dataset.hpp"
#include "fbvins/sim/depth_model.hpp"
#include "fbvins/sim/flight.hpp"
#include "fbvins/sim/image_sensor.hpp"
#include "fbvins/sim/imu_model.hpp"
#include "fbvins/sim/lighting.hpp"
#include "fbvins/sim/pressure_model.hpp"
#include "fbvins/sim/range_model.hpp"
#include "fbvins/sim/velocity_model.hpp"
#include "fbvins/sim/world.hpp"

namespace fbvins {

/// What the calibration that a recording is written with is wrong by, and does not say: standard deviations.
struct CalibrationErrorOptions {
  double focal_share = 0;
  double centre_px = 0;
  double pair_share = 1;
  double mounting_deg = 0;
  double place_mm = 0;
  double imu_noise_factor = 1;
  double imu_rate_share = 0;
  bool without_distortion = false;
  bool without_line_delay = false;
  bool operator==(const CalibrationErrorOptions&) const = default;

  template <class V>
  void visit(V&& v) {
    v("focal_share", focal_share, "", "error of each camera's focal length, 0.01 is 1 %", 0.0, 0.2);
    v("centre_px", centre_px, "px", "error of each principal point", 0.0, 50.0);
    v("pair_share", pair_share, "", "the right camera's errors are the left one's and this share of its own; 1: its own alone",
      0.0, 1.0);
    v("mounting_deg", mounting_deg, "deg", "error of the rotation between cameras and IMU, about each axis", 0.0, 45.0);
    v("place_mm", place_mm, "mm", "error of the cameras' place on the IMU, along each axis", 0.0, 500.0);
    v("imu_noise_factor", imu_noise_factor, "", "declared noise densities over the true ones", 1e-3, 1e3);
    v("imu_rate_share", imu_rate_share, "", "the declared rate of the IMU is higher by this share of the true one", -0.5, 0.5);
    v("without_distortion", without_distortion, "", "the calibration has no distortion");
    v("without_line_delay", without_line_delay, "", "the calibration has no line delay");
  }
};

/// A recorded flight in place of a synthetic one.
struct RecordedOptions {
  std::string trajectory = "";
  std::string imu = "";
  double start_s = 0;
  double crossover_hz = 1.0;

  template <class V>
  void visit(V&& v) {
    v("trajectory", trajectory, "", "TUM or EuRoC trajectory file to fly along; empty: a synthetic flight");
    v("imu", imu, "", "its real IMU recording (EuRoC CSV), used unchanged");
    v("start_s", start_s, "s", "skipped at the start", 0.0, 1e6);
    v("crossover_hz", crossover_hz, "Hz", "the motion follows the trajectory below this, the IMU above", 0.05, 20.0);
  }
};

struct SimulationOptions {
  int seed = 1;
  double image_rate_hz = 20;
  std::string calibration = "";
  std::string sensors = "none";
  std::string rig = "stereo";
  FlightOptions flight;
  RecordedOptions recorded;
  ImuModelOptions imu;
  CameraModelOptions camera;
  CalibrationErrorOptions calibration_error;
  DepthModelOptions depth;
  RangeModelOptions range;
  VelocityModelOptions velocity;
  PressureModelOptions barometer;
  WorldOptions world;
  LightOptions light;

  template <class V>
  void visit(V&& v) {
    v("seed", seed, "", "of all random numbers", 0, 2'000'000'000);
    v("image_rate_hz", image_rate_hz, "Hz", "stereo frames per second", 1.0, 200.0);
    v("calibration", calibration, "", "Kalibr camchain-imucam.yaml of the rig; empty: EuRoC's");
    v("sensors", sensors, "none|d435i|d435i-colour|oak-d|l515|phone|arducam-fc|adis16448",
      "whose lenses, mounting and IMU these are, in place of the calibration's; --sensors sets all other figures of theirs, too");
    v("rig", rig, "stereo|mono|quad|sides|trinocular|fan|rgbd|fisheye|back-to-back",
      "cameras: the two of the calibration; or the left one alone; or two more of the same kind that look backwards, or one to each "
      "side; or one more above the two; or four like the left one, each turned by 40 degrees against the next; or the left one with a "
      "depth sensor; or two with lenses of 200 degrees, side by side or back to back");
    v.group("flight", flight, "how the rig moves");
    v.group("recorded", recorded, "a recorded flight instead");
    v.group("imu", imu, "errors of the IMU");
    v.group("camera", camera, "both cameras");
    v.group("calibration_error", calibration_error, "the calibration that the recording is written with, against the true one");
    v.group("depth", depth, "the depth sensor of the rig rgbd");
    v.group("range", range, "a rangefinder that looks down");
    v.group("velocity", velocity, "a sensor of velocity");
    v.group("barometer", barometer, "a barometer");
    v.group("world", world, "the place");
    v.group("light", light, "the lamps");
  }
};

/// normal, dim, flicker, switching, moving-light, weak-texture, moving-objects, glare, fast; and, in
/// normal light, handheld, takeoff, hover, tour, hall, mono (one camera), quad (two stereo pairs), rgbd (one camera and a depth
/// sensor), fisheye and back-to-back (two lenses of 200 degrees), legs and propellers (of the vehicle, in view).
std::vector<std::string> simulation_presets();
Result<SimulationOptions> simulation_preset(const std::string& name);

/// The rig of EuRoC's calibration (figures, not files).
StereoRig euroc_rig();

/// The rig of the options: their calibration, image rate and time offset.
Result<StereoRig> simulated_rig(const SimulationOptions& options);

/// What is given to a user as the calibration of `rig`: wrong as the options say, without axes of the IMU. With sensors of a kit
/// it has no time offset either.
StereoRig calibrated_rig(const SimulationOptions& options, StereoRig rig);

/// A stereo frame with data that only a simulator has.
struct RenderedFrame {
  StereoFrame frame;
  Time right_stamp;
  double exposure_s = 0;
  std::vector<float> depth_left_m;  ///< exact, row by row, 0 where nothing is; filled on request
};

class FlightRecorder;

/// A recording that is rendered frame by frame.
struct Simulation {
  StereoRig rig;         ///< as it is
  StereoRig calibrated;  ///< as the recording's calibration says
  SplineTrajectory flight;
  Time start;
  SimulatedImu imu;
  std::vector<AidingSample> aiding = {};  ///< in order of stamps
  std::vector<Time> frames;               ///< stamps of the images, on the IMU's clock
  Vec3 world_from_flight = Vec3::Zero();  ///< added to the flight's positions: a recorded one has its origin anywhere
  std::shared_ptr<const World> world;
  std::shared_ptr<FlightRecorder> recorder;
};

/// `change` adds to the world what its options do not have; the flight and its times are known by then.
Result<Simulation> prepare_simulation(const SimulationOptions& options,
                                      const std::function<void(World&, const Simulation&)>& change = {});
/// Renders a frame; frames in order (exposure follows the image before). Stamps on the cameras' clock.
RenderedFrame render_frame(Simulation& simulation, std::size_t index, bool with_depth = false);

DatasetContents contents_of(Simulation simulation, const std::string& name);

/// prepare_simulation, then contents_of.
Result<DatasetContents> simulate(const SimulationOptions& options, const std::string& name = "simulation");

}  // namespace fbvins
