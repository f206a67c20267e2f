// SPDX-License-Identifier: Apache-2.0
// Runs the fuzz targets on mutations of valid files, with fixed seeds, so that every sanitizer run covers them
// without Clang. A fault traps or is reported by the sanitizer.
#include <gtest/gtest.h>

#include "fbvins/core/rng.hpp"
#include "tests/fuzz/fuzz_targets.hpp"

namespace fbvins::fuzz {
namespace mutation_test {

/// Pieces of text that often break parsers.
std::string nasty_piece(Rng& rng) {
  static const std::string pieces[] = {"nan",
                                       "-inf",
                                       "1e400",
                                       "1e-400",
                                       ",",
                                       ",,,,",
                                       "\n",
                                       "\r\n",
                                       "#",
                                       "-",
                                       "99999999999999999999",
                                       "9223372036854775807",
                                       "\"",
                                       "[",
                                       "]",
                                       "{",
                                       "}",
                                       ":",
                                       "&a ",
                                       "*a",
                                       "!!",
                                       "%",
                                       "---\n",
                                       "\t",
                                       std::string("\0", 1),
                                       "\xEF\xBB\xBF",
                                       "\xff\xff\xff\xff",
                                       "\xff\xd9",
                                       "IDAT",
                                       "tRNS"};
  return pieces[rng.below(std::size(pieces))];
}

std::string mutated(std::string text, Rng& rng) {
  for (std::uint32_t changes = 1 + rng.below(6); changes > 0; --changes) {
    const std::size_t at = rng.below(static_cast<std::uint32_t>(text.size() + 1));
    const std::size_t length = rng.below(20);
    switch (rng.below(6)) {
      case 0:
        if (at < text.size()) text[at] = static_cast<char>(rng.below(256));
        break;
      case 1:
        if (at < text.size()) text[at] ^= static_cast<char>(1u << rng.below(8));
        break;
      case 2: text.erase(at, length); break;
      case 3: text.insert(at, nasty_piece(rng)); break;
      case 4: text.insert(at, text.substr(text.size() - std::min(text.size(), at), length)); break;
      case 5:
        if (rng.below(4) == 0) text.resize(at);
        break;
    }
  }
  return text;
}

class Mutations : public testing::TestWithParam<Target> {};

TEST_P(Mutations, AreAllAnswered) {
  Rng rng(2024);
  for (const std::string& seed : GetParam().seeds()) {
    GetParam().run(seed);
    for (int i = 0; i < 2000; ++i) GetParam().run(mutated(seed, rng));
  }
}

TEST_P(Mutations, NoiseAndNothingAreAnswered) {
  Rng rng(7);
  GetParam().run("");
  for (int i = 0; i < 500; ++i) {
    std::string noise(rng.below(300), '\0');
    for (char& c : noise) c = static_cast<char>(rng.below(256));
    GetParam().run(noise);
  }
}

INSTANTIATE_TEST_SUITE_P(Parsers, Mutations, testing::ValuesIn(targets()),
                         [](const auto& row) { return std::string(row.param.name); });

}  // namespace mutation_test
}  // namespace fbvins::fuzz
