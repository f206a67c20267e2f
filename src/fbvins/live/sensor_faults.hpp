// SPDX-License-Identifier: Apache-2.0
// Fault injection between a source and its SensorInput: what cables, cameras and clocks do to a flight. Times are data time since
// the first event, so that the same flight meets the same faults.
//
//   Result<SensorFault> fault = parse_fault("camera_off:8:2");   // from 8 s on, for 2 s
//   FaultyInput faulty(live.input(), {*fault});
//   source->run(faulty);
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "fbvins/core/result.hpp"
#include "fbvins/core/rng.hpp"
#include "fbvins/live/source.hpp"

namespace fbvins {

struct SensorFault {
  enum class Kind {
    camera_off,    ///< no images
    left_off,      ///< no image of the left camera
    right_off,     ///< no image of the right camera
    left_frozen,   ///< the last left image again and again
    right_frozen,  ///< the last right image again and again
    imu_off,       ///< no readings
    unplugged,     ///< nothing at all
    lose_images,   ///< each image is lost with probability `amount`
    burst,         ///< everything is held back for `amount` seconds and then comes at once, repeatedly
    leap,          ///< stamps are `amount` seconds later
  };
  Kind kind = Kind::camera_off;
  double start_s = 0, length_s = 0;
  double amount = 0;
};

/// KIND:START:LENGTH[:AMOUNT], in seconds; AMOUNT is the share of lost images, the hold time of a burst, or the clock's jump.
Result<SensorFault> parse_fault(const std::string& text);

/// One thread.
class FaultyInput final : public SensorInput {
 public:
  FaultyInput(SensorInput& input, std::vector<SensorFault> faults) : input_(input), faults_(std::move(faults)) {}
  ~FaultyInput() override { deliver_held(); }

  void push(const ImuSample& sample) override;
  void push(StereoFrame frame) override;

 private:
  const SensorFault* active(SensorFault::Kind kind, Time t) const;
  Time leapt(Time t) const;
  void pass(SensorEvent event, Time t);
  void deliver_held();

  SensorInput& input_;
  std::vector<SensorFault> faults_;
  std::optional<Time> first_;
  std::shared_ptr<const Image> left_, right_;  ///< newest that came through
  Rng rng_{1};
  std::deque<SensorEvent> held_;
  std::optional<Time> held_until_;
};

}  // namespace fbvins
