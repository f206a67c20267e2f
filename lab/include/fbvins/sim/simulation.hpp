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
#include "fbvins/sim/world.hpp"

namespace fbvins {

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
  std::string rig = "stereo";
  FlightOptions flight;
  RecordedOptions recorded;
  ImuModelOptions imu;
  CameraModelOptions camera;
  DepthModelOptions depth;
  WorldOptions world;
  LightOptions light;

  template <class V>
  void visit(V&& v) {
    v("seed", seed, "", "of all random numbers", 0, 2'000'000'000);
    v("image_rate_hz", image_rate_hz, "Hz", "stereo frames per second", 1.0, 200.0);
    v("calibration", calibration, "", "Kalibr camchain-imucam.yaml of the rig; empty: EuRoC's");
    v("rig", rig, "stereo|mono|quad|sides|rgbd|fisheye|back-to-back",
      "cameras: the two of the calibration; or the left one alone; or two more of the same kind that look backwards, or one to each "
      "side; or the left one with a depth sensor; or two with lenses of 200 degrees, side by side or back to back");
    v.group("flight", flight, "how the rig moves");
    v.group("recorded", recorded, "a recorded flight instead");
    v.group("imu", imu, "errors of the IMU");
    v.group("camera", camera, "both cameras");
    v.group("depth", depth, "the depth sensor of the rig rgbd");
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
  StereoRig rig;
  SplineTrajectory flight;
  Time start;
  SimulatedImu imu;
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
