// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/web_sink.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/support/web_test_client.hpp"

namespace fbvins {
namespace web_sink_test {

using Json = nlohmann::json;

constexpr Time kStart{5'000'000'000};

Time at(int image) { return kStart + Duration{50'000'000LL * image}; }

Odometry odometry(int image) {
  Odometry o;
  o.id = FrameId{image};
  o.t = at(image);
  o.T_WB.p = Vec3(0.1 * image, 0, 0);
  o.health.state = HealthState::good;
  return o;
}

LiveView view(int image) {
  LiveView v;
  v.t = at(image);
  v.shutter_to_pose_ms = 12;
  v.features.push_back({TrackId{image}, Vec2(10, 20), image, 2});
  v.landmarks.push_back({TrackId{image}, Vec3(1, 2, 3)});
  return v;
}

StereoFrame frame(int image) { return {at(image), {std::make_shared<const Image>(64, 48, std::uint8_t(100))}}; }

class Page : public testing::Test {
 protected:
  void open(WebFlight flight = {}, WebActions actions = {}) {
    auto made = WebSink::create({}, {}, std::move(flight), std::move(actions));
    ASSERT_TRUE(made) << made.error().message;
    sink = *std::move(made);
  }
  void fly(int from, int to) {
    for (int i = from; i < to; ++i)
      for (const LiveEvent& event : {LiveEvent(frame(i)), LiveEvent(view(i)), LiveEvent(odometry(i))})
        ASSERT_TRUE(sink->take(event));
  }
  /// The next message of this kind; binary ones are called "1", "2", "3".
  std::string next(TestPeer& peer, const std::string& kind) {
    while (const auto message = peer.message()) {
      const bool is_text = message->starts_with('{');
      if ((is_text ? Json::parse(*message)["type"].get<std::string>() : std::to_string(message->at(0))) == kind) return *message;
    }
    return "{}";
  }
  std::unique_ptr<WebSink> sink;
};

TEST_F(Page, SendsALateViewerTheFlightSoFar) {
  open({.source = "somewhere"});
  fly(0, 100);
  TestPeer peer(sink->port());
  peer.watch();
  EXPECT_EQ(Json::parse(next(peer, "hello"))["start_ns"], std::to_string(kStart.ns));
  const Json history = Json::parse(next(peer, "history"));
  EXPECT_EQ(history["path"].size(), 100u);
  EXPECT_NEAR(history["distance_m"], 9.9, 1e-9);
  EXPECT_EQ(history["series"][50][1], 12.0);
  EXPECT_EQ(next(peer, "3").size(), 24u + 100 * 16);  // where landmarks were
}

TEST_F(Page, ShowsImagesWithTheirOwnFeaturesWhileSomebodyLooks) {
  open();
  TestPeer peer(sink->port());
  peer.watch();
  next(peer, "hello");
  fly(3, 4);
  const Json state = Json::parse(next(peer, "state"));
  EXPECT_EQ(state["image"], 3);
  EXPECT_EQ(state["latency_ms"], 12.0);
  fly(4, 5);  // too soon for another picture
  sink->tell("that was all", false);
  TestPeer late(sink->port());
  late.watch();
  const std::string image = next(late, "1");
  ASSERT_GT(image.size(), 40u);
  float age = 0;
  std::memcpy(&age, image.data() + 32, 4);
  EXPECT_EQ(age, 3);  // of image 3
  const std::string jpeg = image.substr(40);
  int width = 0, height = 0, sampling = 0, colours = 0;
  const tjhandle decoder = tjInitDecompress();
  EXPECT_EQ(tjDecompressHeader3(decoder, reinterpret_cast<const unsigned char*>(jpeg.data()), jpeg.size(), &width, &height,
                                &sampling, &colours),
            0);
  tjDestroy(decoder);
  EXPECT_EQ(width, 64);
  EXPECT_EQ(height, 48);
}

TEST_F(Page, ShowsEachCameraOfARigWithItsOwnFeatures) {
  open();
  TestPeer peer(sink->port());
  peer.watch();
  next(peer, "hello");
  StereoFrame four = frame(3);
  four.images = {four.left(), four.left(), nullptr, four.left()};
  ASSERT_TRUE(sink->take(four));
  LiveView seen = view(3);
  seen.features.push_back({TrackId{8}, Vec2(5, 6), 77, 2, 3});
  ASSERT_TRUE(sink->take(seen));
  ASSERT_TRUE(sink->take(odometry(3)));
  for (const int camera : {0, 1, 3}) {
    const std::string image = next(peer, "1");
    std::uint16_t number = 0;
    std::uint32_t features = 0;
    std::memcpy(&number, image.data() + 2, 2);
    std::memcpy(&features, image.data() + 4, 4);
    EXPECT_EQ(number, camera);
    EXPECT_EQ(features, camera == 1 ? 0u : 1u);
  }
}

TEST_F(Page, ShowsTheRightCameraOfAPairWithItsFeatures) {
  open();
  TestPeer peer(sink->port());
  peer.watch();
  next(peer, "hello");
  StereoFrame pair = frame(3);
  pair.set_image(1, pair.left());
  ASSERT_TRUE(sink->take(pair));
  LiveView seen = view(3);
  for (const double u : {5., 6.}) seen.right_features.push_back({TrackId{8}, Vec2(u, 6), 77, 2, 1});
  ASSERT_TRUE(sink->take(seen));
  ASSERT_TRUE(sink->take(odometry(3)));
  for (const std::uint32_t features : {1u, 2u}) {
    const std::string image = next(peer, "1");
    std::uint32_t count = 0;
    std::memcpy(&count, image.data() + 4, 4);
    EXPECT_EQ(count, features);
  }
}

TEST_F(Page, ButtonsDoWhatIsAllowed) {
  std::atomic<int> marks{0}, saves{0};
  WebFlight flight;
  flight.can_mark = true;
  const auto reset = [](const FlightCommand::Told& told) { told(Error{ErrorCode::invalid_argument, "not now"}); };
  open(flight, {.mark = [&](const std::string& text) { marks += text == "here" ? 1 : 100; },
                .commands = {{"save_map", [&](const FlightCommand::Told&) { ++saves; }, "there is none"}, {"reset", reset}}});
  TestPeer peer(sink->port());
  peer.watch();
  EXPECT_EQ(Json::parse(next(peer, "hello"))["commands"], Json({{"save_map", "there is none"}, {"reset", ""}}));
  peer.say(R"({"do":"save_map"})");
  peer.say(R"({"do":"nothing"})");
  peer.say(R"({"do":"reset"})");
  EXPECT_EQ(Json::parse(next(peer, "note")), Json({{"type", "note"}, {"text", "not now"}, {"bad", true}}));
  peer.say(R"({"do":"mark","text":"here"})");
  for (int i = 0; i < 1000 && marks == 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  EXPECT_EQ(marks, 1);
  EXPECT_EQ(saves, 0);
  ASSERT_TRUE(sink->take(odometry(0)));
  ASSERT_TRUE(sink->take(LiveMark{at(20), "here"}));
  const Json mark = Json::parse(next(peer, "mark"));
  EXPECT_EQ(mark["t_s"], 1.0);
  EXPECT_EQ(mark["text"], "here");
}

TEST_F(Page, AReplayObeysItsOwnButtonsAlone) {
  std::mutex mutex;
  std::vector<WebCommand::Kind> obeyed;
  WebFlight flight{.replay = true};
  open(flight, {.replay = [&](const WebCommand& command) {
         const std::lock_guard lock(mutex);
         obeyed.push_back(command.kind);
       }});
  TestPeer peer(sink->port());
  peer.watch();
  next(peer, "hello");
  for (const char* what : {"mark", "save_map", "play", "pause"}) peer.say(fmt::format(R"({{"do":"{}","text":""}})", what));
  const auto count = [&] {
    const std::lock_guard lock(mutex);
    return obeyed.size();
  };
  for (int i = 0; i < 1000 && count() < 2; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  ASSERT_TRUE(sink->finish());
  EXPECT_EQ(obeyed, (std::vector{WebCommand::Kind::play, WebCommand::Kind::pause}));
}

TEST_F(Page, SaysGoodbye) {
  open();
  TestPeer peer(sink->port());
  peer.watch();
  next(peer, "hello");
  ASSERT_TRUE(sink->finish());
  EXPECT_EQ(Json::parse(next(peer, "end"))["type"], "end");
  EXPECT_TRUE(peer.closed_within(std::chrono::seconds(2)));
  ASSERT_TRUE(sink->take(odometry(1)));  // nobody is there, and nothing happens
}

}  // namespace web_sink_test
}  // namespace fbvins
