// SPDX-License-Identifier: Apache-2.0
// Where a live system's sensor data come from: a device, another process, a recording played in wall time.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/overloaded.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/live/sink.hpp"
#include "fbvins/types/anchor.hpp"
#include "fbvins/types/sensor_event.hpp"

namespace fbvins {

/// What a source pushes into, from any threads, at the moment the data arrive. Stamps are the sensors' own; camera and IMU
/// share one clock (StereoRig::time_offset_s is applied later). A camera that delivered nothing is a null pointer.
class SensorInput {
 public:
  virtual ~SensorInput() = default;
  virtual void push(const ImuSample& sample) = 0;
  virtual void push(StereoFrame frame) = 0;
  /// A measurement for the map, on the cameras' clock. Who has no map leaves it.
  virtual void push_anchor(Anchor anchor) { (void)anchor; }
  /// A reading of an aiding sensor, on the cameras' clock. Who looks at images and the IMU alone leaves it.
  virtual void push_aiding(const AidingSample& reading) { (void)reading; }
};

/// As what it is.
inline void push_event(SensorInput& input, SensorEvent event) {
  std::visit(
      Overloaded{[&](const ImuSample& sample) { input.push(sample); }, [&](StereoFrame& frame) { input.push(std::move(frame)); },
                 [&](const AidingSample& reading) { input.push_aiding(reading); }},
      event);
}

/// What a check of live sensors says: what was seen, and what to do where it is not fine, or could be better; one sentence.
struct SensorFinding {
  bool fine = true;
  std::string text;
  bool advice = false;  ///< fine, and could be better
};

class Source {
 public:
  virtual ~Source() = default;
  virtual const StereoRig& rig() const = 0;
  /// Seconds of the sensors' clock in one second: other than 1 only where a recording is played faster or slower.
  virtual double clock_rate() const { return 1; }
  /// Delivers until the data end, the source fails for good, or stop(). Cables that come and go are its own business.
  virtual Result<void> run(SensorInput& input) = 0;
  /// From any thread: run() returns soon.
  virtual void stop() = 0;
  /// A sink by which the source reports the flight's state to its device; null: none. May outlive the source.
  virtual std::unique_ptr<Sink> status_sink() { return nullptr; }
  /// After run(): what the device says of itself. None: it says nothing.
  virtual std::vector<SensorFinding> device_findings() const { return {}; }
};

}  // namespace fbvins
