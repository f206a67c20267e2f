// SPDX-License-Identifier: Apache-2.0
// Writes the valid files that fuzzing starts from: write_seeds FOLDER makes FOLDER/csv/0, FOLDER/csv/1, ...
#include <filesystem>
#include <fstream>

#include "tests/fuzz/fuzz_targets.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  for (const auto& target : fbvins::fuzz::targets()) {
    const std::filesystem::path folder = std::filesystem::path(argv[1]) / target.name;
    std::filesystem::create_directories(folder);
    int i = 0;
    for (const std::string& seed : target.seeds()) std::ofstream(folder / std::to_string(i++), std::ios::binary) << seed;
  }
  return 0;
}
