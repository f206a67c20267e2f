// SPDX-License-Identifier: Apache-2.0
#include "fbvins/loop/map_journal.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <utility>
#include <vector>

#include "fbvins/core/rng.hpp"
#include "fbvins/loop/loop_closer.hpp"
#include "fbvins/loop/map_file.hpp"
#include "tests/support/anchored_flight.hpp"
#include "tests/support/test_room.hpp"

namespace fbvins {
namespace map_journal_test {

constexpr std::size_t kHeaderBytes = 32;

using namespace test_room;
namespace fs = std::filesystem;

std::string bytes_at(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_file(const std::string& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

/// A flight that keeps its map in a journal, as `fbvins live --map` does.
class KeptFlight {
 public:
  KeptFlight(std::string path, PlaceMap map, const LoopOptions& options = {})
      : path_(std::move(path)), closer_(rig(), options, vocabulary(), std::move(map)) {}

  void fly(int keyframes, double start_s, std::uint64_t seed) {
    const Pose<G, G> elsewhere(about_z(2.0), Vec3(5, -3, 1));
    Rng rng(seed);
    for (const Frame& f : flight(room(1), keyframes, 0.002, 0.02, seed, start_s)) {
      Keyframe k = keyframe(FrameId{f.t.ns}, f.t, elsewhere * f.odometry);
      k.anchors = seen_tags(f, rng, 0);
      for (Anchor& a : k.anchors) std::get<TagAnchor>(a).T_AT = unknown_place();
      closer_.process(f.place, k);
    }
  }
  /// Returns how many bytes it took.
  std::size_t keep() {
    const Result<std::string> news = journal_.news(map());
    EXPECT_TRUE(news.ok());
    EXPECT_TRUE(news->empty() || write_map_bytes(path_, *news).ok());
    return news->size();
  }
  void lose() { journal_.begin_anew(); }
  PlaceMap map() const {
    const std::optional<PlaceMap> reduced = closer_.reduced();
    return reduced ? *reduced : closer_.map();
  }
  LoopCloser& closer() { return closer_; }

 private:
  std::string path_;
  LoopCloser closer_;
  MapJournal journal_;
};

class Journal : public testing::Test {
 protected:
  fs::path folder_ = fs::temp_directory_path() / ("fbvins_map_journal_test_" + std::to_string(::getpid()));
  std::string path_ = (folder_ / "m.fbm").string(), journal_ = path_ + ".journal";
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  std::string on_disk() const { return *map_bytes(*open_map(path_, 100'000)); }
  /// The file that the flights below continue.
  void save_a_flown_map() {
    KeptFlight first(path_, {});
    first.fly(60, 0, 2);
    first.closer().finish();
    ASSERT_TRUE(save_map(first.map(), path_).ok());
  }
};

TEST_F(Journal, WithItTheFileIsToTheByteTheMapAtTheLastNews) {
  save_a_flown_map();
  const std::string file = bytes_at(path_);
  KeptFlight flight(path_, *open_map(path_, 100'000));
  std::vector<std::size_t> written;
  for (int part = 0; part < 6; ++part) {
    flight.fly(15, 7.3 + 3 * part, 9);
    written.push_back(flight.keep());
    EXPECT_TRUE(on_disk() == *map_bytes(flight.map())) << part;
    EXPECT_TRUE(*map_bytes(*load_map(path_)) == *map_bytes(flight.map())) << part;
  }
  EXPECT_TRUE(bytes_at(path_) == file) << "it is not touched in flight";
  EXPECT_GT(flight.map().size(), open_map(path_, 0)->base->keyframes.size()) << "some of the flight joined";
  EXPECT_EQ(fs::file_size(journal_), written[0] + written[1] + written[2] + written[3] + written[4] + written[5]);
  EXPECT_LT(written.back(), file.size() / 2);
  EXPECT_GT(open_map(path_, 0)->tags.size(), 3u);
  EXPECT_EQ(flight.keep(), 0u) << "nothing is new";
  flight.closer().finish();
  ASSERT_TRUE(save_map(flight.map(), path_).ok());
  EXPECT_FALSE(fs::exists(journal_)) << "the file has all";
  EXPECT_TRUE(on_disk() == *map_bytes(flight.map()));
}

TEST_F(Journal, AFlightThatBeginsAMapKeepsItBesideAnEmptyFile) {
  KeptFlight flight(path_, {});
  EXPECT_EQ(flight.keep(), 0u) << "no map, no files";
  EXPECT_FALSE(fs::exists(path_));
  for (int part = 0; part < 4; ++part) {
    flight.fly(10, 2 * part, 3);
    EXPECT_GT(flight.keep(), 0u);
    EXPECT_TRUE(on_disk() == *map_bytes(flight.map())) << part;
  }
  EXPECT_LT(fs::file_size(path_), 200u);
  EXPECT_EQ(open_map(path_, 0)->vocabulary, vocabulary().fingerprint());
}

TEST_F(Journal, TheNextFlightGoesOnWithItAndItsOwnHoldsBoth) {
  save_a_flown_map();
  {
    KeptFlight killed(path_, *open_map(path_, 100'000));
    killed.fly(40, 7.3, 9);
    killed.keep();
  }
  const std::size_t after_the_kill = open_map(path_, 0)->size();
  KeptFlight flight(path_, *open_map(path_, 100'000));
  EXPECT_EQ(flight.map().size(), after_the_kill);
  flight.fly(40, 3.1, 11);
  flight.keep();
  EXPECT_GT(flight.map().size(), after_the_kill);
  EXPECT_TRUE(on_disk() == *map_bytes(flight.map()));
  flight.fly(10, 11.1, 12);
  flight.lose();
  flight.keep();
  EXPECT_TRUE(on_disk() == *map_bytes(flight.map())) << "all of it again, after bytes that were lost";
}

TEST_F(Journal, CutAnywhereItGivesTheNewestWholeState) {
  save_a_flown_map();
  std::vector<std::pair<std::size_t, std::string>> states = {{0, bytes_at(path_)}};
  KeptFlight flight(path_, *open_map(path_, 100'000));
  for (int part = 0; part < 4; ++part) {
    flight.fly(15, 7.3 + 3 * part, 9);
    if (flight.keep() > 0) states.emplace_back(fs::file_size(journal_), *map_bytes(flight.map()));
  }
  ASSERT_GE(states.size(), 4u);
  const std::string whole = bytes_at(journal_);
  Rng rng(5);
  for (int i = 0; i < 100; ++i) {
    const std::size_t near = states[rng.below(static_cast<std::uint32_t>(states.size()))].first;
    const std::size_t cut =
        std::min(whole.size(), i % 2 == 0 ? rng.below(static_cast<std::uint32_t>(whole.size())) : near + rng.below(60) - 30);
    write_file(journal_, whole.substr(0, cut));
    if (cut < kHeaderBytes) {
      EXPECT_FALSE(open_map(path_, 0).ok()) << "the header is written in one piece";
      continue;
    }
    const auto newest = std::ranges::find_if(states.rbegin(), states.rend(), [&](const auto& s) { return s.first <= cut; });
    ASSERT_TRUE(on_disk() == newest->second) << cut;
  }
}

TEST_F(Journal, ABlockThatIsNotWhatWasWrittenIsAnErrorAndTheFileStays) {
  save_a_flown_map();
  KeptFlight flight(path_, *open_map(path_, 100'000));
  flight.fly(15, 7.3, 9);
  ASSERT_GT(flight.keep(), 0u);
  std::string bytes = bytes_at(journal_);
  bytes[bytes.size() / 2] ^= 1;
  write_file(journal_, bytes);
  const auto map = open_map(path_, 0);
  ASSERT_FALSE(map.ok());
  EXPECT_NE(map.error().message.find("a checksum differs at byte"), std::string::npos) << map.error().message;
  EXPECT_EQ(bytes_at(journal_), bytes);
}

TEST_F(Journal, DamagedItGivesAnEarlierStateOrAnErrorWithASentence) {
  save_a_flown_map();
  std::set<std::string> states = {bytes_at(path_)};
  KeptFlight flight(path_, *open_map(path_, 100'000));
  for (int part = 0; part < 3; ++part) {
    flight.fly(15, 7.3 + 3 * part, 9);
    if (flight.keep() > 0) states.insert(*map_bytes(flight.map()));
  }
  const std::string good = bytes_at(journal_);
  Rng rng(6);
  for (int i = 0; i < 100; ++i) {
    std::string bad = good;
    const auto size = static_cast<std::uint32_t>(good.size());
    bad[i % 3 == 0 ? rng.below(120) : rng.below(size)] ^= static_cast<char>(1u << rng.below(8));
    write_file(journal_, bad);
    const auto map = open_map(path_, 100'000);
    EXPECT_TRUE(map ? states.contains(*map_bytes(*map)) : map.error().message.starts_with(journal_ + ": ")) << i;
  }
}

TEST_F(Journal, OfAnotherFileItCountsForNothing) {
  save_a_flown_map();
  KeptFlight flight(path_, *open_map(path_, 100'000));
  flight.fly(40, 7.3, 9);
  ASSERT_GT(flight.keep(), 0u);
  PlaceMap other = *load_map(path_);
  other.name = "another";
  const std::string bytes = serialise_map(other);
  write_file(path_, bytes);
  EXPECT_TRUE(on_disk() == bytes);
  KeptFlight next(path_, *open_map(path_, 100'000));
  next.fly(40, 3.1, 11);
  ASSERT_GT(next.keep(), 0u);
  EXPECT_TRUE(on_disk() == *map_bytes(next.map())) << "it is replaced";
}

TEST_F(Journal, WordsOfAnotherVocabularyAreMadeAnewByTheNextFlight) {
  save_a_flown_map();
  PlaceMap without = *load_map(path_);
  without.vocabulary = 0;
  ASSERT_TRUE(save_map(without, path_).ok());
  KeptFlight flight(path_, *load_map(path_));
  flight.fly(40, 7.3, 9);
  ASSERT_GT(flight.keep(), 0u);
  EXPECT_EQ(open_map(path_, 0)->vocabulary, 0u);
  KeptFlight next(path_, *load_map(path_));
  EXPECT_TRUE(*map_bytes(next.map()) == *map_bytes(flight.map()));
}

TEST_F(Journal, WhatIsOutOfDateInItIsBounded) {
  LoopOptions options;
  options.thin_above = 10;
  options.max_keyframes = 30;
  KeptFlight flight(path_, {}, options);
  std::uintmax_t largest = 0, flown = 0;
  bool shrank = false;
  for (int part = 0; part < 60; ++part) {
    flight.fly(5, 1.0 * part, 3);
    flown += flight.keep();
    const std::uintmax_t now = fs::file_size(journal_);
    shrank = shrank || now < largest;
    largest = std::max(largest, now);
  }
  EXPECT_TRUE(on_disk() == *map_bytes(flight.map()));
  EXPECT_TRUE(shrank);
  EXPECT_LT(largest, 3 * map_bytes(flight.map())->size() + 1'200'000);
  EXPECT_GT(flown, largest);
}

TEST_F(Journal, AKillAtAnyMomentLeavesAStateOfIt) {
  save_a_flown_map();
  KeptFlight flight(path_, *open_map(path_, 100'000));
  std::vector<std::string> pieces;
  std::set<std::string> states = {bytes_at(path_)};
  MapJournal journal;
  for (int part = 0; part < 6; ++part) {
    flight.fly(10, 7.3 + 2 * part, 9);
    pieces.push_back(*journal.news(flight.map()));
    states.insert(*map_bytes(flight.map()));
  }
  Rng rng(7);
  int midway = 0;
  for (int i = 0; i < 20; ++i) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0)
      for (;;)  // until killed
        for (const std::string& piece : pieces)
          if (!piece.empty()) (void)write_map_bytes(path_, piece);
    ::usleep(500 + rng.below(8000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    const auto map = load_map(path_);
    ASSERT_TRUE(map.ok()) << map.error().message;
    const std::string now = *map_bytes(*map);
    EXPECT_TRUE(states.contains(now));
    midway += now != *states.begin() && now != *map_bytes(flight.map());
  }
  EXPECT_GT(midway, 0) << "no kill hit a flight: the test shows nothing";
}

}  // namespace map_journal_test
}  // namespace fbvins
