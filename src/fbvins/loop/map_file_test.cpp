// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_file.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <limits>

#include "fbvins/core/rng.hpp"
#include "fbvins/loop/binary_file.hpp"

namespace fbvins {
namespace map_file_test {

namespace fs = std::filesystem;

PlaceMap map_of(int keyframes, std::uint64_t seed) {
  Rng rng(seed);
  PlaceMap map;
  map.cameras[0] = {so3_exp(Vec3(0.1, -1.2, 0.3)), Vec3(0.01, 0.02, 0.03)};
  for (int i = 0; i < keyframes; ++i) {
    MapKeyframe k;
    k.t = Time{1000 * i};
    k.T_GB = {so3_exp(Vec3(0, 0, 0.1 * i)), Vec3(i, 1, 2)};
    k.T_MB = {so3_exp(Vec3(0, 0, 0.11 * i)), Vec3(i, 1.1, 2)};
    k.place.up_C0 = Vec3(0, -1, 0);
    for (int f = 0; f < 50; ++f) {
      k.place.features.push_back({static_cast<float>(rng.uniform()), static_cast<float>(rng.uniform()), 0.3f, 0.001f, 0.01f});
      k.place.descriptors.push_back({{rng.next_u32(), rng.next_u32(), rng.next_u32(), rng.next_u32()}});
    }
    map.add(std::move(k));
    if (i > 0)
      map.edges.push_back({KeyframeId{i - 1},
                           KeyframeId{i},
                           {so3_exp(Vec3(0, 0, 0.1)), Vec3(1, 0, 0)},
                           Mat6::Identity(),
                           MapEdge::Kind::odometry});
  }
  return map;
}

PlaceMap anchored_map_of(int keyframes, std::uint64_t seed) {
  PlaceMap map = map_of(keyframes, seed);
  map.anchored = true;
  map.add_anchor({KeyframeId{0}, measurement_of(PositionAnchor{.p_A = Vec3(1, 2, 3), .p_B = Vec3(0.1, 0, 0)})});
  map.add_anchor({KeyframeId{1}, measurement_of(HeightAnchor{.z_A_m = 1})});
  map.add_anchor({KeyframeId{2}, measurement_of(TagAnchor{.T_BT = {so3_exp(Vec3(1, 0, 0.2)), Vec3(2, 0, 0)}})});
  return map;
}

PlaceMap with_words(PlaceMap map) {
  map.vocabulary = 77;
  for (MapKeyframe& k : map.keyframes()) k.place.words = {{2, 0.25f}, {static_cast<std::int32_t>(10 + k.id.value), 0.75f}};
  return map;
}

std::span<const std::byte> view(const std::string& s) { return std::as_bytes(std::span(s)); }

class MapFile : public testing::Test {
 protected:
  fs::path folder_ = fs::temp_directory_path() / ("fbvins_map_test_" + std::to_string(::getpid()));
  std::string path_ = (folder_ / "m.fbm").string();
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
};

TEST_F(MapFile, WhatWasSavedIsLoadedBitForBit) {
  const PlaceMap map = map_of(30, 1);
  ASSERT_TRUE(save_map(map, path_).ok());
  const auto loaded = load_map(path_);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_EQ(serialise_map(*loaded), serialise_map(map));
  EXPECT_EQ(loaded->keyframes()[7].place.features, map.keyframes()[7].place.features);
}

/// Each third place was seen by another camera.
PlaceMap of_two_cameras(PlaceMap map) {
  const std::uint16_t other = map.camera_at({so3_exp(Vec3(0, 0, 3)), Vec3(-0.1, 0, 0)});
  for (std::size_t i = 1; i < map.size(); i += 3) map.keyframes()[i].camera = other;
  return map;
}

TEST_F(MapFile, RemembersWhichCameraSawEachPlace) {
  const PlaceMap map = of_two_cameras(anchored_map_of(10, 1));
  ASSERT_TRUE(save_map(map, path_).ok());
  const auto loaded = load_map(path_);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_EQ(serialise_map(*loaded), serialise_map(map));
  for (std::size_t i = 0; i < map.size(); ++i)
    EXPECT_EQ(loaded->T_BC(loaded->keyframes()[i]).p, map.T_BC(map.keyframes()[i]).p) << i;
}

TEST_F(MapFile, ACameraThatIsNotThereIsDamage) {
  PlaceMap map = of_two_cameras(map_of(10, 1));
  map.keyframes()[9].camera = 2;
  EXPECT_FALSE(parse_map(view(serialise_map(map)), "m").ok());
}

TEST_F(MapFile, RemembersWhichDescriptorsItHolds) {
  PlaceMap map = map_of(3, 1);
  EXPECT_FALSE(parse_map(view(serialise_map(map)), "map")->boosted);
  map.boosted = true;
  EXPECT_TRUE(parse_map(view(serialise_map(map)), "map")->boosted);
}

TEST_F(MapFile, AnchorsAreKept) {
  PlaceMap map = anchored_map_of(5, 1);
  for (const char* name : {"", "Hall 3"}) {
    map.name = name;
    const auto parsed = parse_map(view(serialise_map(map)), "map");
    ASSERT_TRUE(parsed.ok()) << parsed.error().message;
    EXPECT_TRUE(parsed->anchored);
    ASSERT_EQ(parsed->anchors.size(), 3u);
    EXPECT_EQ(parsed->anchors[2].measured.information, map.anchors[2].measured.information);
    EXPECT_EQ(serialise_map(*parsed), serialise_map(map));
  }
  map.keyframes()[1].placed = false;
  EXPECT_EQ(parse_map(view(serialise_map(map)), "map")->anchors.size(), 2u);
  EXPECT_FALSE(parse_map(view(serialise_map(map_of(5, 1))), "map")->anchored);
}

TEST_F(MapFile, WordsAreKeptWithTheirVocabulary) {
  const PlaceMap map = with_words(map_of(5, 1));
  const auto parsed = parse_map(view(serialise_map(map)), "map");
  ASSERT_TRUE(parsed.ok()) << parsed.error().message;
  EXPECT_EQ(parsed->vocabulary, 77u);
  for (std::size_t i = 0; i < map.size(); ++i) EXPECT_EQ(parsed->keyframes()[i].place.words, map.keyframes()[i].place.words);
  EXPECT_EQ(serialise_map(*parsed), serialise_map(map));
  EXPECT_LT(serialise_map(map_of(5, 1)).size(), serialise_map(map).size()) << "without a vocabulary none are written";
}

TEST_F(MapFile, AFileOfVersion1IsReadAndWrittenAsTheNewest) {
  const auto old = load_map(FBVINS_SOURCE_DIR "/tests/data/map_version_1.fbm");
  ASSERT_TRUE(old.ok()) << old.error().message;
  EXPECT_EQ(old->name, "Hall 3");
  EXPECT_TRUE(old->anchored);
  ASSERT_EQ(old->size(), 4u);
  EXPECT_EQ(old->keyframes()[3].place.size(), 6u);
  EXPECT_EQ(old->keyframes()[3].missed, 3);
  EXPECT_EQ(old->keyframes()[3].T_MB.p, Vec3(3, 1.1, 2));
  ASSERT_EQ(old->edges.size(), 3u);
  EXPECT_EQ(old->edges[1].kind, MapEdge::Kind::loop);
  EXPECT_EQ(old->edges[1].information(5, 5), 3.0);
  EXPECT_EQ(old->anchors.size(), 1u);
  ASSERT_EQ(old->sessions.size(), 2u);
  EXPECT_EQ(old->sessions[1].keyframes, 2);
  ASSERT_TRUE(save_map(*old, path_).ok());
  const auto now = load_map(path_);
  ASSERT_TRUE(now.ok()) << now.error().message;
  EXPECT_EQ(serialise_map(*now), serialise_map(*old));
  EXPECT_EQ(now->keyframes()[3].place.features, old->keyframes()[3].place.features);
  EXPECT_EQ(now->edges[1].information, old->edges[1].information);
}

TEST_F(MapFile, AnotherVersionIsNamed) {
  std::string bytes = serialise_map(map_of(2, 1));
  bytes[8] = 9;
  EXPECT_EQ(parse_map(view(bytes), "flat.fbm").error().message, "flat.fbm: map of version 9, this program reads 1 and 2");
}

TEST_F(MapFile, PlacesWithoutAPoseAreLeftOut) {
  PlaceMap map = map_of(10, 1);
  map.keyframes()[9].placed = false;
  const std::string bytes = serialise_map(map);
  const auto parsed = parse_map(view(bytes), "map");
  ASSERT_TRUE(parsed.ok());
  EXPECT_EQ(parsed->size(), 9u);
  EXPECT_EQ(parsed->edges.size(), 8u);
}

TEST_F(MapFile, EveryDamageIsAnErrorWithASentence) {
  const std::string good = serialise_map(anchored_map_of(5, 2));
  Rng rng(3);
  for (int i = 0; i < 2000; ++i) {
    std::string bad = good;
    const auto size = static_cast<std::uint32_t>(good.size());
    const auto at = i % 2 == 0 ? rng.below(16) : i % 3 == 0 ? size - 1 - rng.below(24) : rng.below(size);
    if (i % 5 == 0) bad.resize(at);
    else bad[at] ^= static_cast<char>(1u << rng.below(8));
    const auto parsed = parse_map(view(bad), "flat.fbm");
    ASSERT_FALSE(parsed.ok()) << "byte " << at;
    EXPECT_NE(parsed.error().message.find("flat.fbm"), std::string::npos);
  }
}

TEST_F(MapFile, ContentThatPassesTheChecksumIsCheckedAllTheSame) {
  // Wrong counts and values, with the checksum made right: an error, never a crash.
  const std::string good = serialise_map(with_words(anchored_map_of(5, 2)));
  std::uint64_t front = 0;
  std::memcpy(&front, good.data() + good.size() - 24, sizeof front);
  const auto front_bytes = static_cast<std::uint32_t>(good.size() - 24 - front);
  Rng rng(4);
  for (int i = 0; i < 3000; ++i) {
    std::string bad = good;
    for (int k = 0; k < 3; ++k) bad[front + rng.below(front_bytes)] = static_cast<char>(rng.below(256));
    if (i % 3 == 0) bad[front + rng.below(8)] = static_cast<char>(rng.below(256));
    std::uint32_t flags = 0;
    std::memcpy(&flags, bad.data() + 12, sizeof flags);
    const std::uint64_t sum = checksum64(view(bad).subspan(front, front_bytes)) ^ flags;
    std::memcpy(bad.data() + bad.size() - 8, &sum, sizeof sum);
    const auto parsed = parse_map(view(bad), "map");
    if (parsed.ok()) {
      EXPECT_LE(parsed->size(), 5u);  // only numbers changed
    } else {
      EXPECT_EQ(parsed.error().code, ErrorCode::malformed);
    }
  }
}

TEST_F(MapFile, AnInformationThatIsNoneIsRefused) {
  for (const double bad : {-1.0, 0.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    PlaceMap map = map_of(3, 1);
    map.edges[1].information(2, 2) = bad;
    const auto parsed = parse_map(view(serialise_map(map)), "flat.fbm");
    ASSERT_FALSE(parsed.ok()) << bad;
    EXPECT_EQ(parsed.error().message, "flat.fbm: damaged map: its content makes no sense");
  }
}

TEST_F(MapFile, AKillAtAnyMomentLeavesTheOldOrTheNewFileWhole) {
  const PlaceMap a = map_of(40, 1), b = map_of(60, 2);
  const std::string bytes_a = serialise_map(a), bytes_b = serialise_map(b);
  ASSERT_TRUE(save_map(a, path_).ok());
  Rng rng(7);
  int killed_midway = 0;
  for (int i = 0; i < 60; ++i) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      for (;;) {  // until killed
        (void)save_map(a, path_);
        (void)save_map(b, path_);
      }
    }
    ::usleep(500 + rng.below(8000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    const auto loaded = load_map(path_);
    ASSERT_TRUE(loaded.ok()) << loaded.error().message;
    const std::string now = serialise_map(*loaded);
    EXPECT_TRUE(now == bytes_a || now == bytes_b);
    for (const auto& entry : fs::directory_iterator(folder_))
      if (entry.path().extension() == ".part") ++killed_midway, fs::remove(entry.path());
  }
  EXPECT_GT(killed_midway, 0) << "no kill hit a write: the test shows nothing";
}

TEST_F(MapFile, ExportsPointsAndKeyframes) {
  const PlaceMap map = map_of(3, 1);
  const std::string ply = map_as_ply(map), tum = map_as_tum(map);
  EXPECT_NE(ply.find("element vertex 150\n"), std::string::npos);
  EXPECT_EQ(std::count(ply.begin(), ply.end(), '\n'), 150 + 10);
  EXPECT_EQ(std::count(tum.begin(), tum.end(), '\n'), 3);
}

}  // namespace map_file_test
}  // namespace fbvins
