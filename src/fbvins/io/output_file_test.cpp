// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/output_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "fbvins/io/file_source.hpp"

namespace fbvins {
namespace output_file_test {

namespace fs = std::filesystem;

class OutputFileTest : public ::testing::Test {
 protected:
  OutputFileTest() { fs::create_directories(folder_); }
  ~OutputFileTest() override { fs::remove_all(folder_); }

  int files() const { return static_cast<int>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator())); }

  const std::string folder_ = ::testing::TempDir() + "/fbvins_output_file_" + std::to_string(getpid());
  const std::string path_ = folder_ + "/summary.txt";
};

TEST_F(OutputFileTest, AppearsWhenClosedAndReplacesTheOldOneWhole) {
  for (const char* text : {"first\n", "second, longer\n", "3\n"}) {
    auto file = OutputFile::create(path_);
    ASSERT_TRUE(file) << file.error().message;
    file->write(text);
    const auto before = read_file(path_, 100);
    EXPECT_NE(before ? *before : "", text) << "not before it is closed";
    ASSERT_TRUE(file->close());
    EXPECT_EQ(*read_file(path_, 100), text);
    EXPECT_EQ(files(), 1);
  }
}

TEST_F(OutputFileTest, WithoutCloseNothingIsLeftAndTheOldFileStays) {
  {
    auto file = OutputFile::create(path_);
    file->write("old");
    ASSERT_TRUE(file->close());
    auto unfinished = OutputFile::create(path_);
    unfinished->write("half of the n");
    EXPECT_EQ(files(), 2);
  }
  EXPECT_EQ(files(), 1);
  EXPECT_EQ(*read_file(path_, 100), "old");
}

TEST_F(OutputFileTest, ClosingTwiceIsAnError) {
  auto file = OutputFile::create(path_);
  ASSERT_TRUE(file->close());
  EXPECT_EQ(file->close().error().message, "the output file was closed before");
}

TEST_F(OutputFileTest, AFileThatMovedIsClosedByItsNewOwner) {
  auto file = OutputFile::create(path_);
  OutputFile owner = *std::move(file);
  owner.write("x");
  ASSERT_TRUE(owner.close());
  EXPECT_EQ(*read_file(path_, 100), "x");
}

}  // namespace output_file_test
}  // namespace fbvins
