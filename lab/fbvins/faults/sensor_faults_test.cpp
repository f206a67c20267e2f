// SPDX-License-Identifier: Apache-2.0
#include "fbvins/faults/sensor_faults.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <optional>
#include <variant>

namespace fbvins {
namespace sensor_faults_test {

Time ms(std::int64_t value) { return Time{value * 1'000'000}; }

struct Notes final : SensorInput {
  std::vector<std::pair<std::int64_t, SensorEvent>> events;  ///< with the flight's time at which each came, ms
  std::int64_t now = 0;
  void push(const ImuSample& s) override { events.emplace_back(now, s); }
  void push(StereoFrame f) override { events.emplace_back(now, std::move(f)); }

  template <class Event>
  std::vector<std::int64_t> stamps() const {
    std::vector<std::int64_t> all;
    for (const auto& [when, event] : events)
      if (const auto* e = std::get_if<Event>(&event)) all.push_back(e->t.ns / 1'000'000);
    return all;
  }
};

/// Three seconds: readings every 10 ms, images every 100 ms.
Notes fly(const std::vector<std::string>& texts) {
  std::vector<SensorFault> faults;
  for (const std::string& text : texts) faults.push_back(*parse_fault(text));
  Notes notes;
  FaultyInput faulty(notes, faults);
  for (std::int64_t t = 0; t < 3000; t += 10) {
    notes.now = t;
    faulty.push(ImuSample{ms(t), Vec3::Zero(), Vec3::Zero()});
    if (t % 100 != 0) continue;
    const auto value = static_cast<std::uint8_t>(t / 100);
    faulty.push(StereoFrame{ms(t), {std::make_shared<Image>(2, 2, value), std::make_shared<Image>(2, 2, value)}});
  }
  return notes;
}

TEST(SensorFaults, WithoutAFaultEverythingPasses) {
  const Notes notes = fly({});
  EXPECT_EQ(notes.events.size(), 330u);
  for (const auto& [when, event] : notes.events) EXPECT_EQ(stamp_of(event), ms(when));
}

TEST(SensorFaults, SensorsFallSilent) {
  EXPECT_EQ(fly({"camera_off:1:0.5"}).stamps<StereoFrame>().size(), 25u);
  EXPECT_EQ(fly({"imu_off:1:0.5"}).stamps<ImuSample>().size(), 250u);
  const Notes unplugged = fly({"unplugged:1:0.5"});
  EXPECT_EQ(unplugged.stamps<StereoFrame>().size(), 25u);
  EXPECT_EQ(unplugged.stamps<ImuSample>().size(), 250u);
}

TEST(SensorFaults, OneCameraIsOffOrFrozen) {
  for (const auto& [when, event] : fly({"left_off:1:0.5", "right_frozen:2:0.5"}).events) {
    const auto* frame = std::get_if<StereoFrame>(&event);
    if (frame == nullptr) continue;
    const bool off = when >= 1000 && when < 1500, frozen = when >= 2000 && when < 2500;
    EXPECT_EQ(frame->left() == nullptr, off) << when;
    EXPECT_EQ(frame->right()->at(0, 0), frozen ? 19 : when / 100) << when;
  }
}

/// Frames of four cameras every 100 ms, whose images have ten times the frame's number, and the camera's.
std::vector<StereoFrame> fly_four(const std::string& text) {
  Notes notes;
  FaultyInput faulty(notes, {*parse_fault(text)});
  for (int k = 0; k < 20; ++k) {
    const auto image = [&](int camera) { return std::make_shared<Image>(2, 2, static_cast<std::uint8_t>(10 * k + camera)); };
    faulty.push(StereoFrame{ms(100 * k), {image(0), image(1), image(2), image(3)}});
  }
  std::vector<StereoFrame> out;
  for (const auto& [when, event] : notes.events) out.push_back(std::get<StereoFrame>(event));
  return out;
}

TEST(SensorFaults, OneOfFourCamerasFails) {
  struct Case {
    const char* text;
    int camera;
    int (*value)(int k);  ///< of its image; -1: none
  };
  for (const Case& c :
       {Case{"camera2_off:1:0.5", 2, [](int) { return -1; }}, Case{"camera3_off:1:0.5", 3, [](int) { return -1; }},
        Case{"camera3_frozen:1:0.5", 3, [](int) { return 93; }}, Case{"camera2_late:1:0.5", 2, [](int k) { return 10 * k - 8; }},
        Case{"camera2_black:1:0.5", 2, [](int) { return 0; }}, Case{"camera1_white:1:0.5", 1, [](int) { return 255; }},
        Case{"left_off:1:0.5", 0, [](int) { return -1; }}}) {
    const std::vector<StereoFrame> frames = fly_four(c.text);
    ASSERT_EQ(frames.size(), 20u) << c.text;
    for (int k = 0; k < 20; ++k)
      for (int i = 0; i < 4; ++i) {
        const auto image = frames[static_cast<std::size_t>(k)].image(i);
        const bool fails = i == c.camera && k >= 10 && k < 15;
        EXPECT_EQ(image ? image->at(0, 0) : -1, fails ? c.value(k) : 10 * k + i) << c.text << ", frame " << k << ", camera " << i;
      }
  }
}

TEST(SensorFaults, WhatAllCamerasHaveTheFurtherOnesHaveToo) {
  const std::vector<StereoFrame> frames = fly_four("black:1:0.5");
  for (int i = 0; i < 4; ++i) EXPECT_EQ(frames[12].image(i)->at(1, 1), 0) << i;
  EXPECT_EQ(fly_four("camera_off:1:0.5").size(), 15u);
}

TEST(SensorFaults, ThereIsNoCameraBeyondTheEighth) {
  for (const char* text : {"camera8_off:1:1", "camera_2_off:1:1", "camera2_exchanged:1:1", "camera2off:1:1", "camera2_:1:1"}) {
    const auto fault = parse_fault(text);
    ASSERT_FALSE(fault) << text;
    EXPECT_NE(fault.error().message.find("and of one camera, by its number, camera2_off, camera2_frozen"), std::string::npos);
  }
  EXPECT_EQ(parse_fault("camera7_dark:1:1").error().message,
            "fault 'camera7_dark:1:1': camera7_dark has an AMOUNT (of 1); it is KIND:START:LENGTH[:AMOUNT]");
  EXPECT_EQ(parse_fault("camera7_dark:1:1:0.1")->camera, 7);
}

TEST(SensorFaults, AShareOfImagesIsLost) {
  const std::size_t left = fly({"lose_images:0:3:0.5"}).stamps<StereoFrame>().size();
  EXPECT_GT(left, 8u);
  EXPECT_LT(left, 22u);
}

TEST(SensorFaults, ABurstComesAtOnceAndWhole) {
  const Notes notes = fly({"burst:1:0.5:0.25"});
  EXPECT_EQ(notes.events.size(), 330u);
  EXPECT_EQ(notes.stamps<ImuSample>(), fly({}).stamps<ImuSample>());
  for (const auto& [when, event] : notes.events) {
    const std::int64_t t = stamp_of(event).ns / 1'000'000;
    if (t < 1000 || t >= 1500) {
      EXPECT_EQ(when, t);
    } else {
      EXPECT_EQ(when, t < 1250 ? 1250 : 1500);
    }
  }
}

TEST(SensorFaults, StampsLeapThereAndBack) {
  for (const auto& [when, event] : fly({"leap:1:0.5:7"}).events) {
    const std::int64_t t = stamp_of(event).ns / 1'000'000;
    EXPECT_EQ(t - when, when >= 1000 && when < 1500 ? 7000 : 0);
  }
}

/// A second of flight, whose images have a texture that moves.
Notes fly_fault(const std::optional<std::string>& text) {
  Notes notes;
  std::vector<SensorFault> faults;
  if (text) faults.push_back(*parse_fault(*text));
  FaultyInput faulty(notes, faults);
  for (std::int64_t t = 0; t < 1000; t += 10) {
    notes.now = t;
    const double s = static_cast<double>(t) * 1e-3;
    faulty.push(ImuSample{ms(t), Vec3(3 * std::sin(9 * s), 1 + s, -2 + s), Vec3(1 + s, 2 - s, 9.81 + 8 * std::sin(11 * s))});
    if (t % 50 != 0) continue;
    Image image(64, 48), right(64, 48);
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x) {
        image.at(x, y) = static_cast<std::uint8_t>(40 + (7 * x + 13 * y * y + t / 10) % 160);
        right.at(x, y) = static_cast<std::uint8_t>(50 + (7 * x + 13 * y * y + t / 10) % 160);
      }
    faulty.push(StereoFrame{ms(t), {std::make_shared<Image>(image), std::make_shared<Image>(right)}});
  }
  return notes;
}

bool same(const SensorEvent& a, const SensorEvent& b) {
  if (a.index() != b.index()) return false;
  if (const auto* x = std::get_if<ImuSample>(&a)) {
    const auto& y = std::get<ImuSample>(b);
    return x->t == y.t && x->gyro_radps == y.gyro_radps && x->accel_mps2 == y.accel_mps2;
  }
  const auto &x = std::get<StereoFrame>(a), &y = std::get<StereoFrame>(b);
  const auto equal = [](const std::shared_ptr<const Image>& p, const std::shared_ptr<const Image>& q) {
    return p == q || (p && q && std::equal(p->row(0), p->row(0) + 64 * 48, q->row(0)));
  };
  return x.t == y.t && equal(x.left(), y.left()) && equal(x.right(), y.right());
}

TEST(SensorFaults, EachAltersItsTimeAndNothingElse) {
  const Notes clean = fly_fault({});
  for (const FaultName& name : fault_names()) {
    const std::string text = std::string(name.name) + ":0.3:0.4" + (name.unit.empty() ? "" : ":" + std::to_string(name.large));
    const Notes notes = fly_fault(text);
    int altered = 0;
    // Events by their own time; those lost or held back count as altered.
    std::map<std::pair<std::int64_t, std::size_t>, SensorEvent> by_time;
    for (const auto& [when, event] : notes.events) by_time[{stamp_of(event).ns / 1'000'000, event.index()}] = event;
    for (const auto& [when, event] : clean.events) {
      const auto found = by_time.find({when, event.index()});
      const bool as_it_was = found != by_time.end() && same(found->second, event);
      if (when < 300 || when >= 700) {
        EXPECT_TRUE(as_it_was) << text << " at " << when;
      } else {
        altered += !as_it_was;
      }
    }
    if (name.name != "burst") {
      EXPECT_GT(altered, 0) << text;
    }
  }
}

TEST(SensorFaults, TheSameSeedGivesTheSameFault) {
  for (const char* text : {"imu_noise:0.2:0.5:3", "vibration:0.2:0.5:5", "broken_blocks:0.2:0.5:0.3", "lose_images:0:1:0.5"}) {
    const Notes once = fly_fault(text), again = fly_fault(text);
    ASSERT_EQ(once.events.size(), again.events.size());
    for (std::size_t i = 0; i < once.events.size(); ++i)
      EXPECT_TRUE(same(once.events[i].second, again.events[i].second)) << text << " " << i;
  }
}

TEST(SensorFaults, NonsenseIsRefusedInOneSentence) {
  for (const char* text : {"", "camera_off", "camera_off:1", "camera_off:1:2:3", "camera_off:x:1", "camera_off:-1:1",
                           "camera_off:1:0", "lose_images:0:1", "lose_images:0:1:1.5", "burst:0:1:0", "earthquake:0:1"}) {
    const auto fault = parse_fault(text);
    ASSERT_FALSE(fault) << text;
    EXPECT_NE(fault.error().message.find("KIND:START:LENGTH"), std::string::npos);
  }
}

}  // namespace sensor_faults_test
}  // namespace fbvins
