// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/csv.hpp"

#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"
#include "fbvins/io/numbers.hpp"

namespace fbvins {
namespace csv_test {

std::vector<bool> kept(std::initializer_list<int> stamps) {
  std::vector<Time> times;
  for (int s : stamps) times.push_back(Time{s});
  return longest_increasing(times);
}

using Bits = std::vector<bool>;

TEST(LongestIncreasing, DropsTheOddOnesOut) {
  EXPECT_EQ(kept({}), Bits());
  EXPECT_EQ(kept({5}), Bits({1}));
  EXPECT_EQ(kept({1, 2, 3}), Bits({1, 1, 1}));
  EXPECT_EQ(kept({1, 2, 2, 3}), Bits({1, 1, 0, 1}));
  EXPECT_EQ(kept({1, 2, 3, 2, 4}), Bits({1, 1, 1, 0, 1}));
  EXPECT_EQ(kept({10, 20, 30, 25, 40}), Bits({1, 1, 1, 0, 1}));
  EXPECT_EQ(kept({1, 900, 2, 3, 4}), Bits({1, 0, 1, 1, 1}));
  EXPECT_EQ(kept({900, 1, 2}), Bits({0, 1, 1}));
}

TEST(LongestIncreasing, AgreesWithTheQuadraticMethodOnLength) {
  Rng rng(3);
  for (int run = 0; run < 200; ++run) {
    std::vector<Time> t;
    for (int i = 0; i < 40; ++i) t.push_back(Time{rng.below(60)});
    std::vector<int> length(t.size(), 1);
    int longest = 0;
    for (std::size_t i = 0; i < t.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k)
        if (t[k] < t[i]) length[i] = std::max(length[i], length[k] + 1);
      longest = std::max(longest, length[i]);
    }
    const std::vector<bool> keep = longest_increasing(t);
    Time previous{-1};
    int count = 0;
    for (std::size_t i = 0; i < t.size(); ++i) {
      if (!keep[i]) continue;
      EXPECT_GT(t[i], previous);
      previous = t[i];
      ++count;
    }
    EXPECT_EQ(count, longest);
  }
}

TEST(DataLines, SkipWhatIsNoData) {
  const auto lines = data_lines("\xEF\xBB\xBFtimestamp,x\r\n# c\r\n\r\n1,2\r\n  \n3,4");
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0].number, 4);
  EXPECT_EQ(lines[0].text, "1,2");
  EXPECT_EQ(lines[1].number, 6);
  EXPECT_EQ(lines[1].text, "3,4");
  EXPECT_TRUE(data_lines("").empty());
  EXPECT_EQ(data_lines("nan,1\n").size(), 1u) << "a bad row, not a header";
  EXPECT_EQ(data_lines("1,2\nheader,again\n").size(), 2u) << "a header comes first or not at all";
}

TEST(Split, KeepsEmptyFieldsBetweenCommasOnly) {
  std::vector<std::string_view> fields;
  split_at_commas(" a,, b ,", fields);
  EXPECT_EQ(fields, (std::vector<std::string_view>{"a", "", "b", ""}));
  split_at_blanks("  a \t b  ", fields);
  EXPECT_EQ(fields, (std::vector<std::string_view>{"a", "b"}));
  split_at_blanks("  ", fields);
  EXPECT_TRUE(fields.empty());
}

struct Row {
  Time t;
};

RowVerdict parse(std::string_view line, Row& row, std::string& problem) {
  const auto t = parse_nanoseconds(line);
  if (t) row.t = *t;
  else problem = "no stamp";
  return t ? RowVerdict::good : RowVerdict::malformed;
}

TEST(StampedRows, HalfBadIsStillReadMoreIsRefused) {
  auto half = read_stamped_rows<Row>("1\nx\n2\ny\n", "f.csv", parse);
  ASSERT_TRUE(half);
  EXPECT_EQ(half->rows.size(), 2u);
  EXPECT_EQ(half->counts.malformed, 2);
  EXPECT_EQ(half->counts.first_bad, "f.csv:2: no stamp");
  auto most = read_stamped_rows<Row>("1\nx\ny\n", "f.csv", parse);
  ASSERT_FALSE(most);
  EXPECT_EQ(most.error().message, "f.csv:2: no stamp (2 of 3 rows are unusable)");
}

TEST(StampedRows, FirstBadIsTheFirstLineOfAnyKind) {
  auto rows = read_stamped_rows<Row>("1\n5\n2\n3\nx\n4\n5\n6\n", "f.csv", parse);
  ASSERT_TRUE(rows);
  EXPECT_EQ(rows->counts.first_bad, "f.csv:2: the stamp is out of order");
  EXPECT_EQ(rows->counts.backwards, 1);
  EXPECT_EQ(rows->counts.bad(), 2);
}

TEST(Csv, AWrappedCounterIsContinued) {
  const std::int64_t wrap = 4294967296000, ms = 1'000'000;
  std::vector<Time> stamps = {Time{wrap - 100 * ms}, Time{wrap - 50 * ms}, Time{0}, Time{50 * ms}};
  EXPECT_EQ(continue_wrapped(stamps), 1);
  EXPECT_EQ(stamps[2], Time{wrap});
  EXPECT_EQ(stamps[3], Time{wrap + 50 * ms});
  std::vector<Time> set_back = {Time{wrap}, Time{wrap + 50 * ms}, Time{wrap - 1000 * ms}, Time{wrap - 950 * ms}},
                    before = set_back;
  EXPECT_EQ(continue_wrapped(set_back), 0) << "a clock that is set back is no counter that wraps";
  EXPECT_EQ(set_back, before);
  std::vector<Time> damaged = {Time{wrap}, Time{wrap + 50 * ms}, Time{70 * ms}, Time{wrap + 150 * ms}};
  EXPECT_EQ(continue_wrapped(damaged), 0) << "one row alone";
}

}  // namespace csv_test
}  // namespace fbvins
