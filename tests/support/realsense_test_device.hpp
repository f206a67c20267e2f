// SPDX-License-Identifier: Apache-2.0
// A RealSense camera made of librealsense's software device, with streams as a D435i has them.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <librealsense2/rs.hpp>
// after rs.hpp, which it builds on
#include <librealsense2/hpp/rs_internal.hpp>
#include <string>

#include "fbvins/camera/camera.hpp"
#include "fbvins/types/sensor_event.hpp"

namespace fbvins {
namespace test {

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr std::chrono::seconds kPatience{20};
inline constexpr Time kStart{1'700'000'000'000 * kMs};

/// A D435i by its factory calibration: the infrared cameras and the IMU.
inline StereoRig rig() {
  StereoRig rig;
  rig.cameras.resize(2);
  rig.cameras[0].camera = Camera(PinholeRadtan{380, 381, 320.5, 239.5, 0, 0, 0, 0}, 640, 480);
  rig.cameras[1].camera = Camera(PinholeRadtan{380, 381, 320.5, 239.5, 0, 0, 0, 0}, 640, 480);
  rig.cameras[0].T_BC = {Quat::Identity(), Vec3(0.00552, -0.0051, -0.01174)};
  rig.cameras[1].T_BC = {Quat::Identity(), Vec3(0.00552 + 0.05, -0.0051, -0.01174)};
  rig.image_rate_hz = 30;
  return rig;
}

}  // namespace test

class SoftwareCamera {
 public:
  explicit SoftwareCamera(const StereoRig& rig, const std::string& serial = "123456")
      : stereo_(device_.add_sensor("Stereo Module")), motion_(device_.add_sensor("Motion Module")) {
    device_.register_info(RS2_CAMERA_INFO_SERIAL_NUMBER, serial);
    stereo_.add_option(RS2_OPTION_EMITTER_ENABLED, {0, 1, 1, 1});
    device_.register_info(RS2_CAMERA_INFO_NAME, "Intel RealSense D435I");
    device_.register_info(RS2_CAMERA_INFO_FIRMWARE_VERSION, "5.12.7.100");
    device_.register_info(RS2_CAMERA_INFO_RECOMMENDED_FIRMWARE_VERSION, "5.16.0.1");
    device_.register_info(RS2_CAMERA_INFO_USB_TYPE_DESCRIPTOR, "2.1");
    device_.register_info(RS2_CAMERA_INFO_PHYSICAL_PORT, "/sys/devices/pci0000:00/usb2/2-1/video4linux/video0");
    stereo_.add_option(RS2_OPTION_ENABLE_AUTO_EXPOSURE, {0, 1, 1, 1});
    stereo_.add_option(RS2_OPTION_AUTO_EXPOSURE_LIMIT, {1, 200000, 33000, 1});
    stereo_.add_option(RS2_OPTION_AUTO_EXPOSURE_LIMIT_TOGGLE, {0, 1, 0, 1});
    const int rate_hz = static_cast<int>(rig.image_rate_hz), imu_rate_hz = static_cast<int>(rig.imu_noise.rate_hz);
    left_ = stereo_.add_video_stream(video_stream(1, rig.left(), rate_hz));
    right_ = stereo_.add_video_stream(video_stream(2, rig.right(), rate_hz));
    depth_ = stereo_.add_video_stream(depth_stream(rig.depth_camera(), rate_hz));
    stereo_.add_read_only_option(RS2_OPTION_DEPTH_UNITS, 0.0001f);
    stereo_.add_read_only_option(RS2_OPTION_STEREO_BASELINE, 95);
    for (int index : {1, 2}) wide_[index - 1] = stereo_.add_video_stream(wide_stream(index));
    gyro_ = motion_.add_motion_stream({RS2_STREAM_GYRO, 0, 3, imu_rate_hz, RS2_FORMAT_MOTION_XYZ32F, {}});
    accel_ = motion_.add_motion_stream({RS2_STREAM_ACCEL, 0, 4, imu_rate_hz, RS2_FORMAT_MOTION_XYZ32F, {}});
    left_.register_extrinsics_to(gyro_, extrinsics(rig.T_BC0()));
    right_.register_extrinsics_to(gyro_, extrinsics(rig.T_BC1()));
    const Pose<B, C0> T_BD = rig.depth && rig.depth->own ? rig.depth->own->T_BC : rig.T_BC0();
    depth_.register_extrinsics_to(gyro_, extrinsics(T_BD));
    depth_.register_extrinsics_to(left_, extrinsics(rig.T_BC0().inverse() * T_BD));
    wide_[0].register_extrinsics_to(gyro_, extrinsics(rig.T_BC0()));
    wide_[1].register_extrinsics_to(gyro_, extrinsics(rig.T_BC1()));
    accel_.register_extrinsics_to(gyro_, extrinsics(Pose<B, B>()));
  }

  rs2::software_device& device() { return device_; }
  float emitter() { return stereo_.get_option(RS2_OPTION_EMITTER_ENABLED); }
  float exposure_limit_us() { return stereo_.get_option(RS2_OPTION_AUTO_EXPOSURE_LIMIT); }
  /// Of the images that follow.
  void tell(rs2_frame_metadata_value what, int value) { stereo_.set_metadata(what, value); }

  void gyro(Time t, const Vec3& v) { motion(gyro_, t, v); }
  void accel(Time t, const Vec3& v) { motion(accel_, t, v); }
  void image(int camera, Time t, const Image& image) {
    const auto size = static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height());
    auto* pixels = new std::uint8_t[size];
    std::copy_n(image.row(0), size, pixels);
    const rs2::stream_profile& profile = camera == 0 ? left_ : right_;
    stereo_.on_video_frame(
        {pixels, release<std::uint8_t>, image.width(), 1, milliseconds(t), domain, ++number_, profile.get(), 0});
  }

  /// In tenths of a millimetre.
  void depth(Time t, const DepthImage& image) {
    auto* values = new std::uint16_t[image.mm.size()];
    std::copy(image.mm.begin(), image.mm.end(), values);
    stereo_.on_video_frame(
        {values, release<std::uint16_t>, 2 * image.width, 2, milliseconds(t), domain, ++number_, depth_.get(), 1e-4f});
  }

  rs2_timestamp_domain domain = RS2_TIMESTAMP_DOMAIN_GLOBAL_TIME;

 private:
  template <class T>
  static void release(void* data) {
    delete[] static_cast<T*>(data);
  }
  static double milliseconds(Time t) { return static_cast<double>(t.ns) * 1e-6; }
  static rs2_video_stream video_stream(int index, const Camera& camera, int rate_hz) {
    rs2_intrinsics lens{};
    const auto& k = std::get<PinholeRadtan>(camera.model());
    lens.width = camera.width(), lens.height = camera.height();
    lens.fx = static_cast<float>(k.fx), lens.fy = static_cast<float>(k.fy);
    lens.ppx = static_cast<float>(k.cx), lens.ppy = static_cast<float>(k.cy);
    lens.model = RS2_DISTORTION_BROWN_CONRADY;
    const double coefficients[] = {k.k1, k.k2, k.p1, k.p2};
    for (int i = 0; i < 4; ++i) lens.coeffs[i] = static_cast<float>(coefficients[i]);
    return {RS2_STREAM_INFRARED, index, index, lens.width, lens.height, rate_hz, 1, RS2_FORMAT_Y8, lens};
  }
  static rs2_video_stream depth_stream(const Camera& camera, int rate_hz) {
    rs2_video_stream stream = video_stream(0, camera, rate_hz);
    stream.type = RS2_STREAM_DEPTH, stream.fmt = RS2_FORMAT_Z16, stream.bpp = 2, stream.uid = 20;
    return stream;
  }
  /// Another mode of the same camera, 848 x 480 at 60 Hz.
  static rs2_video_stream wide_stream(int index) {
    rs2_video_stream stream = video_stream(index, Camera(PinholeRadtan{425, 425, 424, 240, 0, 0, 0, 0}, 848, 480), 60);
    stream.uid = 10 + index;
    return stream;
  }
  template <class To, class From>
  static rs2_extrinsics extrinsics(const Pose<To, From>& T) {
    rs2_extrinsics e{};
    const Mat3 R = T.R();
    for (int column = 0; column < 3; ++column)
      for (int row = 0; row < 3; ++row) e.rotation[3 * column + row] = static_cast<float>(R(row, column));
    for (int i = 0; i < 3; ++i) e.translation[i] = static_cast<float>(T.p[i]);
    return e;
  }
  void motion(const rs2::stream_profile& profile, Time t, const Vec3& v) {
    auto* values = new float[3]{static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
    motion_.on_motion_frame({values, release<float>, milliseconds(t), domain, ++number_, profile.get()});
  }

  rs2::software_device device_;
  rs2::software_sensor stereo_, motion_;
  rs2::stream_profile left_, right_, depth_, gyro_, accel_;
  rs2::stream_profile wide_[2];
  int number_ = 0;
};

}  // namespace fbvins
