// SPDX-License-Identifier: Apache-2.0
// For tests: a source of simulated cameras that runs in a thread.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "fbvins/live/host_clock.hpp"
#include "fbvins/v4l2/v4l2_source.hpp"
#include "tests/support/fake_video.hpp"
#include "tests/support/kalibr_test_files.hpp"

namespace fbvins::running_source {

inline constexpr std::int64_t kMs = 1'000'000;

inline StereoRig small_rig() {
  StereoRig rig;
  rig.cameras.assign(2, {Camera(PinholeRadtan{100, 100, 31.5, 23.5, 0, 0, 0, 0}, 64, 48), {}});
  rig.cameras[1].T_BC.p = Vec3(0.1, 0, 0);
  return rig;
}

inline std::vector<std::uint8_t> filled(std::size_t size, int value) {
  return std::vector<std::uint8_t>(size, static_cast<std::uint8_t>(value));
}

/// A source that runs in a thread, and its messages.
struct Running {
  Running(const std::string& devices, const StereoRig& rig) : files(rig) {
    options.dataset.kalibr_camchain = files.camchain();
    options.dataset.kalibr_imu = files.imu();
    options.say = [this](const std::string& sentence) {
      const std::lock_guard lock(mutex);
      said.push_back(sentence);
    };
    auto opened = V4l2Source::open(devices, options);
    EXPECT_TRUE(opened) << opened.error().message;
    source = std::move(*opened);
  }
  void start(SensorInput& input) {
    thread = std::thread([this, &input] { EXPECT_TRUE(source->run(input)); });
  }
  ~Running() {
    source->stop();
    if (thread.joinable()) thread.join();
  }
  bool heard(const std::string& what) {
    for (int i = 0; i < 100; ++i) {
      {
        const std::lock_guard lock(mutex);
        if (std::any_of(said.begin(), said.end(), [&](const std::string& s) { return s.find(what) != std::string::npos; }))
          return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return false;
  }
  KalibrFiles files;
  SourceOptions options;
  std::mutex mutex;
  std::vector<std::string> said;
  std::unique_ptr<V4l2Source> source;
  std::thread thread;
};

/// Delivers as soon as the camera streams and has a buffer.
inline bool deliver(FakeVideo& camera, Time t, const std::vector<std::uint8_t>& bytes) {
  for (const Time end = host_now() + Duration{10'000 * kMs}; host_now() < end;) {
    if (camera.deliver(t, bytes)) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

}  // namespace fbvins::running_source
