// SPDX-License-Identifier: Apache-2.0
// Runs the tutorial's code blocks, unchanged (fly.inc, map.inc), on a recording: consumer DATASET MAP_FILE
#include <cstdio>
#include <fbvins/config/config_file.hpp>
#include <fbvins/io/dataset.hpp>
#include <fbvins/loop/loop_map.hpp>
#include <fbvins/pipeline/system.hpp>

#include "fly.inc"
#include "map.inc"

int main(int, char** argv) {
  int poses = 0;
  const auto use = [&](auto, const auto&, const auto&, const fbvins::Health& health) { poses += health.has_pose(); };
  const int flown = fly(argv[1], use);
  std::printf("flown: %d, %d poses\n", flown, poses);
  const int begun = fly_with_map(argv[1], "", argv[2]);
  const int found = fly_with_map(argv[1], argv[2], argv[2]);
  std::printf("keyframes that knew where they are in the map: %d of a new one, %d of the old one\n", begun, found);
  return flown == 0 && poses > 20 && begun > 0 && found > 0 ? 0 : 1;
}
