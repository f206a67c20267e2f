// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/file_source.hpp"

#include <gtest/gtest.h>
#include <unistd.h>
#include <zip.h>

#include <filesystem>
#include <fstream>

namespace fbvins {
namespace file_source_test {

namespace fs = std::filesystem;

class FileSourceTest : public ::testing::Test {
 protected:
  FileSourceTest() { fs::create_directories(folder_); }
  ~FileSourceTest() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return folder_ + "/" + name; }
  void write(const std::string& name, const std::string& bytes) const {
    fs::create_directories(fs::path(path(name)).parent_path());
    std::ofstream(path(name), std::ios::binary) << bytes;
  }
  void write_zip(const std::string& name, const std::vector<std::pair<std::string, std::string>>& entries) const {
    zip_t* archive = zip_open(path(name).c_str(), ZIP_CREATE | ZIP_TRUNCATE, nullptr);
    for (const auto& [entry, bytes] : entries)
      zip_file_add(archive, entry.c_str(), zip_source_buffer(archive, bytes.data(), bytes.size(), 0), 0);
    ASSERT_EQ(zip_close(archive), 0);
  }

  const std::string folder_ = ::testing::TempDir() + "/fbvins_file_source_" + std::to_string(getpid());
};

TEST_F(FileSourceTest, FolderAndArchiveHoldTheSameFiles) {
  write("euroc/mav0/cam0/data.csv", "1,a.png\n");
  write_zip("euroc.zip", {{"mav0/cam0/data.csv", "1,a.png\n"}});
  for (const char* name : {"euroc", "euroc.zip"}) {
    const auto files = open_file_source(path(name));
    ASSERT_TRUE(files) << files.error().message;
    EXPECT_TRUE((*files)->exists("mav0/cam0/data.csv"));
    EXPECT_FALSE((*files)->exists("mav0/cam1/data.csv"));
    EXPECT_EQ((*files)->folders_holding("cam0/data.csv"), std::vector<std::string>{"mav0/"});
    const auto text = (*files)->read("mav0/cam0/data.csv", 100);
    ASSERT_TRUE(text) << text.error().message;
    EXPECT_EQ(*text, "1,a.png\n");
    EXPECT_FALSE((*files)->read("mav0/cam0/data.csv", 3)) << "larger than was asked for";
    EXPECT_FALSE((*files)->read("mav0/cam1/data.csv", 100));
  }
}

TEST_F(FileSourceTest, ShadowCopiesOfAMacAreNotFolders) {
  write_zip("mac.zip", {{"MH_01/mav0/cam0/data.csv", ""}, {"__MACOSX/MH_01/mav0/cam0/data.csv", ""}, {"xcam0/data.csv", ""}});
  const auto files = open_file_source(path("mac.zip"));
  ASSERT_TRUE(files) << files.error().message;
  EXPECT_EQ((*files)->folders_holding("cam0/data.csv"), std::vector<std::string>{"MH_01/mav0/"});
}

TEST_F(FileSourceTest, AFlippedByteInAnArchiveIsFoundByItsChecksum) {
  const std::string content(1000, 'x');
  write_zip("damaged.zip", {{"a.csv", content}});
  ASSERT_TRUE((*open_file_source(path("damaged.zip")))->read("a.csv", 2000));
  std::fstream file(path("damaged.zip"), std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(38);  // inside of the compressed bytes, which follow 30 bytes of header and the name
  file.put('\x55');
  file.close();
  const auto files = open_file_source(path("damaged.zip"));
  EXPECT_FALSE(files && (*files)->read("a.csv", 2000));
}

TEST_F(FileSourceTest, SaysWhatItCannotRead) {
  write("flight.bag", "#ROSBAG V2.0\n....");
  write("notes.txt", "hello, this is text");
  write("cut.zip", "PK\x03\x04 and no more");
  const auto message = [&](const std::string& name) { return open_file_source(path(name)).error().message; };
  EXPECT_EQ(message("nothing"), path("nothing") + ": no such file or folder");
  EXPECT_EQ(message("flight.bag"),
            path("flight.bag") + ": ROS bags are read by fbvins-bags; `fbvins convert` makes a EuRoC folder of one");
  EXPECT_EQ(message("notes.txt"), path("notes.txt") + ": neither a EuRoC folder nor a zip archive");
  EXPECT_NE(message("cut.zip").find("not a whole zip archive"), std::string::npos);
  EXPECT_EQ(read_file(folder_, 10).error().message, folder_ + ": not a plain file");
}

}  // namespace file_source_test
}  // namespace fbvins
