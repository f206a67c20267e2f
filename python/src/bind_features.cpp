// SPDX-License-Identifier: Apache-2.0
// ORB features and the learned booster by themselves.
#include <fmt/format.h>

#include <cstring>
#include <mutex>

#include "bindings.hpp"
#include "fbvins/features/booster.hpp"
#include "fbvins/features/booster_network.hpp"
#include "fbvins/features/booster_weights.hpp"
#include "fbvins/features/orb.hpp"

namespace fbvins::python {
namespace {

constexpr std::int64_t kKeypointColumns = 6, kDescriptorBytes = 32;

struct Features {
  int width = 0, height = 0;
  OrbFeatures orb;
};

Features extract(nb::handle image, int max_features, int levels) {
  const auto pixels = checked<std::uint8_t>(image, "image", {kAny, kAny});
  if (max_features < 1 || levels < 1 || levels > 8)
    throw nb::value_error("max_features is at least 1, and levels is from 1 to 8");
  Features out;
  out.width = static_cast<int>(pixels.shape[1]);
  out.height = static_cast<int>(pixels.shape[0]);
  nb::gil_scoped_release released;
  OrbExtractor extractor({.max_features = max_features, .levels = levels}, true);
  extractor.extract({pixels.data, out.width, out.height, out.width}, out.orb);
  return out;
}

Array<double> keypoints_of(const Features& f) {
  return columns(f.orb.keypoints,
                 [](const Keypoint& k) { return Vec6(k.pixel.x(), k.pixel.y(), k.scale, k.angle_rad, k.score, k.level); });
}

Array<std::uint8_t> bytes_of(const std::vector<Descriptor>& descriptors) {
  std::vector<std::uint8_t> bytes(descriptors.size() * kDescriptorBytes);
  if (!bytes.empty()) std::memcpy(bytes.data(), descriptors.data(), bytes.size());
  return to_array(std::move(bytes), {descriptors.size(), static_cast<std::size_t>(kDescriptorBytes)});
}

Array<std::int8_t> margins_of(const Features& f) {
  std::vector<std::int8_t> values(f.orb.margins.size() * kMarginsPerFeature);
  if (!values.empty()) std::memcpy(values.data(), f.orb.margins.data(), values.size());
  return to_array(std::move(values), {f.orb.margins.size(), static_cast<std::size_t>(kMarginsPerFeature)});
}

/// The network behind a lock, so that any thread may call it.
class Booster {
 public:
  Booster(const std::string& name, bool exact)
      : weights_(value_or_raise(load_booster_weights(booster_weights_path(name)))),
        network_(weights_, exact ? BoosterPrecision::float32 : BoosterPrecision::int8, best_int8_kernel()) {}

  Array<std::uint8_t> boost(nb::handle descriptors, nb::handle keypoints, int width, int height) {
    const auto points = checked<double>(keypoints, "keypoints", {kAny, kKeypointColumns});
    const auto n = static_cast<std::int64_t>(points.rows());
    std::vector<Margins> margins(weights_.margins ? points.rows() : 0);
    std::vector<Descriptor> bits(points.rows());
    if (weights_.margins) {
      const auto in = checked<std::int8_t>(descriptors, "descriptors (margins, as these weights need)", {n, kMarginsPerFeature});
      if (n > 0) std::memcpy(static_cast<void*>(margins.data()), in.data, static_cast<std::size_t>(n) * kMarginsPerFeature);
    } else {
      const auto in = checked<std::uint8_t>(descriptors, "descriptors", {n, kDescriptorBytes});
      if (n > 0) std::memcpy(static_cast<void*>(bits.data()), in.data, static_cast<std::size_t>(n * kDescriptorBytes));
    }
    std::vector<Keypoint> kept;
    for (std::size_t i = 0; i < points.rows(); ++i) {
      const double* k = points.data + kKeypointColumns * static_cast<std::ptrdiff_t>(i);
      kept.push_back({Vec2(k[0], k[1]), static_cast<int>(k[5]), static_cast<float>(k[2]), static_cast<float>(k[3]),
                      static_cast<float>(k[4])});
    }
    {
      nb::gil_scoped_release released;
      const std::lock_guard lock(mutex_);
      network_.run(width, height, kept, margins, bits);
    }
    return bytes_of(bits);
  }
  bool takes_margins() const { return weights_.margins; }

 private:
  BoosterWeights weights_;
  BoosterNetwork network_;
  std::mutex mutex_;
};

}  // namespace

void bind_features(nb::module_& m) {
  nb::class_<Features>(m, "Features", "ORB features of one image; row i of each array is feature i.")
      .def_prop_ro(
          "keypoints", &keypoints_of,
          "float64 (N, 6): x, y [px of the image], scale [px of the image a px of its level spans], angle [rad, from x to y], "
          "score (Harris), level of the pyramid")
      .def_prop_ro(
          "descriptors", [](const Features& f) { return bytes_of(f.orb.descriptors); },
          "uint8 (N, 32): 256 bits, to be compared by Hamming distance")
      .def_prop_ro(
          "margins", &margins_of,
          "int8 (N, 512): margin of each of the 256 comparisons, in 1/32 of their root mean square, of the pattern and of its "
          "surroundings; the input of the shipped booster")
      .def_prop_ro(
          "size", [](const Features& f) { return nb::make_tuple(f.width, f.height); }, "(width, height) of the image, px")
      .def("__len__", [](const Features& f) { return f.orb.size(); })
      .def("__repr__",
           [](const Features& f) { return fmt::format("<fbvins.Features, {} of {}x{} px>", f.orb.size(), f.width, f.height); });
  m.def("orb", &extract, "image"_a, "max_features"_a = 500, "levels"_a = 3,
        "ORB features of a uint8 (height, width) image, spread over it (paper 2.2.1).");

  nb::class_<Booster>(m, "Booster", "The network that improves descriptors (paper 2.2.2), loaded once. Any thread may call.")
      .def(nb::init<const std::string&, bool>(), "weights"_a = "boost-s", "exact"_a = false,
           "weights: 'boost-s', which ships, or a .safetensors file. exact: single precision instead of 8-bit integers.")
      .def("__call__", &Booster::boost, "descriptors"_a, "keypoints"_a, "width"_a, "height"_a, "uint8 (N, 32).")
      .def_prop_ro("takes_margins", &Booster::takes_margins, "descriptors are Features.margins; False: Features.descriptors");
}

}  // namespace fbvins::python
