// SPDX-License-Identifier: Apache-2.0
// Every parser of untrusted bytes, as functions that libFuzzer and the mutation test both call.
// A target must return for any bytes; where the parsed values contradict each other it traps.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace fbvins::fuzz {

void fuzz_csv(std::string_view bytes);
void fuzz_calibration(std::string_view bytes);
void fuzz_trajectory(std::string_view bytes);
void fuzz_aiding(std::string_view bytes);
void fuzz_image(std::string_view bytes);
void fuzz_weights(std::string_view bytes);
void fuzz_mcap(std::string_view bytes);
void fuzz_motion_capture(std::string_view bytes);
void fuzz_cdr(std::string_view bytes);
std::vector<std::string> cdr_seeds();
void fuzz_tags(std::string_view bytes);
std::vector<std::string> tag_seeds();
void fuzz_board_files(std::string_view bytes);
std::vector<std::string> board_file_seeds();
void fuzz_known_file(std::string_view bytes);
void fuzz_kitti(std::string_view bytes);
#ifdef FBVINS_WITH_LOOP
void fuzz_map(std::string_view bytes);
std::vector<std::string> map_seeds();
void fuzz_vocabulary(std::string_view bytes);
std::vector<std::string> vocabulary_seeds();
#endif
#ifdef FBVINS_WITH_LIVE
void fuzz_socket(std::string_view bytes);
std::vector<std::string> socket_seeds();
void fuzz_mavlink(std::string_view bytes);
std::vector<std::string> mavlink_seeds();
#endif

#ifdef FBVINS_WITH_BAGS
void fuzz_bag(std::string_view bytes);
std::vector<std::string> bag_seeds();
void fuzz_sqlite_bag(std::string_view bytes);
std::vector<std::string> sqlite_bag_seeds();
void fuzz_message(std::string_view bytes);
std::vector<std::string> message_seeds();
void fuzz_foreign_calibration(std::string_view bytes);
std::vector<std::string> foreign_calibration_seeds();
#endif

struct Target {
  const char* name;
  void (*run)(std::string_view);
  std::vector<std::string> (*seeds)();
};
const std::vector<Target>& targets();

}  // namespace fbvins::fuzz
