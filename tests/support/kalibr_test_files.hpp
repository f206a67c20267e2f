// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "fbvins/camera/camera.hpp"

namespace fbvins {

/// The files that Kalibr writes, for a rig.
class KalibrFiles {
 public:
  explicit KalibrFiles(const StereoRig& rig) {
    folder_ = std::filesystem::temp_directory_path() / fmt::format("fbvins_kalibr_{}_{}", ::getpid(), ++made);
    std::filesystem::create_directories(folder_);
    std::ofstream chain(camchain());
    const auto camera = [&](const std::string& name, const Camera& c, const CameraTimes& times, const Mat3& R_CB,
                            const Vec3& p_CB) {
      const auto& k = std::get<PinholeRadtan>(c.model());
      chain << name << ":\n  camera_model: pinhole\n  distortion_model: radtan\n"
            << fmt::format("  intrinsics: [{}, {}, {}, {}]\n  distortion_coeffs: [{}, {}, {}, {}]\n", k.fx, k.fy, k.cx, k.cy,
                           k.k1, k.k2, k.p1, k.p2)
            << fmt::format("  resolution: [{}, {}]\n  timeshift_cam_imu: {}\n  rostopic: /{}/image\n  T_cam_imu:\n", c.width(),
                           c.height(), times.time_offset_s, name);
      for (int i = 0; i < 3; ++i) chain << fmt::format("  - [{}, {}, {}, {}]\n", R_CB(i, 0), R_CB(i, 1), R_CB(i, 2), p_CB(i));
      chain << "  - [0.0, 0.0, 0.0, 1.0]\n";
    };
    for (int i = 0; i < rig.camera_count(); ++i) {
      const auto T_CB = rig.T_BC(i).inverse();
      camera(fmt::format("cam{}", i), rig.camera(i), rig.times(i), T_CB.R(), T_CB.p);
    }
    const ImuNoise& n = rig.imu_noise;
    std::ofstream(imu()) << fmt::format(
        "rostopic: /imu\nupdate_rate: {}\naccelerometer_noise_density: {}\naccelerometer_random_walk: {}\n"
        "gyroscope_noise_density: {}\ngyroscope_random_walk: {}\n",
        n.rate_hz, n.accel_noise_density_mps2_rthz, n.accel_random_walk_mps3_rthz, n.gyro_noise_density_radps_rthz,
        n.gyro_random_walk_radps2_rthz);
  }
  ~KalibrFiles() { std::filesystem::remove_all(folder_); }
  std::string camchain() const { return (folder_ / "camchain.yaml").string(); }
  std::string imu() const { return (folder_ / "imu.yaml").string(); }

 private:
  static inline int made = 0;
  std::filesystem::path folder_;
};

}  // namespace fbvins
