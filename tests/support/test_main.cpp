// SPDX-License-Identifier: Apache-2.0
// The main function of every test program. Each process has a folder of its own for temporary files (testing::TempDir() and
// std::filesystem::temp_directory_path()), because tests run side by side, each in its process.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  std::string folder = testing::TempDir() + "fbvins_test_XXXXXX";
  if (!mkdtemp(folder.data())) {
    std::cerr << folder << ": cannot be made\n";
    return 1;
  }
  for (const char* name : {"TEST_TMPDIR", "TMPDIR"}) setenv(name, folder.c_str(), 1);
  const int failed = RUN_ALL_TESTS();
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  return failed;
}
