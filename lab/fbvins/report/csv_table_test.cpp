// SPDX-License-Identifier: Apache-2.0
#include "fbvins/report/csv_table.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace fbvins {
namespace csv_table_test {

TEST(CsvTable, FindsColumnsByNameWithoutUnits) {
  const Result<CsvTable> table = CsvTable::parse("#timestamp [ns],p_x [m],health\n10,1.5,good\n20,x,lost\n", "t.csv");
  ASSERT_TRUE(table.ok()) << table.error().message;
  ASSERT_EQ(table->rows(), 2u);
  EXPECT_EQ(table->stamps()[1].ns, 20);
  EXPECT_EQ(table->numbers("p_x")[0], 1.5);
  EXPECT_TRUE(std::isnan(table->numbers("p_x")[1]));
  EXPECT_EQ(table->texts("health")[1], "lost");
  EXPECT_FALSE(table->has("p_y"));
  EXPECT_TRUE(table->numbers("p_y").empty());
}

TEST(CsvTable, MissingFieldsAtTheEndOfARowAreEmpty) {
  const Result<CsvTable> table = CsvTable::parse("#timestamp,a,b\r\n1,2\r\n", "t.csv");
  ASSERT_TRUE(table.ok());
  EXPECT_EQ(table->numbers("a")[0], 2);
  EXPECT_TRUE(std::isnan(table->numbers("b")[0]));
}

TEST(CsvTable, StampsAloneAreATableToo) {
  const Result<CsvTable> table = CsvTable::parse("#timestamp [ns]\n10\n20\n", "t.csv");
  ASSERT_TRUE(table.ok()) << table.error().message;
  EXPECT_EQ(table->rows(), 2u);
  EXPECT_FALSE(table->has("timestamp"));
}

TEST(CsvTable, ErrorsNameTheLine) {
  EXPECT_EQ(CsvTable::parse("#timestamp,a\nsoon,2\n", "t.csv").error().message, "t.csv:2: no stamp in nanoseconds");
  EXPECT_EQ(CsvTable::parse("1,2\n", "t.csv").error().message, "t.csv:1: a header line is missing");
  EXPECT_EQ(CsvTable::parse("", "t.csv").error().message, "t.csv: the file is empty");
}

}  // namespace csv_table_test
}  // namespace fbvins
