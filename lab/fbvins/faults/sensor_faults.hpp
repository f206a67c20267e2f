// SPDX-License-Identifier: Apache-2.0
// Fault injection between a source and its SensorInput: what cables, cameras, IMUs and clocks do to a flight. Times are data time
// since the first event, so that the same flight meets the same faults.
//
//   Result<SensorFault> fault = parse_fault("camera_off:8:2");   // from 8 s on, for 2 s
//   FaultyInput faulty(live.input(), {*fault});
//   source->run(faulty);
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/faults/image_faults.hpp"
#include "fbvins/faults/reading_faults.hpp"
#include "fbvins/live/source.hpp"

namespace fbvins {

struct SensorFault {
  enum class Kind {
    // What comes, and when.
    camera_off,   ///< no images, or none of one camera
    imu_off,      ///< no readings
    unplugged,    ///< nothing at all
    lose_images,  ///< each image is lost with probability `amount`
    lose_readings,
    burst,       ///< everything is held back for `amount` seconds and then comes at once, repeatedly
    leap,        ///< all stamps are `amount` seconds later
    imu_leap,    ///< stamps of readings are
    image_leap,  ///< stamps of images are
    imu_jitter,  ///< stamps of readings are wrong by `amount` seconds, standard deviation
    reading,     ///< numbers of readings are altered (ReadingFault)
    image,       ///< images are (ImageFault)
  };
  Kind kind = Kind::camera_off;
  double start_s = 0, length_s = 0;
  double amount = 0;
  ReadingFault reading = ReadingFault::frozen;
  ImageFault image = ImageFault::black;
  int camera = kAllCameras;  ///< that alone fails, of camera_off and image
};

/// A name for parse_fault(). The amount, where there is one, is in the unit given and at most `most`; it may be negative where
/// `both_signs`. Between `small` and `large` it is what happens to rigs.
struct FaultName {
  std::string_view name;
  SensorFault::Kind kind;
  std::string_view unit = "";  ///< of the amount; empty: there is none
  double small = 0, large = 0, most = 0;
  bool both_signs = false;
  ReadingFault reading = ReadingFault::frozen;
  ImageFault image = ImageFault::black;
  int camera = kAllCameras;
};
std::span<const FaultName> fault_names();

/// KIND:START:LENGTH[:AMOUNT], in seconds; the amount is in the unit of fault_names(). Beside these names there are those of one
/// camera, whichever: camera2_off, camera3_frozen ...
Result<SensorFault> parse_fault(const std::string& text);

/// One thread.
class FaultyInput final : public SensorInput {
 public:
  FaultyInput(SensorInput& input, std::vector<SensorFault> faults, std::uint64_t seed = 1);
  ~FaultyInput() override { deliver_held(); }

  void push(const ImuSample& sample) override;
  void push(StereoFrame frame) override;
  void push_anchor(Anchor anchor) override { input_.push_anchor(std::move(anchor)); }
  void push_aiding(const AidingSample& reading) override { input_.push_aiding(reading); }

 private:
  struct Injected {
    SensorFault fault;
    ReadingFaultInjector reading;
    ImageFaultInjector image;
  };
  bool active(const SensorFault& fault, Time t) const;
  const SensorFault* active(SensorFault::Kind kind, Time t) const;
  /// Of all cameras, or of this one.
  bool camera_is_off(int camera, Time t) const;
  Duration leap(SensorFault::Kind own, Time t) const;
  void pass(SensorEvent event, Time t);
  void deliver_held();

  SensorInput& input_;
  std::vector<Injected> injected_;
  std::optional<Time> first_;
  Rng rng_;
  std::deque<SensorEvent> held_;
  std::optional<Time> held_until_;
};

}  // namespace fbvins
