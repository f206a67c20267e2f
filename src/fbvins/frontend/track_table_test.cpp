// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/track_table.hpp"

#include <gtest/gtest.h>

#include <set>

namespace fbvins {
namespace track_table_test {

struct Named {
  int name = 0;
};
using Table = TrackTable<TrackState, Named>;

/// A track whose patches carry its number.
void start(Table& table, int name) {
  table.free_patches().name = name;
  table.start({});
}

TEST(TrackTable, KeepsEachTracksPatchesWhileOthersComeAndGo) {
  Table table(3);
  for (const int name : {0, 1, 2}) start(table, name);
  EXPECT_TRUE(table.full());
  table[1].status = TrackStatus::lost;
  table.drop_ended();
  ASSERT_EQ(table.size(), 2u);
  EXPECT_FALSE(table.full());
  start(table, 3);
  EXPECT_TRUE(table.full());
  std::set<std::size_t> slots;
  for (const TrackState& track : table) {
    EXPECT_EQ(table.patches(track).name, track.id.value);
    slots.insert(track.slot);
  }
  EXPECT_EQ(slots.size(), 3u);
}

TEST(TrackTable, MakesPatchesWhenTheyAreNeededAndLeavesThemInPlace) {
  static int made = 0;
  struct Counted {
    Counted() { ++made; }
  };
  TrackTable<TrackState, Counted> table(100);
  EXPECT_EQ(made, 0);
  table.start({});
  const Counted* first = &table.patches(table[0]);
  for (int i = 1; i < 50; ++i) table.start({});
  EXPECT_EQ(made, 50);
  EXPECT_EQ(&table.patches(table[0]), first);
  table.end_all(TrackStatus::lost);
  table.drop_ended();
  for (int i = 0; i < 50; ++i) table.start({});
  EXPECT_EQ(made, 50);
}

TEST(TrackTable, ResumedTracksKeepTheirIdAndNewOnesNeverShareOne) {
  Table table(4);
  start(table, 0);
  start(table, 1);
  const TrackState old = table[0];
  table.end_all(TrackStatus::out_of_view);
  table.drop_ended();
  EXPECT_EQ(table.size(), 0u);
  EXPECT_EQ(table.resume(old).id, TrackId{0});
  EXPECT_EQ(table.start({}).id, TrackId{2});
}

TEST(TrackTable, TellsOfEveryTrackThatEndsAndOfNoOther) {
  Table table(4);
  for (const int name : {0, 1, 2, 3}) start(table, name);
  table[1].status = TrackStatus::lost;
  table[3].status = TrackStatus::out_of_view;
  std::vector<std::pair<int, TrackStatus>> ended;
  table.drop_ended([&](const TrackState& track, const Named& patches) { ended.emplace_back(patches.name, track.status); });
  const std::vector<std::pair<int, TrackStatus>> wanted{{1, TrackStatus::lost}, {3, TrackStatus::out_of_view}};
  EXPECT_EQ(ended, wanted);
}

}  // namespace track_table_test
}  // namespace fbvins
