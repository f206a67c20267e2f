// SPDX-License-Identifier: Apache-2.0
// The booster against the training framework's forward pass (stored vectors, training/store_vectors.py), 8-bit integers
// against single precision, and weights files that do not fit.
#include "fbvins/features/booster.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include "fbvins/core/rng.hpp"
#include "fbvins/features/booster_network.hpp"
#include "fbvins/features/orb.hpp"
#include "fbvins/features/safetensors.hpp"
#include "tests/support/noise_texture.hpp"

namespace fbvins {
namespace booster_test {

const std::string kTestData = FBVINS_SOURCE_DIR "/tests/data/";

OrbFeatures features_of_an_image() {
  Rng rng(3);
  Image image(376, 240);
  for (int k = 0; k < 300; ++k) {
    const int x0 = static_cast<int>(rng.below(360)), y0 = static_cast<int>(rng.below(230));
    const auto grey = static_cast<std::uint8_t>(rng.below(256));
    for (int y = y0; y < std::min(240, y0 + 4 + static_cast<int>(rng.below(30))); ++y)
      for (int x = x0; x < std::min(376, x0 + 25); ++x) image.at(x, y) = grey;
  }
  OrbFeatures features;
  OrbExtractor(OrbOptions{}, true).extract(image.view(), features);
  return features;
}

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

double share_of_different_bits(const std::vector<Descriptor>& a, const std::vector<Descriptor>& b) {
  int different = 0;
  for (std::size_t i = 0; i < a.size(); ++i) different += hamming_distance(a[i], b[i]);
  return different / (256.0 * static_cast<double>(a.size()));
}

/// What training/store_vectors.py put into a file.
struct StoredVectors {
  int width = 0, height = 0;
  OrbFeatures features;
  std::vector<float> output;
};

StoredVectors read_vectors(const std::string& path) {
  auto file = read_safetensors(path);
  StoredVectors out;
  if (!file) {
    ADD_FAILURE() << file.error().message;
    return out;
  }
  out.width = std::stoi(file->metadata.at("width"));
  out.height = std::stoi(file->metadata.at("height"));
  const std::vector<float>&keypoints = file->tensors.at("keypoints").values, &margins = file->tensors.at("margins").values;
  for (std::size_t i = 0; i < keypoints.size() / 6; ++i) {
    const float* row = keypoints.data() + 6 * i;
    Keypoint k;
    k.pixel = Vec2(row[0], row[1]);
    k.level = static_cast<int>(row[2]);
    k.scale = row[3], k.angle_rad = row[4], k.score = row[5];
    Descriptor d;
    Margins m;
    for (std::size_t b = 0; b < 256; ++b) {
      m.of_bit[b] = static_cast<std::int8_t>(margins[kMarginsPerFeature * i + b]);
      m.around[b] = static_cast<std::int8_t>(margins[kMarginsPerFeature * i + 256 + b]);
      d.bits[b / 64] |= static_cast<std::uint64_t>(m.of_bit[b] > 0) << (b % 64);
    }
    out.features.keypoints.push_back(k);
    out.features.descriptors.push_back(d);
    out.features.margins.push_back(m);
  }
  out.output = file->tensors.at("output").values;
  return out;
}

class ShippedWeights : public testing::TestWithParam<std::string> {};

TEST_P(ShippedWeights, GiveWhatTheTrainingFrameworkComputes) {
  const StoredVectors stored = read_vectors(kTestData + GetParam() + "_vectors.safetensors");
  const auto weights = load_booster_weights(booster_weights_path(GetParam()));
  ASSERT_TRUE(weights) << weights.error().message;
  std::vector<Descriptor> expected(stored.features.size()), boosted(stored.features.size());
  BoosterNetwork network(*weights, BoosterPrecision::float32, Int8Kernel::portable);
  network.run(stored.width, stored.height, stored.features.keypoints, stored.features.margins, boosted);
  double worst = 0;
  for (std::size_t i = 0; i < stored.features.size(); ++i)
    for (std::size_t b = 0; b < 256; ++b) {
      worst = std::max(worst, std::abs(double{network.outputs()[256 * i + b]} - stored.output[256 * i + b]));
      expected[i].bits[b / 64] |= static_cast<std::uint64_t>(stored.output[256 * i + b] > 0) << (b % 64);
    }
  EXPECT_LT(worst, 1e-4);
  EXPECT_LT(share_of_different_bits(boosted, expected), 1e-4);

  std::vector<Descriptor> in_whole_numbers(stored.features.size());
  BoosterNetwork(*weights, BoosterPrecision::int8, best_int8_kernel())
      .run(stored.width, stored.height, stored.features.keypoints, stored.features.margins, in_whole_numbers);
  EXPECT_LT(share_of_different_bits(in_whole_numbers, expected), 0.005);
  EXPECT_GT(share_of_different_bits(in_whole_numbers, stored.features.descriptors), 0.01) << "nothing is boosted";
}

TEST_P(ShippedWeights, GiveTheSameBitsWithEveryKernelAndEveryTime) {
  const auto weights = load_booster_weights(booster_weights_path(GetParam()));
  ASSERT_TRUE(weights) << weights.error().message;
  const OrbFeatures features = features_of_an_image();
  ASSERT_GT(features.size(), 100u);
  const auto boost = [&](BoosterNetwork& network, std::size_t count) {
    std::vector<Descriptor> out(count);
    network.run(376, 240, std::span(features.keypoints).first(count), features.margins, out);
    return out;
  };
  BoosterNetwork reference(*weights, BoosterPrecision::int8, Int8Kernel::portable);
  const std::vector<Descriptor> expected = boost(reference, features.size()), fewer = boost(reference, 50);
  for (const Int8Kernel kernel : {Int8Kernel::portable, Int8Kernel::avx2, Int8Kernel::avx512_vnni, Int8Kernel::neon_dot}) {
    if (!int8_kernel_works(kernel)) continue;
    BoosterNetwork network(*weights, BoosterPrecision::int8, kernel);
    EXPECT_EQ(boost(network, features.size()), expected) << name_of(kernel);
    EXPECT_EQ(boost(network, 50), fewer) << name_of(kernel) << ": state of an earlier run shows";
    EXPECT_EQ(boost(network, features.size()), expected) << name_of(kernel);
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShippedWeights, testing::Values("boost-s"), [](const auto& p) { return p.param.substr(6); });

/// With a summary of all keypoints some are improved to the very bits that all together are; the stage's sample of them changes
/// few.
TEST_P(ShippedWeights, ImproveSomeKeypointsAsAllTogether) {
  const auto weights = load_booster_weights(booster_weights_path(GetParam()));
  ASSERT_TRUE(weights) << weights.error().message;
  OrbFeatures all = features_of_an_image();
  BoosterNetwork network(*weights, BoosterPrecision::int8, best_int8_kernel());
  std::vector<float> geometry, summaries;
  booster_geometry(376, 240, all.keypoints, geometry);
  network.summarise(geometry, all.margins, summaries);
  std::vector<DescriptorInput> inputs;
  std::vector<Descriptor> some(all.descriptors.begin() + 30, all.descriptors.begin() + 37), sampled = some;
  for (std::size_t k = 30; k < 37; ++k) inputs.push_back({all.margins[k], all.keypoints[k], mean_log_score(all.keypoints)});
  network.run(std::span(geometry).subspan(30 * kBoosterGeometry, 7 * kBoosterGeometry), std::span(all.margins).subspan(30, 7),
              summaries, some);
  auto stage = make_booster_stage({.weights = GetParam()});
  ASSERT_TRUE(stage) << stage.error().message;
  ImageContext context;
  (*stage)->look_at(376, 240, all, context);
  (*stage)->improve(context, inputs, sampled);
  (*stage)->improve(376, 240, all);
  const std::vector<Descriptor> expected(all.descriptors.begin() + 30, all.descriptors.begin() + 37);
  EXPECT_EQ(some, expected);
  EXPECT_LT(share_of_different_bits(sampled, expected), 0.02);
}

TEST(Booster, TakesAnyNumberOfKeypoints) {
  auto stage = make_booster_stage(BoosterOptions{});
  ASSERT_TRUE(stage) << stage.error().message;
  OrbFeatures none, one = features_of_an_image();
  (*stage)->improve(376, 240, none);
  EXPECT_EQ(none.size(), 0u);
  one.keypoints.resize(1), one.descriptors.resize(1), one.margins.resize(1);
  (*stage)->improve(376, 240, one);
  EXPECT_EQ(one.size(), 1u);
}

TEST(BoosterWeights, ThatDoNotFitAreNamed) {
  const std::string good = bytes_of(booster_weights_path("boost-s"));
  ASSERT_TRUE(parse_booster_weights(good));
  const auto error_with = [&](const std::string& from, const std::string& to) {
    std::string bytes = good;
    bytes.replace(bytes.find(from), from.size(), to);
    const auto weights = parse_booster_weights(bytes);
    return weights ? std::string() : weights.error().message;
  };
  EXPECT_EQ(error_with("fbvins-booster-3", "fbvins-booster-4"),
            "metadata \"format\" is \"fbvins-booster-4\", not \"fbvins-booster-3\": these are no weights of this version");
  EXPECT_EQ(error_with("\"head.bias\"", "\"head.boas\""), "tensor \"head.bias\" is missing");
  EXPECT_EQ(error_with("\"bits\":\"256\"", "\"bits\":\"255\""), "metadata \"bits\" is \"255\", not a number from 256 to 256");
  for (const std::string bad : {"32x64", "32,6x", "32x,6", ",3264", "3264,"})  // of the right length: the header's stays right
    EXPECT_EQ(error_with("\"32,64\"", "\"" + bad + "\""),
              "metadata \"keypoint_hidden\" is \"" + bad + "\", not up to 8 multiples of 16 joined by commas");
  const auto cut = parse_booster_weights(std::string_view(good).substr(0, good.size() - 1));
  ASSERT_FALSE(cut);
  EXPECT_NE(cut.error().message.find("the file is cut off"), std::string::npos);
}

}  // namespace booster_test
}  // namespace fbvins
