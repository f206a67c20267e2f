// SPDX-License-Identifier: Apache-2.0
// The booster's forward pass (paper 2.2.2, eq. 6-8; docs/derivations/booster.md): margins or bits, and geometry, of all
// keypoints of one image in, better bits out. In 8-bit integers (fast, the same bits with every kernel) or single precision (the
// reference). One instance, one thread; allocates only while it grows.
//
//   BoosterNetwork network(*weights, BoosterPrecision::int8, best_int8_kernel());
//   network.run(752, 480, features.keypoints, features.margins, features.descriptors);
#pragma once

#include <span>
#include <vector>

#include "fbvins/features/booster_options.hpp"
#include "fbvins/features/booster_weights.hpp"
#include "fbvins/features/int8_gemm.hpp"
#include "fbvins/features/keypoint.hpp"

namespace fbvins {

/// Geometry of keypoints as the network's input, kBoosterGeometry numbers each: position relative to the image's centre,
/// logarithm of the score relative to the image's mean and that mean, cosine and sine of the angle, logarithm of the scale.
void booster_geometry(int width, int height, std::span<const Keypoint> keypoints, std::vector<float>& out);
/// The same of one keypoint, to out[kBoosterGeometry]; the mean is that of its image.
void booster_geometry(int width, int height, const Keypoint& keypoint, double mean_log_score, float* out);
/// Mean of the logarithms of one plus the score.
double mean_log_score(std::span<const Keypoint> keypoints);

class BoosterNetwork {
 public:
  BoosterNetwork(const BoosterWeights& weights, BoosterPrecision precision, Int8Kernel kernel);

  /// Writes the descriptors; keypoints, margins and descriptors are of one image of width x height px, one to one.
  void run(int width, int height, std::span<const Keypoint> keypoints, std::span<const Margins> margins,
           std::span<Descriptor> descriptors);

  /// The layers' summaries (eq. 7-8) of these keypoints, for run() of others of the image. `geometry`: kBoosterGeometry numbers
  /// each.
  void summarise(std::span<const float> geometry, std::span<const Margins> margins, std::vector<float>& summaries);
  /// Writes the descriptors of some keypoints, with summaries of others.
  void run(std::span<const float> geometry, std::span<const Margins> margins, const std::vector<float>& summaries,
           std::span<Descriptor> descriptors);

  /// Numbers whose signs are the bits of the last run: 256 a keypoint.
  const std::vector<float>& outputs() const { return y_; }

 private:
  struct Linear {
    PackedWeights packed;
    std::vector<float> weight_t, bias;
    int outputs = 0, inputs = 0;
    bool whole_numbers = false;
    bool fine = false;  // the input's rounding error is multiplied as well, in 8 more bits
  };
  struct Layer {
    Linear query, key, value, out, up, down;
    NormWeights norm1, norm2;
  };

  Linear prepare(const LinearWeights& weights, bool fine = false) const;
  /// out = linear(x). `again`: x is that of the previous call, so its quantised rows are used once more.
  void apply(const Linear& linear, const std::vector<float>& x, std::vector<float>& out, bool again = false);
  void encode(std::span<const Margins> margins, bool with_skip);
  void encode_geometry();
  void summarise(const Layer& layer, float* summary);
  void attend(const Layer& layer, const float* summary, bool again);
  void feed_forward(const Layer& layer);
  void finish(std::span<Descriptor> descriptors);

  BoosterPrecision precision_;
  Int8Kernel kernel_;
  int width_;
  bool margins_;
  Linear descriptor1_, descriptor2_, head_, skip_;
  std::vector<Linear> keypoint_;
  std::vector<Layer> layers_;
  // buffers
  int rows_ = 0;
  QuantisedRows quantised_, rest_;
  std::vector<float> geometry_, z_, hidden_, hidden2_, query_, key_, value_, summaries_, scratch_, skipped_, y_;
};

}  // namespace fbvins
