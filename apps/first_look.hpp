// SPDX-License-Identifier: Apache-2.0
// The doctor's short form on live sensors: hands on everything at once, and says after the first seconds what is wrong.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "fbvins/checkup/first_seconds.hpp"
#include "fbvins/live/source.hpp"

namespace fbvins::app {

class FirstLook final : public SensorInput {
 public:
  using Clock = std::chrono::steady_clock;

  /// `on_finding` is called on a thread of its own, while sensor data go on. `longest`: to wait where stamps stand still.
  FirstLook(SensorInput& next, const StereoRig& rig, std::function<void(const Finding&)> on_finding,
            Clock::duration longest = std::chrono::seconds(10))
      : next_(next), look_(rig), on_finding_(std::move(on_finding)), longest_(longest) {}

  void push(const ImuSample& sample) override {
    if (looking_) look_at(sample);
    next_.push(sample);
  }
  void push(StereoFrame frame) override {
    if (looking_) look_at(frame);
    next_.push(std::move(frame));
  }
  void push_anchor(Anchor anchor) override { next_.push_anchor(std::move(anchor)); }
  void push_aiding(const AidingSample& reading) override { next_.push_aiding(reading); }

 private:
  void look_at(const SensorEvent& event);

  SensorInput& next_;
  std::mutex mutex_;
  FirstSeconds look_;
  std::function<void(const Finding&)> on_finding_;
  Clock::duration longest_;
  std::optional<Clock::time_point> begin_;
  std::atomic<bool> looking_ = true;
  std::jthread reporting_;
};

}  // namespace fbvins::app
