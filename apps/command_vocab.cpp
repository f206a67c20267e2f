// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>

#include "apps/commands.hpp"
#include "apps/terminal.hpp"
#include "fbvins/core/options.hpp"
#include "fbvins/features/booster.hpp"
#include "fbvins/features/orb.hpp"
#include "fbvins/io/file_source.hpp"
#include "fbvins/io/image_decode.hpp"
#include "fbvins/loop/vocabulary_file.hpp"
#include "fbvins/loop/vocabulary_training.hpp"

namespace fbvins::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExamples = R"(examples:
  fbvins vocab train photos/ -o orb_vocabulary.fbv        from every PNG and JPEG below photos/
  fbvins vocab info orb_vocabulary.fbv
)";

struct Arguments {
  std::vector<std::string> images;
  std::string output = "orb_vocabulary.fbv", file;
  bool boosted = false;
  VocabularyTrainingOptions training;
};

bool is_image(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg";
}

/// Files, and the images inside of folders; sorted, so that the same images give the same vocabulary.
std::vector<std::string> image_files(const std::vector<std::string>& arguments) {
  std::vector<std::string> files;
  for (const std::string& argument : arguments) {
    if (!fs::is_directory(argument)) {
      files.push_back(argument);
      continue;
    }
    for (const auto& entry : fs::recursive_directory_iterator(argument))
      if (entry.is_regular_file() && is_image(entry.path())) files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

int train(const Arguments& arguments) {
  if (auto valid = validate(arguments.training); !valid) return fail(valid.error().message);
  Result<std::unique_ptr<DescriptorStage>> stage = make_identity_stage();
  if (arguments.boosted) stage = make_booster_stage(BoosterOptions{});
  if (!stage) return fail(stage.error().message);
  OrbExtractor extractor(OrbOptions{.max_features = 800, .levels = 6}, (*stage)->changes_descriptors());
  OrbFeatures features;
  std::vector<std::vector<Descriptor>> images;
  std::size_t descriptors = 0;
  for (const std::string& file : image_files(arguments.images)) {
    const auto bytes = read_file(file, std::uint64_t{1} << 28);
    if (!bytes) return fail(bytes.error().message);
    const auto image = decode_image(*bytes);
    if (!image) return fail(fmt::format("{}: {}", file, image.error().message));
    extractor.extract(image->view(), features);
    (*stage)->improve(image->width(), image->height(), features);
    descriptors += features.size();
    images.push_back(features.descriptors);
  }
  if (images.empty()) return fail("no image to train with");
  const Vocabulary vocabulary =
      train_vocabulary(arguments.boosted ? kBoostedDescriptors : kRawDescriptors, images, arguments.training);
  if (auto saved = vocabulary.save(arguments.output); !saved) return fail(saved.error().message);
  fmt::print("{}: {} words from {} descriptors of {} images\n", arguments.output, vocabulary.words(), descriptors, images.size());
  return kOk;
}

int info(const Arguments& arguments) {
  const auto vocabulary = Vocabulary::open(arguments.file);
  if (!vocabulary) return fail(vocabulary.error().message);
  fmt::print("{}: {} words of kind '{}', {} nodes\n", arguments.file, vocabulary->words(), vocabulary->kind(),
             vocabulary->nodes().size());
  return kOk;
}

}  // namespace

void add_vocab_command(CLI::App& program, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("vocab", kVocabDescription);
  command->footer(kExamples);
  command->require_subcommand(1);
  CLI::App* training = command->add_subcommand("train", "from images of any kind, folders are searched");
  training->add_option("images", arguments->images, "images or folders")->required()->check(CLI::ExistingPath);
  training->add_option("-o,--output", arguments->output, "the file to write");
  training->add_flag("--boosted", arguments->boosted, "use boosted descriptors");
  training->add_option("--seed", arguments->training.seed, "seed of the initial cluster centres");
  training->callback([arguments, &exit_code] { exit_code = train(*arguments); });
  CLI::App* looking = command->add_subcommand("info", "what is in a vocabulary file");
  looking->add_option("file", arguments->file, "vocabulary")->required();
  looking->callback([arguments, &exit_code] { exit_code = info(*arguments); });
}

}  // namespace fbvins::app
