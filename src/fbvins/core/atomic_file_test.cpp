// SPDX-License-Identifier: Apache-2.0
#include "fbvins/core/atomic_file.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <thread>
#include <vector>

namespace fbvins {
namespace atomic_file_test {

namespace fs = std::filesystem;

std::string content_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return (std::ostringstream() << file.rdbuf()).str();
}

class AtomicFileTest : public ::testing::Test {
 protected:
  AtomicFileTest() { fs::create_directories(folder_); }
  ~AtomicFileTest() override { fs::remove_all(folder_); }

  std::vector<std::string> names() const {
    std::vector<std::string> found;
    for (const auto& entry : fs::directory_iterator(folder_)) found.push_back(entry.path().filename().string());
    std::sort(found.begin(), found.end());
    return found;
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / ("fbvins_atomic_file_" + std::to_string(getpid()));
  const std::string path_ = (folder_ / "map.fbm").string();
};

TEST_F(AtomicFileTest, ReplacesTheOldFileAtCommitAndNotBefore) {
  ASSERT_TRUE(write_file_atomically(path_, "old"));
  auto file = AtomicFile::create(path_);
  ASSERT_TRUE(file) << file.error().message;
  file->write("ne");
  file->write("w");
  EXPECT_EQ(file->size(), 3u);
  EXPECT_EQ(content_of(path_), "old");
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(content_of(path_), "new");
  EXPECT_EQ(names(), std::vector<std::string>{"map.fbm"});
}

TEST_F(AtomicFileTest, SmallAndLargePiecesComeInOrder) {
  std::string whole;
  auto file = AtomicFile::create(path_);
  for (const std::size_t size : {1u, 20'000u, 3u, 16'383u, 1u, 16'384u, 100'000u, 7u}) {
    const std::string piece(size, static_cast<char>('a' + whole.size() % 26));
    file->write(piece);
    whole += piece;
  }
  file->overwrite(5, "XYZ");
  whole.replace(5, 3, "XYZ");
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(content_of(path_), whole);
}

TEST_F(AtomicFileTest, WithoutCommitNothingIsLeft) {
  {
    auto file = AtomicFile::create(path_);
    file->write("half");
    EXPECT_EQ(names().size(), 1u);
  }
  EXPECT_TRUE(names().empty());
}

TEST_F(AtomicFileTest, LinksInTheFolderAreNotFollowed) {
  std::ofstream(folder_ / "precious") << "precious";
  // Where a writer might put its own file.
  for (const std::string& name : {std::string("map.fbm.part"), "map.fbm." + std::to_string(getpid()) + ".part"})
    fs::create_symlink(folder_ / "precious", folder_ / name);
  for (int number = 0; number < 100; ++number)
    fs::create_symlink(folder_ / "precious",
                       folder_ / ("map.fbm." + std::to_string(getpid()) + "-" + std::to_string(number) + ".part"));
  ASSERT_TRUE(write_file_atomically(path_, "map"));
  EXPECT_EQ(content_of(folder_ / "precious"), "precious");
  EXPECT_EQ(content_of(path_), "map");
}

TEST_F(AtomicFileTest, WhatAKilledProcessLeftIsRemovedByTheNextWriter) {
  const pid_t child = fork();
  if (child == 0) {
    auto file = AtomicFile::create(path_);
    file->write(std::string(100'000, 'x'));
    raise(SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  ASSERT_EQ(names().size(), 1u) << "the leftover";
  ASSERT_TRUE(write_file_atomically(path_, "map"));
  EXPECT_EQ(names(), std::vector<std::string>{"map.fbm"});
}

TEST_F(AtomicFileTest, AWriterAtWorkKeepsItsFileAndForeignFilesStay) {
  std::ofstream(folder_ / "map.fbm.notes.part") << "mine";
  auto slow = AtomicFile::create(path_);
  slow->write("slow");
  ASSERT_TRUE(write_file_atomically(path_, "quick"));
  EXPECT_EQ(content_of(path_), "quick");
  ASSERT_TRUE(slow->commit());
  EXPECT_EQ(content_of(path_), "slow");
  EXPECT_EQ(names(), (std::vector<std::string>{"map.fbm", "map.fbm.notes.part"}));
}

TEST_F(AtomicFileTest, ManyWritersOfOneFileLeaveOneWholeFile) {
  std::vector<std::thread> writers;
  for (char c = 'a'; c < 'e'; ++c)
    writers.emplace_back([&, c] {
      for (int i = 0; i < 20; ++i) EXPECT_TRUE(write_file_atomically(path_, std::string(50'000, c)));
    });
  for (std::thread& writer : writers) writer.join();
  const std::string content = content_of(path_);
  EXPECT_EQ(content, std::string(50'000, content.empty() ? ' ' : content[0]));
  EXPECT_EQ(names(), std::vector<std::string>{"map.fbm"});
}

TEST_F(AtomicFileTest, SaysWhatItCannotWrite) {
  EXPECT_EQ(AtomicFile::create(folder_.string()).error().message, folder_.string() + ": is a folder");
  const auto nowhere = AtomicFile::create((folder_ / "none" / "map.fbm").string());
  ASSERT_FALSE(nowhere);
  EXPECT_NE(nowhere.error().message.find("No such file"), std::string::npos) << nowhere.error().message;
}

/// The largest size of a file stands for a full disk.
TEST_F(AtomicFileTest, OnAFullDiskTheOldFileStays) {
  ASSERT_TRUE(write_file_atomically(path_, "old"));
  const auto ignored = signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{50'000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const Result<void> written = write_file_atomically(path_, std::string(200'000, 'n'));
  auto slowly = std::make_unique<AtomicFile>(*AtomicFile::create(path_));
  for (int i = 0; i < 200; ++i) slowly->write(std::string(1'000, 'n'));
  const Result<void> status = slowly->status(), committed = slowly->commit();
  slowly.reset();
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, ignored);
  for (const Result<void>* result : {&written, &status, &committed}) {
    ASSERT_FALSE(*result);
    EXPECT_EQ(result->error().code, ErrorCode::unwritable);
    EXPECT_NE(result->error().message.find("File too large"), std::string::npos) << result->error().message;
  }
  EXPECT_EQ(content_of(path_), "old");
  EXPECT_EQ(names(), std::vector<std::string>{"map.fbm"});
}

TEST_F(AtomicFileTest, SetAsideNumbersWhatIsThereAlready) {
  for (const char* expected : {"map.fbm.bad", "map.fbm.bad2", "map.fbm.bad3"}) {
    std::ofstream(path_) << expected;
    const auto name = set_aside(path_);
    ASSERT_TRUE(name) << name.error().message;
    EXPECT_EQ(*name, folder_ / expected);
    EXPECT_EQ(content_of(*name), expected);
    EXPECT_FALSE(fs::exists(path_));
  }
  EXPECT_FALSE(set_aside(path_)) << "nothing is there";
}

}  // namespace atomic_file_test
}  // namespace fbvins
