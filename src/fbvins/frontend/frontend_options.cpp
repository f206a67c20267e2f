// SPDX-License-Identifier: Apache-2.0
#include "fbvins/frontend/frontend_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <utility>

#include "fbvins/camera/camera_groups.hpp"
#include "fbvins/features/booster.hpp"
#include "fbvins/frontend/for_each_group.hpp"
#include "fbvins/frontend/frontend_registry.hpp"
#include "fbvins/frontend/klt_frontend.hpp"
#include "fbvins/frontend/orb_frontend.hpp"

namespace fbvins {
namespace {

using Made = Result<std::unique_ptr<Frontend>>;

/// The keypoints that are extracted for the tracks of a rig are twice those of one pair at most; each group of cameras has its
/// share.
template <class Options>
Options shared_by(Options options, std::size_t groups) {
  if constexpr (requires { options.max_keypoints; })
    if (groups > 2) options.max_keypoints = std::max(1, 2 * options.max_keypoints / static_cast<int>(groups));
  return options;
}

/// `lead(rig, options)`: the frontend for a rig whose left camera leads.
template <class Options, class Lead>
std::unique_ptr<Frontend> with_shares(const StereoRig& rig, const Options& of_rig, Lead&& lead) {
  const Options options = shared_by(of_rig, leading_groups(rig).size());
  return for_each_group(rig, of_rig.max_features, [&](const StereoRig& cameras) { return lead(cameras, options); });
}

Made make_klt(const StereoRig& rig, const FrontendOptions& options) {
  return with_shares(rig, options.klt, [](const StereoRig& r, const auto& o) { return std::make_unique<KltFrontend>(r, o); });
}

std::unique_ptr<Frontend> orb_with(const StereoRig& rig, const OrbFrontendOptions& options,
                                   const std::shared_ptr<DescriptorStage>& stage) {
  return with_shares(rig, options, [&](const StereoRig& r, const auto& o) { return std::make_unique<OrbFrontend>(r, o, stage); });
}

Made make_orb(const StereoRig& rig, const FrontendOptions& options) { return orb_with(rig, options.orb, make_identity_stage()); }

Made make_boost(const StereoRig& rig, const FrontendOptions& options) {
  Result<std::unique_ptr<DescriptorStage>> stage = make_booster_stage(options.boost.booster);
  if (!stage) return stage.error();
  return orb_with(rig, options.orb, std::move(*stage));
}

/// All frontends, in the order of registration. The last of ours is the default.
std::vector<FrontendKind>& kinds() {
  static std::vector<FrontendKind> all = {
      {"klt", "corners followed by Lucas-Kanade", make_klt},
      {"orb", "ORB keypoints followed by patch alignment and descriptors", make_orb},
      {"boost", "orb with descriptors improved by a network", make_boost},
  };
  return all;
}

bool is_name(const std::string& name) {
  const auto fits = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_'; };
  return !name.empty() && std::ranges::all_of(name, fits);
}

}  // namespace

Result<void> register_frontend(FrontendKind kind) {
  if (!is_name(kind.name))
    return Error{ErrorCode::invalid_argument,
                 fmt::format("'{}' is no name of a frontend: letters, digits, '-' and '_'", kind.name)};
  if (std::ranges::find(kinds(), kind.name, &FrontendKind::name) != kinds().end())
    return Error{ErrorCode::invalid_argument, fmt::format("there is a frontend \"{}\" already", kind.name)};
  kinds().push_back(std::move(kind));
  return {};
}

std::vector<std::string> frontend_names() {
  std::vector<std::string> names;
  for (const FrontendKind& kind : kinds()) names.push_back(kind.name);
  return names;
}

std::string default_frontend() { return "boost"; }

std::string frontend_choices() { return fmt::format("{}", fmt::join(frontend_names(), "|")); }

std::string frontend_meanings() {
  std::vector<std::string> lines;
  for (const FrontendKind& kind : kinds()) lines.push_back(fmt::format("{}: {}", kind.name, kind.meaning));
  return fmt::format("{}", fmt::join(lines, "; "));
}

Result<std::unique_ptr<Frontend>> make_frontend(const StereoRig& rig, const FrontendOptions& options) {
  for (const FrontendKind& kind : kinds())
    if (kind.name == options.kind) return kind.make(rig, options);
  return Error{ErrorCode::invalid_argument,
               fmt::format("there is no frontend \"{}\"; there are {}", options.kind, fmt::join(frontend_names(), ", "))};
}

Result<std::unique_ptr<Frontend>> make_frontend(const StereoRig& rig, const std::string& name) {
  FrontendOptions options;
  options.kind = name;
  return make_frontend(rig, options);
}

}  // namespace fbvins
