// SPDX-License-Identifier: Apache-2.0
#include "fbvins/io/mcap_images.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cstring>
#include <optional>
#include <utility>

#include "fbvins/io/image_decode.hpp"
#include "fbvins/io/ros_messages.hpp"

namespace fbvins {
namespace {

/// Where an image's message is in the file, as a FrameEntry names it.
struct ImagePlace {
  std::uint64_t offset = 0, length = 0;

  std::string name() const { return fmt::format("{}+{}", offset, length); }
  static ImagePlace of(const std::string& name) {
    ImagePlace place;
    const char* end = name.data() + name.size();
    const auto offset = std::from_chars(name.data(), end, place.offset);
    if (offset.ptr != end) std::from_chars(offset.ptr + 1, end, place.length);
    return place;
  }
};

class McapLoader : public FrameLoader {
 public:
  McapLoader(std::shared_ptr<const ByteSource> bytes, std::string name, const StereoRig& rig)
      : bytes_(std::move(bytes)), name_(std::move(name)), rig_(rig) {}

  LoadedFrame load(const FrameEntry& entry) override {
    LoadedFrame out;
    out.frame.t = entry.t;
    out.frame.offsets = entry.offsets;
    const auto load = [&]<class T>(const std::string& file, const Camera& camera, ImageCounts& counts,
                                   std::shared_ptr<const T>& image) {
      if (!file.empty()) image = load_image<T>(ImagePlace::of(file), camera, counts, out);
    };
    out.frame.images.resize(entry.files.size());
    for (int i = 0; i < static_cast<int>(entry.files.size()); ++i)
      load(entry.file(i), rig_.camera(i), out.of(i), out.frame.images[static_cast<std::size_t>(i)]);
    load(entry.depth_file, rig_.depth_camera(), out.depth, out.frame.depth);
    return out;
  }

 private:
  template <class T>
  std::shared_ptr<const T> load_image(const ImagePlace& place, const Camera& camera, ImageCounts& counts,
                                      LoadedFrame& loaded) const {
    std::string& problem = loaded.problem;
    const auto blame = [&](const std::string& sentence) {
      if (problem.empty()) problem = fmt::format("{}: byte {}: {}", name_, place.offset, sentence);
    };
    const std::string message = bytes_->read(place.offset, place.length);
    const std::optional<RosImage> image = read_image(message);
    if (!image) {
      ++counts.corrupt;
      blame("this image cannot be read any more");
      return nullptr;
    }
    if (const auto sentence = wrong_size(image->width, image->height, camera)) {
      ++counts.wrong_size;
      loaded.other_size = ImageSize{static_cast<int>(image->width), static_cast<int>(image->height)};
      blame(*sentence);
      return nullptr;
    }
    auto out = std::make_shared<T>(blank(camera, static_cast<const T*>(nullptr)));
    const std::size_t row = image->width * (image->is_depth() ? 2 : 1);
    for (int y = 0; y < camera.height(); ++y)
      std::memcpy(row_of(*out, y), image->pixels.data() + std::size_t{image->step} * static_cast<std::size_t>(y), row);
    return out;
  }
  static Image blank(const Camera& camera, const Image*) { return {camera.width(), camera.height()}; }
  static DepthImage blank(const Camera& camera, const DepthImage*) {
    DepthImage out{camera.width(), camera.height(), {}};
    out.mm.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
    return out;
  }
  static std::uint8_t* row_of(Image& image, int y) { return image.row(y); }
  static std::uint16_t* row_of(DepthImage& image, int y) { return image.mm.data() + std::ptrdiff_t{y} * image.width; }

  std::shared_ptr<const ByteSource> bytes_;
  std::string name_;
  StereoRig rig_;
};

}  // namespace

std::string mcap_image_name(std::uint64_t offset, std::uint64_t length) { return ImagePlace{offset, length}.name(); }

std::unique_ptr<FrameLoader> make_mcap_loader(std::shared_ptr<const ByteSource> bytes, std::string name, const StereoRig& rig) {
  return std::make_unique<McapLoader>(std::move(bytes), std::move(name), rig);
}

}  // namespace fbvins
