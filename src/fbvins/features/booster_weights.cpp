// SPDX-License-Identifier: Apache-2.0
#include "fbvins/features/booster_weights.hpp"

#include <fmt/format.h>

#include <charconv>
#include <optional>

#include "fbvins/features/keypoint.hpp"
#include "fbvins/features/safetensors.hpp"

namespace fbvins {
namespace {

constexpr std::string_view kFormat = "fbvins-booster-3";
constexpr int kBits = 256, kLargestSide = 1024, kMostLayers = 16, kMostKeypointLayers = 8;

Error damaged(std::string sentence) { return {ErrorCode::malformed, std::move(sentence)}; }

/// Takes tensors out of a file one by one; remembers the first thing that is wrong.
class Taker {
 public:
  explicit Taker(SafeTensors& file) : file_(file) {}

  int number(const std::string& field, int lowest, int highest) {
    const auto at = file_.metadata.find(field);
    int value = 0;
    if (at == file_.metadata.end()) return fail(fmt::format("metadata lacks \"{}\"", field)), lowest;
    const char* end = at->second.data() + at->second.size();
    const auto [rest, error] = std::from_chars(at->second.data(), end, value);
    if (error != std::errc() || rest != end || value < lowest || value > highest)
      return fail(fmt::format("metadata \"{}\" is \"{}\", not a number from {} to {}", field, at->second, lowest, highest)),
             lowest;
    return value;
  }

  /// A width that the kernels can handle.
  int side(const std::string& field) {
    const int value = number(field, 16, kLargestSide);
    if (value % 16 != 0) fail(fmt::format("metadata \"{}\" is {}, not a multiple of 16", field, value));
    return value;
  }

  std::vector<int> sides(const std::string& field) {
    const auto at = file_.metadata.find(field);
    std::vector<int> out;
    if (at == file_.metadata.end()) return fail(fmt::format("metadata lacks \"{}\"", field)), out;
    for (std::size_t from = 0; from <= at->second.size();) {
      const std::size_t to = std::min(at->second.find(',', from), at->second.size());
      int value = 0;
      const char* end = at->second.data() + to;
      const auto [rest, error] = std::from_chars(at->second.data() + from, end, value);
      if (error != std::errc() || rest != end || value < 16 || value > kLargestSide || value % 16 != 0 ||
          out.size() == kMostKeypointLayers)
        return fail(fmt::format("metadata \"{}\" is \"{}\", not up to {} multiples of 16 joined by commas", field, at->second,
                                kMostKeypointLayers)),
               out;
      out.push_back(value);
      from = to + 1;
    }
    return out;
  }

  std::vector<float> tensor(const std::string& name, const std::vector<int>& shape) {
    const auto at = file_.tensors.find(name);
    if (at == file_.tensors.end()) return fail(fmt::format("tensor \"{}\" is missing", name)), std::vector<float>{};
    if (at->second.shape != shape)
      return fail(fmt::format("tensor \"{}\" has shape [{}], not [{}]", name, fmt::join(at->second.shape, ", "),
                              fmt::join(shape, ", "))),
             std::vector<float>{};
    std::vector<float> values = std::move(at->second.values);
    file_.tensors.erase(at);
    return values;
  }

  LinearWeights linear(const std::string& name, int outputs, int inputs) {
    return {outputs, inputs, tensor(name + ".weight", {outputs, inputs}), tensor(name + ".bias", {outputs})};
  }

  NormWeights norm(const std::string& name, int width) {
    return {tensor(name + ".weight", {width}), tensor(name + ".bias", {width})};
  }

  BoosterLayerWeights layer(const std::string& name, int w) {
    return {linear(name + ".attention.query", w, w),
            linear(name + ".attention.key", w, w),
            linear(name + ".attention.value", w, w),
            linear(name + ".attention.out", w, w),
            linear(name + ".up", 2 * w, w),
            linear(name + ".down", w, 2 * w),
            norm(name + ".norm1", w),
            norm(name + ".norm2", w)};
  }

  void fail(std::string sentence) {
    if (!wrong_) wrong_ = std::move(sentence);
  }
  const std::optional<std::string>& wrong() const { return wrong_; }

 private:
  SafeTensors& file_;
  std::optional<std::string> wrong_;
};

Result<BoosterWeights> take_weights(SafeTensors file) {
  if (const auto format = file.metadata.find("format"); format == file.metadata.end() || format->second != kFormat)
    return Error{ErrorCode::unsupported,
                 fmt::format("metadata \"format\" is \"{}\", not \"{}\": these are no weights of this version",
                             format == file.metadata.end() ? "" : format->second, kFormat)};
  Taker take(file);
  BoosterWeights w;
  take.number("bits", kBits, kBits);
  w.width = take.side("width");
  const int hidden = take.side("descriptor_hidden"), layers = take.number("layers", 0, kMostLayers);
  std::vector<int> widths = take.sides("keypoint_hidden");
  const bool residual = take.number("residual", 0, 1) != 0;
  w.margins = take.number("margins", 0, 1) != 0;
  if (take.wrong()) return damaged(*take.wrong());
  widths.insert(widths.begin(), kBoosterGeometry);
  widths.push_back(w.width);
  const int inputs = w.margins ? kMarginsPerFeature : kBits;
  w.descriptor1 = take.linear("descriptor1", hidden, inputs);
  w.descriptor2 = take.linear("descriptor2", w.width, hidden);
  for (std::size_t i = 0; i + 1 < widths.size(); ++i)
    w.keypoint.push_back(take.linear(fmt::format("keypoint.{}", i), widths[i + 1], widths[i]));
  for (int l = 0; l < layers; ++l) w.layers.push_back(take.layer(fmt::format("layers.{}", l), w.width));
  w.head = take.linear("head", kBits, w.width);
  if (residual) w.skip = {kBits, inputs, take.tensor("skip.weight", {kBits, inputs}), std::vector<float>(kBits, 0.0f)};
  if (take.wrong()) return damaged(*take.wrong());
  if (!file.tensors.empty())
    return damaged(fmt::format("tensor \"{}\" does not belong to this network", file.tensors.begin()->first));
  const auto name = file.metadata.find("name");
  w.name = name == file.metadata.end() ? "booster" : name->second;
  return w;
}

}  // namespace

Result<BoosterWeights> parse_booster_weights(std::string_view bytes) {
  Result<SafeTensors> file = parse_safetensors(bytes);
  if (!file) return file.error();
  return take_weights(std::move(*file));
}

Result<BoosterWeights> load_booster_weights(const std::string& path) {
  Result<SafeTensors> file = read_safetensors(path);
  if (!file) return file.error();
  Result<BoosterWeights> out = take_weights(std::move(*file));
  if (!out) return Error{out.error().code, path + ": " + out.error().message};
  return out;
}

}  // namespace fbvins
