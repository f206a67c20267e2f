// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/booster_network.hpp"

#include <algorithm>
#include <cmath>

#include "fbvins/features/booster_kernels.hpp"

namespace fbvins {
namespace {

/// Products with fewer inputs stay in single precision: quantising them would save nothing.
constexpr int kFewestInputs = 16;

double log_score(const Keypoint& k) { return std::log1p(std::max(double{k.score}, 0.0)); }

}  // namespace

double mean_log_score(std::span<const Keypoint> keypoints) {
  double sum = 0;
  for (const Keypoint& k : keypoints) sum += log_score(k);
  return sum / static_cast<double>(std::max<std::size_t>(keypoints.size(), 1));
}

void booster_geometry(int width, int height, const Keypoint& k, double mean, float* out) {
  const double half = 0.5 * std::max(width, height);
  // In double precision, then rounded: the libraries of two machines differ in the last digit only.
  for (const double v :
       {(k.pixel.x() - 0.5 * width) / half, (k.pixel.y() - 0.5 * height) / half, (log_score(k) - mean) * 0.5, mean * 0.1,
        std::cos(double{k.angle_rad}), std::sin(double{k.angle_rad}), 2 * std::log(std::max(double{k.scale}, 1.0))})
    *out++ = static_cast<float>(v);
}

void booster_geometry(int width, int height, std::span<const Keypoint> keypoints, std::vector<float>& out) {
  out.resize(keypoints.size() * kBoosterGeometry);
  const double mean = mean_log_score(keypoints);
  for (std::size_t i = 0; i < keypoints.size(); ++i)
    booster_geometry(width, height, keypoints[i], mean, out.data() + i * kBoosterGeometry);
}

BoosterNetwork::BoosterNetwork(const BoosterWeights& weights, BoosterPrecision precision, Int8Kernel kernel)
    : precision_(precision), kernel_(kernel), width_(weights.width), margins_(weights.margins) {
  descriptor1_ = prepare(weights.descriptor1);
  descriptor2_ = prepare(weights.descriptor2);
  for (const LinearWeights& linear : weights.keypoint) keypoint_.push_back(prepare(linear));
  for (const BoosterLayerWeights& l : weights.layers)
    layers_.push_back({prepare(l.query), prepare(l.key), prepare(l.value), prepare(l.out), prepare(l.up, true), prepare(l.down),
                       l.norm1, l.norm2});
  head_ = prepare(weights.head);
  skip_ = prepare(weights.skip);
}

BoosterNetwork::Linear BoosterNetwork::prepare(const LinearWeights& weights, bool fine) const {
  Linear out;
  out.fine = fine;
  out.outputs = weights.outputs, out.inputs = weights.inputs;
  out.whole_numbers = precision_ == BoosterPrecision::int8 && weights.inputs >= kFewestInputs;
  if (out.whole_numbers) {
    out.packed = pack_weights(weights.weight.data(), weights.outputs, weights.inputs, weights.bias.data());
    return out;
  }
  out.bias = weights.bias;
  out.weight_t.resize(weights.weight.size());
  for (int n = 0; n < weights.outputs; ++n)
    for (int k = 0; k < weights.inputs; ++k)
      out.weight_t[static_cast<std::size_t>(k * weights.outputs + n)] =
          weights.weight[static_cast<std::size_t>(n * weights.inputs + k)];
  return out;
}

void BoosterNetwork::apply(const Linear& linear, const std::vector<float>& x, std::vector<float>& out, bool again) {
  const int padded = (rows_ + kInt8RowBlock - 1) / kInt8RowBlock * kInt8RowBlock;
  out.resize(static_cast<std::size_t>(padded) * static_cast<std::size_t>(linear.outputs));
  if (!linear.whole_numbers) {
    multiply_float(x.data(), rows_, linear.inputs, linear.weight_t.data(), linear.bias.data(), linear.outputs, out.data());
    return;
  }
  if (!again) quantised_.quantise(x.data(), rows_, linear.inputs);
  multiply(quantised_, linear.packed, out.data(), kernel_);
  if (!linear.fine) return;
  rest_.quantise_rest(x.data(), quantised_);
  multiply(rest_, linear.packed, out.data(), kernel_, Start::from_output);
}

void BoosterNetwork::run(int width, int height, std::span<const Keypoint> keypoints, std::span<const Margins> margins,
                         std::span<Descriptor> descriptors) {
  rows_ = static_cast<int>(std::min({keypoints.size(), margins.size(), descriptors.size()}));
  y_.clear();
  if (rows_ == 0) return;
  booster_geometry(width, height, keypoints.first(static_cast<std::size_t>(rows_)), geometry_);
  encode(margins, true);
  encode_geometry();
  summaries_.resize(static_cast<std::size_t>(width_));
  for (const Layer& layer : layers_) {
    summarise(layer, summaries_.data());
    attend(layer, summaries_.data(), true);
    feed_forward(layer);
  }
  finish(descriptors);
}

void BoosterNetwork::summarise(std::span<const float> geometry, std::span<const Margins> margins, std::vector<float>& summaries) {
  rows_ = static_cast<int>(margins.size());
  summaries.assign(layers_.size() * static_cast<std::size_t>(width_), 0.0f);
  if (rows_ == 0) return;
  geometry_.assign(geometry.begin(), geometry.end());
  encode(margins, false);
  encode_geometry();
  for (std::size_t l = 0; l < layers_.size(); ++l) {
    float* summary = summaries.data() + l * static_cast<std::size_t>(width_);
    summarise(layers_[l], summary);
    if (l + 1 == layers_.size()) break;
    attend(layers_[l], summary, true);
    feed_forward(layers_[l]);
  }
}

void BoosterNetwork::run(std::span<const float> geometry, std::span<const Margins> margins, const std::vector<float>& summaries,
                         std::span<Descriptor> descriptors) {
  rows_ = static_cast<int>(margins.size());
  y_.clear();
  if (rows_ == 0) return;
  geometry_.assign(geometry.begin(), geometry.end());
  encode(margins, true);
  encode_geometry();
  for (std::size_t l = 0; l < layers_.size(); ++l) {
    attend(layers_[l], summaries.data() + l * static_cast<std::size_t>(width_), false);
    feed_forward(layers_[l]);
  }
  finish(descriptors);
}

void BoosterNetwork::finish(std::span<Descriptor> descriptors) {
  apply(head_, z_, y_);
  if (skip_.outputs > 0) add(y_.data(), skipped_.data(), rows_ * skip_.outputs);
  for (std::size_t i = 0; i < static_cast<std::size_t>(rows_); ++i) take_signs(y_.data() + 256 * i, descriptors[i].bits.data());
}

/// The input through two layers into z (eq. 6, the descriptor's part), and through the skip connection past all layers.
void BoosterNetwork::encode(std::span<const Margins> margins, bool with_skip) {
  with_skip = with_skip && skip_.outputs > 0;
  const auto* values = reinterpret_cast<const std::int8_t*>(margins.data());
  if (descriptor1_.whole_numbers) {
    margins_ ? quantised_.set_values(values, rows_, kMarginsPerFeature, kMarginUnit)
             : quantised_.set_signs(values, rows_, 256, kMarginsPerFeature);
    if (with_skip) apply(skip_, hidden_, skipped_, true);
    apply(descriptor1_, hidden_, hidden_, true);
  } else {
    query_.clear();
    for (int i = 0; i < rows_; ++i, values += kMarginsPerFeature)
      for (int k = 0; k < descriptor1_.inputs; ++k)
        query_.push_back(margins_ ? kMarginUnit * static_cast<float>(values[k]) : (values[k] > 0 ? 1.0f : -1.0f));
    if (with_skip) apply(skip_, query_, skipped_);
    apply(descriptor1_, query_, hidden_);
  }
  relu(hidden_.data(), rows_ * descriptor1_.outputs);
  apply(descriptor2_, hidden_, z_);
}

/// Geometry is added to z (eq. 6, the keypoint's part).
void BoosterNetwork::encode_geometry() {
  hidden_.assign(geometry_.begin(), geometry_.end());
  for (std::size_t i = 0; i < keypoint_.size(); ++i) {
    if (i > 0) relu(hidden_.data(), rows_ * keypoint_[i].inputs);
    apply(keypoint_[i], hidden_, hidden2_);
    std::swap(hidden_, hidden2_);
  }
  add(z_.data(), hidden_.data(), rows_ * width_);
}

/// Of all rows (eq. 7-8).
void BoosterNetwork::summarise(const Layer& layer, float* summary) {
  apply(layer.key, z_, key_);
  apply(layer.value, z_, value_, true);
  scratch_.resize(2 * static_cast<std::size_t>(width_));
  fbvins::summarise(key_.data(), value_.data(), rows_, width_, summary, scratch_.data());
}

/// z = norm(z + out(sigmoid(query) * summary)). `again`: z was the last input.
void BoosterNetwork::attend(const Layer& layer, const float* summary, bool again) {
  apply(layer.query, z_, query_, again);
  value_.resize(query_.size());
  gate(query_.data(), summary, rows_, width_, value_.data());
  apply(layer.out, value_, query_);
  add(z_.data(), query_.data(), rows_ * width_);
  normalise_rows(z_.data(), rows_, width_, layer.norm1.weight.data(), layer.norm1.bias.data());
}

/// z = norm(z + down(relu(up(z)))).
void BoosterNetwork::feed_forward(const Layer& layer) {
  apply(layer.up, z_, hidden_);
  relu(hidden_.data(), rows_ * layer.up.outputs);
  apply(layer.down, hidden_, query_);
  add(z_.data(), query_.data(), rows_ * width_);
  normalise_rows(z_.data(), rows_, width_, layer.norm2.weight.data(), layer.norm2.bias.data());
}

}  // namespace fbvins
