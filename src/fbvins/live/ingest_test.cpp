// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/ingest.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <thread>

namespace fbvins {
namespace ingest_test {

Time ms(std::int64_t value) { return Time{value * 1'000'000}; }

std::shared_ptr<const Image> image(std::uint8_t value) { return std::make_shared<Image>(8, 4, value); }

/// All different, as a sensor's are.
ImuSample reading(std::int64_t t_ms) { return {ms(t_ms), Vec3::Constant(1e-4 * static_cast<double>(t_ms % 5000)), Vec3::Zero()}; }

struct Fixture {
  Time now = ms(1000);
  std::vector<Time> told;
  Ingest ingest{1, [this] { return now; }, [this](const ImuSample& s, Time) { told.push_back(s.t); }};

  /// `stamp_ms`: instead of the time of arrival.
  void read(std::int64_t t_ms, std::optional<std::int64_t> stamp_ms = {}) {
    now = ms(1000 + t_ms);
    ingest.push(reading(stamp_ms.value_or(t_ms)));
  }
  void see(std::int64_t t_ms, std::uint8_t left, std::uint8_t right) {
    now = ms(1000 + t_ms);
    ingest.push(StereoFrame{ms(t_ms), {image(left), image(right)}});
  }
  /// The clock is known, nothing waits.
  void begin() {
    read(-10), read(-5);
    while (ingest.pop_waiting()) continue;
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

TEST(Ingest, AnchorsAreHandedOnOnceAndBounded) {
  Fixture f;
  f.begin();
  f.ingest.push_anchor(HeightAnchor{.t = ms(3)});
  f.ingest.push_anchor(PositionAnchor{.t = ms(4)});
  const std::vector<Anchor> anchors = f.ingest.take_anchors();
  ASSERT_EQ(anchors.size(), 2u);
  EXPECT_EQ(stamp_of(anchors[1]), ms(4)) << "no clock has jumped";
  EXPECT_TRUE(f.ingest.take_anchors().empty());
  for (int i = 0; i < 5000; ++i) f.ingest.push_anchor(HeightAnchor{});
  EXPECT_EQ(f.ingest.take_anchors().size(), 1024u);
}

TEST(Ingest, AnImageThatIsTakenInTimeIsNotDropped) {
  Fixture f;
  f.begin();
  for (std::int64_t t = 0; t < 500; t += 50) {
    f.see(t, static_cast<std::uint8_t>(t / 50), static_cast<std::uint8_t>(t / 50 + 100));
    ASSERT_TRUE(f.ingest.pop());
  }
  EXPECT_EQ(f.ingest.counts().images_dropped, 0);
}

TEST(ImageHistory, BuffersThatComeInTurnsAreRepeated) {
  std::vector<std::shared_ptr<const Image>> images;
  for (int k = 0; k < 40; ++k) {
    Image image(48, 32, 100);
    image.at(k, 8) = static_cast<std::uint8_t>(101 + k);  // as little as a single pixel of a row that is looked at
    images.push_back(std::make_shared<Image>(image));
  }
  ImageHistory camera;
  for (int k = 0; k < 40; ++k) EXPECT_FALSE(camera.is_repeated(images[static_cast<std::size_t>(k)])) << k;
  for (int round = 0; round < 3; ++round)
    for (const std::size_t k : {36, 37, 38, 39}) EXPECT_TRUE(camera.is_repeated(images[k]));
  EXPECT_TRUE(camera.is_repeated(images[8])) << "31 before the newest";
  EXPECT_FALSE(camera.is_repeated(images[7])) << "too long ago";
  EXPECT_FALSE(camera.is_repeated(nullptr));
}

TEST(Ingest, AFrozenCameraGivesNoImage) {
  Fixture f;
  f.begin();
  f.see(0, 1, 101), f.ingest.pop();
  f.see(50, 2, 101);  // the right camera repeats itself
  const auto event = f.ingest.pop();
  const auto& frame = std::get<StereoFrame>(*event);
  EXPECT_NE(frame.left(), nullptr);
  EXPECT_EQ(frame.right(), nullptr);
  EXPECT_EQ(f.ingest.counts().images_incomplete, 1);
  EXPECT_EQ(*f.ingest.arrivals().cameras[0].image, ms(1050));
  EXPECT_EQ(*f.ingest.arrivals().cameras[1].image, ms(1000));
}

/// Its clock is known, nothing waits.
void begin(Ingest& ingest, Time& now) {
  for (const std::int64_t t : {-10, -5}) {
    now = ms(1000 + t);
    ingest.push(reading(t));
  }
  while (ingest.pop_waiting()) continue;
}

/// Of cameras 0 to 3, whose last one freezes and whose third one is unplugged.
TEST(Ingest, EveryCameraIsWatched) {
  Time now = ms(1000);
  Ingest ingest(
      1, [&] { return now; }, {}, {}, {}, 4);
  begin(ingest, now);
  for (std::int64_t t = 0; t <= 400; t += 50) {
    now = ms(1000 + t);
    const auto n = static_cast<std::uint8_t>(t / 50);
    StereoFrame frame{
        ms(t),
        {image(n), image(static_cast<std::uint8_t>(n + 50)), t < 200 ? image(static_cast<std::uint8_t>(n + 100)) : nullptr,
         image(static_cast<std::uint8_t>(150 + std::min<int>(n, 5)))}};
    ingest.push(std::move(frame));
    const auto event = ingest.pop_waiting();
    ASSERT_TRUE(event);
    const auto& taken = std::get<StereoFrame>(*event);
    EXPECT_TRUE(taken.left() && taken.right());
    EXPECT_EQ(taken.image(3) != nullptr, t <= 250) << t;
  }
  const Ingest::Arrival arrivals = ingest.arrivals();
  ASSERT_EQ(arrivals.cameras.size(), 4u);
  EXPECT_EQ(*arrivals.cameras[0].image, ms(1400));
  EXPECT_EQ(*arrivals.cameras[2].image, ms(1150));
  EXPECT_EQ(*arrivals.cameras[3].image, ms(1250));
  EXPECT_EQ(arrivals.cameras[0].period->ns, 50'000'000);
  EXPECT_EQ(ingest.counts().images_incomplete, 5);
}

/// Its frames are not incomplete, and none is taken for one without images.
TEST(Ingest, CamerasMayDeliverAlone) {
  Time now = ms(1000);
  Ingest one(
      1, [&] { return now; }, {}, {}, {}, 1),
      three(
          1, [&] { return now; }, {}, {}, {}, 3);
  begin(one, now), begin(three, now);
  for (std::int64_t t = 0; t < 60; t += 6) {  // closer together than an image that comes twice
    now = ms(1000 + t);
    const auto n = static_cast<std::uint8_t>(t);
    one.push(StereoFrame{ms(t), {image(n)}});
    three.push(StereoFrame{ms(t), {nullptr, nullptr, image(n)}});
    EXPECT_TRUE(one.pop_waiting() && three.pop_waiting()) << t;
  }
  EXPECT_EQ(one.counts().images_incomplete, 0);
  EXPECT_EQ(three.counts().images_late, 0);
}

TEST(Ingest, AnImageThatComesTwiceIsOne) {
  Fixture f;
  f.begin();
  for (std::int64_t t = 0; t < 500; t += 50) {
    f.see(t, static_cast<std::uint8_t>(t / 50), static_cast<std::uint8_t>(t / 50 + 100));
    const auto event = f.ingest.pop_waiting();
    ASSERT_TRUE(event);
    EXPECT_NE(std::get<StereoFrame>(*event).left(), nullptr);
    f.see(t + 1, static_cast<std::uint8_t>(t / 50), static_cast<std::uint8_t>(t / 50 + 100));
    EXPECT_FALSE(f.ingest.pop_waiting());
  }
  EXPECT_EQ(f.ingest.counts().images_late, 10);
}

TEST(Ingest, AReadingOrAnImageThatIsLateChangesNoOtherStamp) {
  Fixture f;
  std::int64_t images = 0;
  for (std::int64_t t = 0; t < 3000; t += 5) {
    f.read(t, t == 1000 ? t - 150 : t);
    if (t % 50 != 0) continue;
    f.now = ms(1000 + t);
    f.ingest.push(StereoFrame{ms(t == 2000 ? t - 150 : t), {image(static_cast<std::uint8_t>(t / 50)), image(255)}});
    EXPECT_TRUE(t == 2000 || f.ingest.arrivals().newest == ms(t));
    ++images;
  }
  const LiveCounts counts = f.ingest.counts();
  EXPECT_EQ(counts.clock_leaps, 0);
  EXPECT_EQ(counts.imu_late, 1);
  EXPECT_EQ(counts.images, images);
  EXPECT_EQ(counts.images_late, 1);
  EXPECT_EQ(f.told.size(), 599u);
  EXPECT_EQ(f.told.back(), ms(2995));
}

/// The first stamp may be the wrong one.
TEST(Ingest, AFirstStampThatIsWrongIsNotTheClock) {
  Fixture f;
  for (std::int64_t t = 0; t < 1000; t += 5) f.read(t, t == 0 ? 3'600'000 : t);
  EXPECT_EQ(f.ingest.counts().clock_leaps, 0);
  EXPECT_EQ(f.ingest.counts().imu_late, 1);
  EXPECT_EQ(f.told.front(), ms(5));
  EXPECT_EQ(f.told.size(), 199u);
}

/// A jump is established a quarter of a second after it; the readings of that time are not lost.
TEST(Ingest, NoReadingIsLostWhenTheClockJumps) {
  Fixture f;
  for (std::int64_t t = 0; t < 2000; t += 5) f.read(t, t < 1000 ? t : t - 700'000);
  EXPECT_EQ(f.ingest.counts().clock_leaps, 1);
  ASSERT_EQ(f.told.size(), 400u);
  for (std::size_t k = 0; k < f.told.size(); ++k) EXPECT_EQ(f.told[k], ms(5 * static_cast<std::int64_t>(k)));
}

/// After a clock was set back the estimate begins anew with one image, and no image of before has the mark.
TEST(Ingest, TheFirstImageAfterAClockWasSetBackSaysSo) {
  for (const std::int64_t offset_ms : {0, 2}) {  // the camera's stamp is the first one, or the IMU's
    Fixture f;
    std::vector<Time> marked;
    for (std::int64_t t = 0; t < 4000; t += 1) {
      const std::int64_t back = t < 2000 ? 0 : 1000;
      f.now = ms(1000 + t);
      if (t % 50 == offset_ms) f.ingest.push(StereoFrame{ms(t - back), {image(static_cast<std::uint8_t>(t / 50)), image(255)}});
      if (t % 5 == 0) f.ingest.push(reading(t - back));
      while (const auto event = f.ingest.pop_waiting())
        if (const auto* frame = std::get_if<StereoFrame>(&*event); frame && frame->after_clock_step) marked.push_back(frame->t);
    }
    ASSERT_EQ(marked.size(), 1u) << offset_ms;
    EXPECT_GE(marked[0], ms(2250));
    EXPECT_LE(marked[0], ms(2310));
    EXPECT_EQ(f.ingest.counts().clock_leaps, 2);
    EXPECT_EQ(f.ingest.counts().clock_set_back, 1);
    EXPECT_EQ(f.ingest.arrivals().set_back, Duration{1'000'000'000});
  }
}

TEST(Ingest, ReadingsThatTheSensorCannotHaveMadeAreSilence) {
  Fixture f;
  for (std::int64_t t = 0; t < 1000; t += 5) {
    f.now = ms(1000 + t);
    ImuSample s = reading(t < 500 ? t : 500);
    s.t = ms(t);
    if (t == 200) s.accel_mps2.x() = 1e6;
    if (t == 300) s.gyro_radps.z() = std::numeric_limits<double>::quiet_NaN();
    f.ingest.push(s);
  }
  EXPECT_EQ(f.ingest.counts().imu, 200);
  EXPECT_EQ(f.ingest.counts().imu_refused, 2 + 89) << "it repeats itself from 500 ms on";
  EXPECT_EQ(f.told.size(), 109u);
  EXPECT_EQ(f.ingest.arrivals().imu, ms(1550));
}

TEST(Ingest, ReadingsAreOnTheImagesClock) {
  Time now = ms(1000);
  std::vector<Time> stamps, host;
  Ingest ingest(
      1, [&] { return now; }, [&](const ImuSample& s, Time t) { stamps.push_back(s.t), host.push_back(t); }, {},
      Duration{-50'000'000});
  for (std::int64_t t = 0; t < 1000; t += 5) {
    now = ms(1000 + t);
    ingest.push(reading(t - 50));
  }
  EXPECT_EQ(stamps.back(), ms(945)) << "the recording keeps the sensor's own stamps";
  EXPECT_EQ(host.back(), ms(1995));
  EXPECT_EQ(ingest.arrivals().newest, ms(995));
}

TEST(Ingest, TwoThreadsMayPush) {
  // Everything arrives at once and a second late: no stamp is ahead of its arrival.
  Ingest ingest(1, [] { return ms(5000); }, {});
  std::jthread imu([&] {
    for (std::int64_t t = 4001; t <= 6000; ++t) ingest.push(reading(t));
  });
  std::jthread camera([&] {
    for (std::int64_t t = 1; t <= 200; ++t)
      ingest.push(StereoFrame{ms(4000 + 10 * t), {image(static_cast<std::uint8_t>(t)), image(static_cast<std::uint8_t>(t + 7))}});
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

}  // namespace ingest_test
}  // namespace fbvins
