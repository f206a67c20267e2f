// SPDX-License-Identifier: Apache-2.0
// A RealSense D435i, or any RealSense with two infrared cameras and an IMU (docs/d435i.md).
//
//   auto source = RealsenseSource::open("", options);     // any; or its serial number, or a recording of the library's
//   Result<void> end = (*source)->run(live.input());      // until stop(), or the recording's end
#pragma once

#include <condition_variable>
#include <librealsense2/rs.hpp>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "fbvins/live/make_source.hpp"
#include "fbvins/realsense/realsense_camera.hpp"

namespace fbvins {

/// The wanted camera (a serial number, a file, or empty) and mode.
struct RealsenseName {
  std::string which;
  RealsenseMode mode;
};
RealsenseName parse_realsense_name(const std::string& text);

class RealsenseSource final : public Source {
 public:
  /// `which`: a serial number, a file that ends in .bag, or empty for any camera, each with [:]depth and [:]WIDTHxHEIGHT[@HZ] at
  /// its end or without. Waits for it until `options.give_up`. The rig
  /// is the device's own; Kalibr's, where `options.dataset` names one. A camera that is unplugged in flight is waited for.
  static Result<std::unique_ptr<RealsenseSource>> open(const std::string& which, const SourceOptions& options);
  /// With the devices of `context`.
  static Result<std::unique_ptr<RealsenseSource>> open(rs2::context context, const std::string& which,
                                                       const SourceOptions& options);
  ~RealsenseSource() override;

  const StereoRig& rig() const override { return rig_; }
  Result<void> run(SensorInput& input) override;
  void stop() override;
  std::vector<SensorFinding> device_findings() const override;

 private:
  RealsenseSource(rs2::context context, std::string which, SourceOptions options);
  Result<void> watch();
  std::unique_ptr<RealsenseCamera> find();
  Result<void> wait_for_first();
  Result<void> set_rig();
  void wait(double longest_s);
  void report(const std::string& problem);
  void mend_stall(SensorInput& input);
  Result<void> start_camera(SensorInput& input);
  void keep_facts();

  SourceOptions options_;
  rs2::context context_;
  std::string which_;
  RealsenseMode mode_;
  StereoRig rig_;
  DeviceFacts facts_;  ///< of the camera that was used last
  int cameras_ = 0, stalls_ = 0;
  Time stalled_;           ///< the last one, by host_now()
  rs2::device recording_;  ///< kept, as the context drops a device that nobody holds
  std::unique_ptr<RealsenseCamera> camera_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  bool removed_ = false;  ///< the camera in use is unplugged
  bool ended_ = false;    ///< the recording has ended
  bool stopped_ = false;
  std::string problem_;  ///< last reported problem of a camera that cannot be used; empty since one works
};

}  // namespace fbvins
