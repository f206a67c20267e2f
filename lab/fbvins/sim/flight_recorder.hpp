// SPDX-License-Identifier: Apache-2.0
// Renders the frames of a flight, each camera on a thread of its own.
// One thread calls; frames in order.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "fbvins/sim/dirt.hpp"
#include "fbvins/sim/frame_times.hpp"
#include "fbvins/sim/legs.hpp"
#include "fbvins/sim/propellers.hpp"
#include "fbvins/sim/renderer.hpp"
#include "fbvins/sim/simulation.hpp"

namespace fbvins {

/// The body's motion at a time since the start, s; called for times within an image's exposure and readout.
using BodyMotion = std::function<MotionState(double t_s)>;

class FlightRecorder {
 public:
  /// `world_from_flight`: added to the motion's positions.
  FlightRecorder(const SimulationOptions& options, const StereoRig& rig, BodyMotion motion, const Vec3& world_from_flight,
                 std::shared_ptr<const World> world);

  /// t_s: time of the images, from the start of the flight.
  RenderedFrame render(double t_s, std::int64_t frame, bool with_depth);
  /// Error of the right image's stamp.
  Duration right_jitter(std::int64_t frame) const;
  /// Error of the stamps of all images of a frame.
  Duration stamp_error(std::int64_t frame) const { return fbvins::stamp_error(options_, frame); }

 private:
  /// A lens, or a face of one that sees more than 180 degrees.
  struct Face {
    Renderer renderer;
    Pose<B, C0> T_BC;                   ///< pose of this camera, whichever it is
    std::shared_ptr<const Mask> shown;  ///< what of the image is this face's; null: all
  };
  struct Eye {
    std::vector<Face> faces;
    ImageSensor sensor;
    std::optional<Legs> legs;
    std::optional<Propellers> propellers;
    int height_px;
    std::optional<Dirt> dirt = {};
    std::vector<float> radiance = {};
    MixedLight light = {};
    std::vector<Facet> facets = {};
    bool settled = false;
  };
  Eye make_eye(const MountedCamera& mounted, double gain, std::uint64_t seed) const;
  void collect(Eye& eye, double t_s, double exposure_s, int samples);
  static void join_faces(Eye& eye);
  std::vector<Instant::Strip> strips_of(const Eye& eye, const Face& face, double first_line_s) const;
  void add_instant(Eye& eye, double t_s, int sample, int samples);
  Image render_eye(Eye& eye, double t_s, std::int64_t frame);
  Duration offset(std::size_t camera, double t_s) const;
  double exposed_s(std::size_t camera, double t_s) const;

  SimulationOptions options_;
  ImageIntervals intervals_;
  BodyMotion motion_;
  Vec3 world_from_flight_;
  std::shared_ptr<const World> world_;
  LightBake bake_;
  std::vector<Eye> eyes_;  // of the rig's cameras, in order
  std::optional<DepthModel> depth_;
  std::optional<Eye> depth_eye_;  // of a depth sensor that lies elsewhere
};

}  // namespace fbvins
