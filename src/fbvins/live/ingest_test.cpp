// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/ingest.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace fbvins {
namespace {

Time ms(std::int64_t value) { return Time{value * 1'000'000}; }

std::shared_ptr<const Image> image(std::uint8_t value) { return std::make_shared<Image>(8, 4, value); }

struct Fixture {
  Time now = ms(1000);
  std::vector<Time> told;
  Ingest ingest{LiveOptions{}, 1, [this] { return now; }, [this](const ImuSample& s, Time) { told.push_back(s.t); }};

  void read(std::int64_t t_ms) {
    now = ms(1000 + t_ms);
    ingest.push(ImuSample{ms(t_ms), Vec3::Zero(), Vec3::Zero()});
  }
  void see(std::int64_t t_ms, std::uint8_t left, std::uint8_t right) {
    now = ms(1000 + t_ms);
    ingest.push(StereoFrame{ms(t_ms), image(left), image(right)});
  }
  std::vector<SensorEvent> all() {
    ingest.close();
    std::vector<SensorEvent> events;
    while (auto event = ingest.pop()) events.push_back(std::move(*event));
    return events;
  }
};

int images_of(const std::vector<SensorEvent>& events) {
  return static_cast<int>(std::count_if(events.begin(), events.end(), [](const SensorEvent& e) { return e.index() == 1; }));
}

TEST(Ingest, OnlyTheNewestImageWaitsAndNoReadingIsLost) {
  Fixture f;
  for (std::int64_t t = 0; t < 500; t += 5) {
    f.read(t);
    if (t % 50 == 0) f.see(t, static_cast<std::uint8_t>(t / 50), static_cast<std::uint8_t>(t / 50 + 100));
  }
  const LiveCounts counts = f.ingest.counts();
  EXPECT_EQ(counts.images, 10);
  EXPECT_EQ(counts.images_dropped, 9);
  const std::vector<SensorEvent> events = f.all();
  EXPECT_EQ(images_of(events), 1);
  EXPECT_EQ(events.size(), 101u);
  for (const SensorEvent& event : events)
    if (const auto* frame = std::get_if<StereoFrame>(&event)) {
      EXPECT_EQ(frame->t, ms(450));
    }
  EXPECT_EQ(f.told.size(), 100u);
}

TEST(Ingest, AnImageThatIsTakenInTimeIsNotDropped) {
  Fixture f;
  for (std::int64_t t = 0; t < 500; t += 50) {
    f.see(t, static_cast<std::uint8_t>(t / 50), static_cast<std::uint8_t>(t / 50 + 100));
    ASSERT_TRUE(f.ingest.pop());
  }
  EXPECT_EQ(f.ingest.counts().images_dropped, 0);
}

TEST(Ingest, AFrozenCameraGivesNoImage) {
  Fixture f;
  f.see(0, 1, 101), f.ingest.pop();
  f.see(50, 2, 101);  // the right camera repeats itself
  const auto event = f.ingest.pop();
  const auto& frame = std::get<StereoFrame>(*event);
  EXPECT_NE(frame.left, nullptr);
  EXPECT_EQ(frame.right, nullptr);
  EXPECT_EQ(f.ingest.counts().images_incomplete, 1);
  EXPECT_EQ(*f.ingest.arrivals().left, ms(1050));
  EXPECT_EQ(*f.ingest.arrivals().right, ms(1000));
}

TEST(Ingest, TwoThreadsMayPush) {
  Ingest ingest(LiveOptions{}, 1, [] { return ms(1); }, {});
  std::jthread imu([&] {
    for (std::int64_t t = 1; t <= 2000; ++t) ingest.push(ImuSample{ms(t), Vec3::Zero(), Vec3::Zero()});
  });
  std::jthread camera([&] {
    for (std::int64_t t = 1; t <= 200; ++t)
      ingest.push(StereoFrame{ms(10 * t), image(static_cast<std::uint8_t>(t)), image(static_cast<std::uint8_t>(t + 7))});
  });
  std::jthread closer([&] {
    imu.join(), camera.join();
    ingest.close();
  });
  int readings = 0, images = 0;
  while (const auto event = ingest.pop()) ++(event->index() == 0 ? readings : images);
  EXPECT_EQ(readings, 2000);
  EXPECT_EQ(images + ingest.counts().images_dropped, 200);
}

TEST(Ingest, NothingIsTakenAfterTheEnd) {
  Fixture f;
  f.ingest.close();
  f.read(0), f.see(0, 1, 2);
  EXPECT_FALSE(f.ingest.pop());
}

}  // namespace
}  // namespace fbvins
