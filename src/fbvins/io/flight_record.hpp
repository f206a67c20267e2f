// SPDX-License-Identifier: Apache-2.0
// Private: writes a flight record, an MCAP file with all that is needed to run a flight again and to look at it
// (docs/flight_record.md). One thread at a time.
//
//   auto record = FlightRecord::create("flight.mcap", rig, {.configuration = to_yaml(config)});
//   Result<void> taken = record->add(sample);    // in memory until it is a megabyte, or flush()
//   Result<void> done = record->finish();
//
// IMU readings, frames and aiding sensors' readings must come in the order in which the estimator takes them: in that order they
// are read back.
#pragma once

#include <string>
#include <string_view>

#include "fbvins/camera/camera.hpp"
#include "fbvins/core/result.hpp"
#include "fbvins/io/aiding_messages.hpp"
#include "fbvins/io/mcap_writer.hpp"
#include "fbvins/io/ros_messages.hpp"
#include "fbvins/types/image.hpp"
#include "fbvins/types/loop.hpp"
#include "fbvins/types/odometry.hpp"

namespace fbvins {

inline constexpr std::string_view kImuTopic = "/imu", kLeftTopic = "/camera/left", kRightTopic = "/camera/right",
                                  kDepthTopic = "/camera/depth";
/// Of camera 0 (left), 1 (right), or a further one: "/camera/2".
std::string camera_topic(int camera);
inline constexpr std::string_view kOdometryTopic = "/odometry", kHealthTopic = "/health", kLandmarksTopic = "/landmarks",
                                  kMarksTopic = "/marks", kTruthTopic = "/ground_truth";
/// Attachments at the start.
inline constexpr std::string_view kCalibrationAttachment = "calibration.yaml", kConfigurationAttachment = "config.yaml";

struct FlightRecordOptions {
  std::string program = "fbvins";  ///< with its version, for the file's header
  std::string configuration = "";  ///< the effective one, as YAML
  bool images = true;              ///< without them the flight can be looked at, not run again
};

/// A diagnostic's level; its message is to_sentence(health).
std::uint8_t health_level(const Health& health);

class FlightRecord {
 public:
  static Result<FlightRecord> create(const std::string& path, const StereoRig& rig, const FlightRecordOptions& options = {});

  // An error where the disk is full, or for a stamp that ROS's messages cannot hold (before 1970, after 2038).
  Result<void> add(const ImuSample& sample);
  Result<void> add(const StereoFrame& frame);
  /// Its stamp is of the images' clock, and written on the IMU's.
  Result<void> add(const AidingSample& reading);
  /// Pose where there is one, and health.
  Result<void> add(const Odometry& odometry);
  Result<void> add(const MapUpdate& update);
  /// The pose at an IMU reading; the covariance of its rate is that of the newest Odometry.
  Result<void> add_live(RosOdometry odometry);
  /// Landmarks observed in an image, with their positions; needs no Odometry.
  Result<void> add_landmarks(Time t, std::span<const RosLandmark> landmarks);
  Result<void> add_mark(Time t, std::string_view text);
  /// Where the body was, by another system; a recording that is converted may have it.
  Result<void> add_truth(Time t, const Pose<W, B>& T_WB);
  Result<void> add_health(Time t, const RosDiagnostic& diagnostic);

  /// Writes all that was added to the file.
  Result<void> flush() { return file_.flush(); }
  Result<void> finish() { return file_.finish(); }
  /// See McapWriter::sync().
  void sync() const { file_.sync(); }

 private:
  FlightRecord(McapWriter file, const StereoRig& rig, bool images) : file_(std::move(file)), rig_(rig), images_(images) {}
  void write_image(int camera, const StereoFrame& frame);
  void write_camera_info(int camera, Time t);
  template <class Append>
  void write(std::size_t topic, Time t, Append&& append);
  void write_calibration(Time t);
  Result<void> flush_if_large();

  McapWriter file_;
  StereoRig rig_;
  bool images_;
  AidingSensors aiding_;
  Time calibration_t_{-1};               ///< when the camera extrinsics were last written
  Mat3 rate_covariance_ = Mat3::Zero();  ///< of the body's rate: a reading's noise, and the bias
};

}  // namespace fbvins
