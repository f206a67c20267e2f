// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/place_store.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_file.hpp"
#include "fbvins/loop/map_front.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins {
namespace place_store_test {

using namespace test_room;
namespace fs = std::filesystem;

constexpr std::uint64_t kFewPlaces_bytes = 100'000;

PlaceMap flown_map(int keyframes) {
  LoopCloser closer(rig(), {}, vocabulary());
  for (const Frame& f : flight(room(1), keyframes, 0.002, 0.02, 2))
    closer.process(f.place, keyframe(FrameId{f.t.ns}, f.t, f.odometry));
  closer.finish();
  return closer.map();
}

class StoredMap : public testing::Test {
 protected:
  fs::path folder_ = fs::temp_directory_path() / ("fbvins_place_store_test_" + std::to_string(::getpid()));
  std::string path_ = (folder_ / "m.fbm").string();
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& bytes) const { std::ofstream(path_, std::ios::binary) << bytes; }
};

struct Flown {
  std::vector<MapUpdate> updates;
  std::string map;
  std::uint64_t most_held_bytes = 0;
};

Flown fly_in(PlaceMap map) {
  Flown out;
  LoopCloser closer(rig(), {}, vocabulary(), std::move(map));
  const Pose<G, G> elsewhere(about_z(2.0), Vec3(5, -3, 1));
  for (const Frame& f : flight(room(1), 80, 0.002, 0.02, 9, 7.3)) {
    out.updates.push_back(closer.process(f.place, keyframe(FrameId{f.t.ns}, f.t, elsewhere * f.odometry)));
    if (closer.map().store) out.most_held_bytes = std::max(out.most_held_bytes, closer.map().store->held_bytes());
  }
  closer.finish();
  out.map = *map_bytes(closer.map());
  return out;
}

TEST_F(StoredMap, AFlightInItIsTheSameAsInAMapInMemory) {
  ASSERT_TRUE(save_map(flown_map(200), path_).ok());
  const Flown whole = fly_in(*load_map(path_)), stored = fly_in(*open_map(path_, kFewPlaces_bytes));
  EXPECT_EQ(whole.most_held_bytes, 0u);
  EXPECT_GT(stored.most_held_bytes, 0u);
  EXPECT_LE(stored.most_held_bytes, kFewPlaces_bytes);
  ASSERT_EQ(stored.updates.size(), whole.updates.size());
  int found = 0, accepted = 0;
  for (std::size_t i = 0; i < whole.updates.size(); ++i) {
    const MapUpdate &a = whole.updates[i], &b = stored.updates[i];
    EXPECT_EQ(a.localised, b.localised);
    EXPECT_EQ(a.stats.candidates, b.stats.candidates);
    EXPECT_EQ(a.stats.accepted, b.stats.accepted);
    EXPECT_EQ(a.T_MG.p, b.T_MG.p);
    EXPECT_EQ(a.T_MG.q.coeffs(), b.T_MG.q.coeffs());
    found += a.found, accepted += a.stats.accepted;
  }
  EXPECT_EQ(found, 1);
  EXPECT_GT(accepted, 20);
  EXPECT_TRUE(stored.map == whole.map) << "the same bytes";
}

TEST_F(StoredMap, IsWrittenAsItIsAndAlsoWithoutSomeOfItsKeyframes) {
  PlaceMap whole = flown_map(40);
  ASSERT_TRUE(save_map(whole, path_).ok());
  PlaceMap stored = *open_map(path_, 0);
  EXPECT_TRUE(*map_bytes(stored) == serialise_map(whole));
  for (const int id : {3, 11, 12, 30}) whole.remove(KeyframeId{id}), stored.remove(KeyframeId{id});
  EXPECT_TRUE(*map_bytes(stored) == serialise_map(whole));
  ASSERT_TRUE(save_map(stored, path_).ok()) << "its own file is replaced";
  EXPECT_TRUE(*map_bytes(stored) == serialise_map(whole)) << "the old one is there as long as it is needed";
  EXPECT_TRUE(*map_bytes(*load_map(path_)) == serialise_map(whole));
  ASSERT_TRUE(read_places(stored).ok());
  EXPECT_FALSE(stored.store);
  EXPECT_TRUE(serialise_map(stored) == serialise_map(whole));
}

TEST_F(StoredMap, ItsWordsAreThoseOfAMapInMemory) {
  const PlaceMap whole = flown_map(40);
  ASSERT_TRUE(save_map(whole, path_).ok());
  const PlaceMap stored = *open_map(path_, 0);
  ASSERT_EQ(stored.vocabulary, vocabulary().fingerprint());
  InvertedIndex from_file(vocabulary().words()), in_memory(vocabulary().words());
  from_file.add(stored.store);
  for (const MapKeyframe& k : whole.keyframes()) in_memory.add(k.id, k.place.words);
  const KeyframeId gone = whole.keyframes()[5].id;
  const std::vector<KeyframeId> few = {whole.keyframes()[2].id, gone, whole.keyframes()[20].id};
  for (const bool removed : {false, true}) {
    if (removed) from_file.remove(gone, {}), in_memory.remove(gone, whole.find(gone)->place.words);
    for (const MapKeyframe& k : whole.keyframes()) {
      const auto a = from_file.query(k.place.words, 10), b = in_memory.query(k.place.words, 10);
      const auto among_a = from_file.query(k.place.words, 10, few), among_b = in_memory.query(k.place.words, 10, few);
      const auto same = [](const IndexHit& x, const IndexHit& y) {
        return x.keyframe == y.keyframe && x.similarity == y.similarity;
      };
      EXPECT_TRUE(std::ranges::equal(a, b, same));
      EXPECT_TRUE(std::ranges::equal(among_a, among_b, same));
      EXPECT_EQ(among_a.size(), removed ? 2u : 3u);
    }
  }
}

TEST_F(StoredMap, KeepsThePlacesThatWereUsedLast) {
  ASSERT_TRUE(save_map(flown_map(40), path_).ok());
  const PlaceMap map = *open_map(path_, kFewPlaces_bytes);
  const auto first = map.store->place(0);
  EXPECT_EQ(map.store->place(0), first) << "it is not read again";
  for (std::size_t slot = 1; slot < map.size(); ++slot) {
    EXPECT_EQ(map.store->place(slot)->size(), map.store->at(slot).features);
    EXPECT_LE(map.store->held_bytes(), kFewPlaces_bytes);
  }
  EXPECT_NE(map.store->place(0), first);
  EXPECT_EQ(map.store->place(0)->descriptors, first->descriptors) << "whoever holds one can go on using it";
}

/// Where the front of a file begins.
std::uint64_t front_of(const std::string& bytes) {
  std::uint64_t at = 0;
  std::memcpy(&at, bytes.data() + bytes.size() - 24, sizeof at);
  return at;
}

TEST_F(StoredMap, WhatIsDamagedInAPlaceIsPassedOverInFlightAndIsNeverWritten) {
  std::string bytes = serialise_map(flown_map(40));
  bytes[16 + 1000] ^= 1;
  write(bytes);
  const auto whole = load_map(path_);
  ASSERT_FALSE(whole.ok());
  EXPECT_EQ(whole.error().message, path_ + ": damaged map: keyframe 0 is not as it was written");
  const auto map = open_map(path_, 0);
  ASSERT_TRUE(map.ok()) << map.error().message;
  EXPECT_EQ(map->place_of(map->keyframes()[0])->size(), 0u);
  EXPECT_GT(map->place_of(map->keyframes()[1])->size(), 0u);
  ASSERT_TRUE(map->store->damage());
  EXPECT_EQ(map->store->damage()->message, whole.error().message);
  const auto saved = save_map(*map, (folder_ / "other.fbm").string());
  ASSERT_FALSE(saved.ok());
  EXPECT_EQ(saved.error().message, whole.error().message);
  EXPECT_FALSE(fs::exists(folder_ / "other.fbm"));
}

TEST_F(StoredMap, WhatIsDamagedInTheWordsIsPassedOverInFlight) {
  std::string bytes = serialise_map(flown_map(40));
  bytes[front_of(bytes) - 1] ^= 1;  // of the last list
  write(bytes);
  const PlaceMap map = *open_map(path_, 0);
  EXPECT_TRUE(map.store->keyframes_with(map.store->words().back()).empty());
  ASSERT_TRUE(map.store->damage());
  EXPECT_NE(map.store->damage()->message.find("the keyframes with word"), std::string::npos);
  EXPECT_FALSE(map_bytes(map).ok());
  EXPECT_FALSE(load_map(path_).ok());
}

TEST_F(StoredMap, AFileThatWasCutShortIsNotOpened) {
  const std::string bytes = serialise_map(flown_map(40));
  for (const std::size_t left : {std::size_t{0}, std::size_t{3}, std::size_t{20}, bytes.size() / 2, bytes.size() - 1}) {
    write(bytes.substr(0, left));
    const auto map = open_map(path_, 0);
    ASSERT_FALSE(map.ok()) << left;
    EXPECT_TRUE(map.error().message.starts_with(path_ + ": damaged map: ")) << map.error().message;
  }
  write(bytes);
  const PlaceMap map = *open_map(path_, 0);
  fs::resize_file(path_, 100);
  EXPECT_EQ(map.store->place(20)->size(), 0u) << "a file that shrinks in flight";
  EXPECT_TRUE(map.store->damage());
}

}  // namespace place_store_test
}  // namespace fbvins
