// SPDX-License-Identifier: Apache-2.0
// Prints the result of every int8 kernel of this processor for fixed numbers, and a sum over the descriptor bits of the
// shipped network for fixed keypoints. Compiled for two processors, both must print the same. booster_bits WEIGHTS
#include <cstdio>

#include "fbvins/core/rng.hpp"
#include "fbvins/features/booster_network.hpp"

using namespace fbvins;

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const Result<BoosterWeights> weights = load_booster_weights(argv[1]);
  if (!weights) return std::fprintf(stderr, "%s\n", weights.error().message.c_str()), 2;
  Rng rng(9);
  std::vector<Keypoint> keypoints(123);
  std::vector<Margins> margins(keypoints.size());
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    // One draw in each statement: within a statement the compiler chooses the order.
    const double x = rng.uniform(0, 752), y = rng.uniform(0, 480);
    keypoints[i].pixel = Vec2(x, y);
    keypoints[i].score = static_cast<float>(rng.uniform(10, 1e5));
    keypoints[i].angle_rad = static_cast<float>(rng.uniform(-3, 3));
    for (auto* half : {&margins[i].of_bit, &margins[i].around})
      for (std::int8_t& m : *half) m = static_cast<std::int8_t>(static_cast<int>(rng.below(255)) - 127);
  }
  int kernels = 0;
  for (const Int8Kernel kernel : {Int8Kernel::portable, Int8Kernel::avx2, Int8Kernel::avx512_vnni, Int8Kernel::neon_dot}) {
    if (!int8_kernel_works(kernel)) continue;
    std::vector<Descriptor> boosted(keypoints.size());
    BoosterNetwork(*weights, BoosterPrecision::int8, kernel).run(752, 480, keypoints, margins, boosted);
    std::uint64_t sum = 14695981039346656037ull;
    for (const Descriptor& d : boosted)
      for (const std::uint64_t word : d.bits) sum = (sum ^ word) * 1099511628211ull;
    std::printf("%016llx\n", static_cast<unsigned long long>(sum));
    std::fprintf(stderr, "%s: %016llx\n", name_of(kernel), static_cast<unsigned long long>(sum));
    ++kernels;
  }
  return kernels > 0 ? 0 : 1;
}
