// SPDX-License-Identifier: Apache-2.0
#include "fbvins/live/socket_file.hpp"

#include <grp.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "tests/support/socket_test_sender.hpp"

namespace fbvins {
namespace socket_file_test {

bool is_there(const std::string& path) { return std::filesystem::exists(std::filesystem::symlink_status(path)); }

TEST(SocketFile, IsItsOwnersAloneAndGoneAtTheEnd) {
  const test::SocketFolder folder;
  const mode_t mask = ::umask(0);
  {
    const auto file = SocketFile::listen(folder.path());
    ::umask(mask);
    ASSERT_TRUE(file) << file.error().message;
    struct stat state {};
    ASSERT_EQ(::stat(folder.path().c_str(), &state), 0);
    EXPECT_EQ(state.st_mode & 0777u, 0600u);
    EXPECT_TRUE(test::TestSender(folder.path()).connected());
  }
  EXPECT_FALSE(is_there(folder.path()));
}

TEST(SocketFile, CanBeOpenToAGroup) {
  const struct group* mine = ::getgrgid(::getgid());
  if (mine == nullptr) GTEST_SKIP() << "this group has no name";
  const test::SocketFolder folder;
  const auto file = SocketFile::listen(folder.path(), mine->gr_name);
  ASSERT_TRUE(file) << file.error().message;
  struct stat state {};
  ASSERT_EQ(::stat(folder.path().c_str(), &state), 0);
  EXPECT_EQ(state.st_mode & 0777u, 0660u);
  EXPECT_EQ(state.st_gid, ::getgid());
  EXPECT_TRUE(test::TestSender(folder.path()).connected());
}

TEST(SocketFile, OfAGroupThatIsNotThereIsAnError) {
  const test::SocketFolder folder;
  const auto file = SocketFile::listen(folder.path(), "no-such-group");
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().message.find("there is no group 'no-such-group'"), std::string::npos) << file.error().message;
  EXPECT_FALSE(is_there(folder.path()));
}

TEST(SocketFile, OfADeadProgramIsReplaced) {
  const test::SocketFolder folder;
  {
    const FileDescriptor dead(::socket(AF_UNIX, SOCK_SEQPACKET, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    folder.path().copy(address.sun_path, sizeof(address.sun_path) - 1);
    ASSERT_EQ(::bind(dead.number(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    ASSERT_EQ(::listen(dead.number(), 1), 0);
  }
  ASSERT_TRUE(is_there(folder.path()));
  const auto file = SocketFile::listen(folder.path());
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_TRUE(test::TestSender(folder.path()).connected());
}

TEST(SocketFile, OfALivingProgramIsLeftAlone) {
  const test::SocketFolder folder;
  const auto living = SocketFile::listen(folder.path());
  ASSERT_TRUE(living);
  for (int i = 0; i < 8; ++i) {  // also when its queue of connections is full
    const auto second = SocketFile::listen(folder.path());
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().message, folder.path() + ": another program listens there");
  }
  EXPECT_TRUE(is_there(folder.path()));
}

TEST(SocketFile, WhatIsNoSocketIsLeftAlone) {
  const test::SocketFolder folder;
  std::ofstream(folder.path()) << "a letter";
  const auto file = SocketFile::listen(folder.path());
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().message, folder.path() + ": is there already, and is not a socket");
  EXPECT_EQ(std::filesystem::file_size(folder.path()), 8u);
}

TEST(SocketFile, AnotherOnesSocketIsNotRemovedAtTheEnd) {
  const test::SocketFolder folder;
  auto first = std::make_unique<Result<SocketFile>>(SocketFile::listen(folder.path()));
  ASSERT_TRUE(*first);
  std::filesystem::rename(folder.path(), folder.path() + ".old");
  const auto second = SocketFile::listen(folder.path());
  ASSERT_TRUE(second);
  first.reset();
  EXPECT_TRUE(is_there(folder.path()));
}

TEST(SocketFile, PathsThatCannotBe) {
  EXPECT_FALSE(SocketFile::listen(""));
  const auto file = SocketFile::listen("/tmp/" + std::string(200, 'x'));
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().message.find("1 to 107 characters"), std::string::npos);
  EXPECT_FALSE(SocketFile::listen("/no/such/folder/sensors.sock"));
}

}  // namespace socket_file_test
}  // namespace fbvins
