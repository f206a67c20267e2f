// SPDX-License-Identifier: Apache-2.0
// One libFuzzer program for each parser: FBVINS_FUZZ_TARGET names the function.
#include <cstddef>
#include <cstdint>

#include "tests/fuzz/fuzz_targets.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fbvins::fuzz::FBVINS_FUZZ_TARGET({reinterpret_cast<const char*>(data), size});
  return 0;
}
