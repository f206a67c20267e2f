// SPDX-License-Identifier: Apache-2.0
// The images of a EuRoC folder's frames, read where they are delivered.
#include <fmt/format.h>

#include <algorithm>

#include "fbvins/io/euroc_frames.hpp"
#include "fbvins/io/image_check.hpp"
#include "fbvins/io/image_decode.hpp"
#include "fbvins/io/side_by_side.hpp"

namespace fbvins {
namespace {

constexpr std::uint64_t kLargestImage_bytes = std::uint64_t{64} << 20u;

int width_of(const Image& image) { return image.width(); }
int height_of(const Image& image) { return image.height(); }
int width_of(const DepthImage& image) { return image.width; }
int height_of(const DepthImage& image) { return image.height; }

class EurocLoader : public FrameLoader {
 public:
  EurocLoader(std::unique_ptr<FileSource> files, std::string root, std::vector<std::string> folders, const StereoRig& rig)
      : files_(std::move(files)), root_(std::move(root)), folders_(std::move(folders)), rig_(rig) {}

  /// Of all cameras together, from images spread over the recording, so that all its images are scaled alike.
  int find_used_bits(const std::vector<FrameEntry>& frames) {
    std::uint16_t largest = 0;
    for (std::size_t i = 0; i < folders_.size(); ++i)
      for (const std::string& file : images_to_try(frames, [&](const FrameEntry& f) { return f.file(static_cast<int>(i)); })) {
        const Result<std::string> bytes = files_->read(path_of(file, folders_[i]), kLargestImage_bytes);
        const auto of_image = bytes ? largest_value_of_png(*bytes) : std::nullopt;
        if (bytes && !of_image) break;  // a camera's images are of one kind
        largest = std::max(largest, of_image.value_or(0));
      }
    return used_bits_ = bits_used_for(largest);
  }

  LoadedFrame load(const FrameEntry& entry) override {
    LoadedFrame out;
    out.frame.t = entry.t;
    out.frame.offsets = entry.offsets;
    for (int i = 0; i < static_cast<int>(entry.files.size()); ++i)
      out.frame.images.push_back(load_image(entry.file(i), i, out.of(i), out));
    out.frame.depth = load<DepthImage>(entry.depth_file, kDepthFolder, &decode_depth, rig_.depth_camera(), out.depth, out);
    return out;
  }

 private:
  std::shared_ptr<const Image> load_image(const std::string& file, int camera, ImageCounts& counts, LoadedFrame& out) const {
    if (file.empty()) return nullptr;
    const bool side_by_side = folders_.size() == 2 && folders_[0] == folders_[1];
    const auto decode = [&](std::string_view bytes) {
      Result<Image> image = decode_image(bytes, used_bits_);
      return image && side_by_side ? Result<Image>(half_of(*image, camera)) : image;
    };
    return load<Image>(file, folders_[static_cast<std::size_t>(camera)], decode, rig_.camera(camera), counts, out);
  }

  std::string path_of(const std::string& file, std::string_view folder) const {
    return fmt::format("{}{}data/{}", root_, folder, file);
  }

  template <class T, class Decode>
  std::shared_ptr<const T> load(const std::string& file, std::string_view folder, const Decode& decode, const Camera& camera,
                                ImageCounts& counts, LoadedFrame& out) const {
    if (file.empty()) return nullptr;
    std::string& problem = out.problem;
    const std::string path = path_of(file, folder);
    const auto blame = [&](const std::string& sentence) {
      if (problem.empty()) problem = fmt::format("{}: {}", files_->describe(path), sentence);
    };
    Result<std::string> bytes = files_->read(path, kLargestImage_bytes);
    Result<T> image = bytes ? decode(*bytes) : Result<T>(bytes.error());
    if (!image) {
      ++counts.corrupt;
      if (bytes) blame(image.error().message);
      else if (problem.empty()) problem = image.error().message;
      return nullptr;
    }
    if (const auto sentence = wrong_size(width_of(*image), height_of(*image), camera)) {
      ++counts.wrong_size;
      out.other_size = ImageSize{width_of(*image), height_of(*image)};
      blame(*sentence);
      return nullptr;
    }
    return std::make_shared<const T>(*std::move(image));
  }

  std::unique_ptr<FileSource> files_;
  std::string root_;
  std::vector<std::string> folders_;
  StereoRig rig_;
  int used_bits_ = 16;
};

}  // namespace

std::unique_ptr<FrameLoader> make_euroc_loader(std::unique_ptr<FileSource> files, const std::string& root,
                                               std::vector<std::string> folders, const StereoRig& rig,
                                               const std::vector<FrameEntry>& frames, DatasetInfo& info) {
  const std::string name = files->describe(root);
  auto loader = std::make_unique<EurocLoader>(std::move(files), root, std::move(folders), rig);
  if (const int bits = loader->find_used_bits(frames); bits < 16) info.warnings.push_back(used_bits_sentence(name, bits));
  return loader;
}

}  // namespace fbvins
