// SPDX-License-Identifier: Apache-2.0
#include "apps/bridge_source.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <regex>
#include <utility>
#include <vector>

#include "apps/bridge_process.hpp"
#include "apps/command_line.hpp"
#include "fbvins/v4l2/v4l2_source.hpp"

namespace fbvins::app {
namespace {

namespace fs = std::filesystem;

/// A missing package, or a wrong argument, is known by then: with a calibration that is given nothing else is waited for.
constexpr double kStartsWithin_s = 3;

struct Bridge {
  const char *kind, *script, *packages;
};
constexpr Bridge kBridges[] = {{"d435i", "d435i_bridge.py", "pyrealsense2 numpy"},
                               {"realsense", "d435i_bridge.py", "pyrealsense2 numpy"},
                               {"oak", "oak_bridge.py", "'depthai>=3' numpy"},
                               {"orbbec", "orbbec_bridge.py", "pyorbbecsdk2 numpy"},
                               {"zed", "zed_imu.py", "numpy"}};

const Bridge* find_bridge(const std::string& kind) {
  for (const Bridge& bridge : kBridges)
    if (kind == bridge.kind) return &bridge;
  return nullptr;
}

/// DEVICE and mode of a source's name; either may be empty.
struct BridgedName {
  std::string device, mode;
};

Result<BridgedName> parse_name(const std::string& kind, const std::string& where) {
  static const std::regex kMode(R"((?:(.*):)?((?:\d{1,5}x\d{1,5})(?:@\d{1,4})?|@\d{1,4}))"), kDepth("(?:.*:)?depth");
  BridgedName name{where, ""};
  std::smatch found;
  if (std::regex_match(where, found, kMode)) name = {found[1].str(), found[2].str()};
  if (std::regex_match(name.device, kDepth))
    return Error{ErrorCode::invalid_argument,
                 fmt::format("source '{}:{}': depth images of it need a build with librealsense2 (docs/d435i.md); without them: "
                             "--source {}",
                             kind, where, kind)};
  if (kind == "zed" && (name.mode.empty() || name.mode.find('@') != std::string::npos))
    return Error{
        ErrorCode::invalid_argument,
        fmt::format("source '{}': a ZED is zed[:/dev/videoN]:WIDTHxHEIGHT, the size of one image, such as zed:672x376", kind)};
  return name;
}

/// A folder for this source's socket alone, which goes with it.
class PrivateFolder {
 public:
  PrivateFolder() {
    std::error_code error;
    std::string name = (fs::temp_directory_path(error) / "fbvins-XXXXXX").string();
    if (name.size() > 80) name = "/tmp/fbvins-XXXXXX";  // a socket's path has 107 bytes at most
    if (mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~PrivateFolder() {
    std::error_code error;
    if (!path_.empty()) fs::remove_all(path_, error);
  }
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

std::vector<std::string> arguments_of(const std::string& script, const std::string& socket, const Bridge& bridge,
                                      const BridgedName& name) {
  const char* python = std::getenv("FBVINS_PYTHON");
  std::vector<std::string> arguments{python != nullptr && *python != '\0' ? python : "python3", "-u", "-B", script, socket};
  const bool is_zed = std::string_view(bridge.kind) == "zed";  // its device is the camera's, which the program does not read
  if (!name.device.empty() && !is_zed) arguments.push_back(name.device);
  if (!name.mode.empty()) arguments.push_back(name.mode);
  return arguments;
}

class BridgeSource final : public Source {
 public:
  BridgeSource(const Bridge& bridge, BridgedName name, SourceOptions options)
      : bridge_(bridge), name_(std::move(name)), say_(std::move(options.say)), options_(std::move(options)) {
    options_.say = [this](const std::string& sentence) { say(sentence); };
  }
  ~BridgeSource() override { process_.reset(); }

  Result<void> open() {
    if (folder_.path().empty())
      return Error{ErrorCode::unwritable,
                   fmt::format("source '{}': no temporary folder can be made for its socket", bridge_.kind)};
    const Result<std::string> script = bridge_script(bridge_.script);
    if (!script) return script.error();
    const std::string socket = folder_.path() + "/s";
    process_ = std::make_unique<BridgeProcess>(
        BridgeCommand{bridge_.kind, arguments_of(*script, socket, bridge_, name_), bridge_.packages, socket}, options_.say,
        [this] { stop(); });
    SourceOptions options = options_;
    options.give_up = [this] { return options_.give_up() || process_->is_over(); };
    auto inner = std::string_view(bridge_.kind) == "zed" ? open_zed(socket, options) : make_source("socket:" + socket, options);
    if (inner && brings_rig()) process_->wait_for_end(kStartsWithin_s);
    if (process_->is_over()) return process_->end();
    if (!inner && options_.give_up()) return Error{ErrorCode::not_found, fmt::format("{}: no device came", bridge_.kind)};
    if (!inner) return inner.error();
    const std::lock_guard lock(mutex_);
    inner_ = *std::move(inner);
    return {};
  }

  const StereoRig& rig() const override { return inner_->rig(); }
  Result<void> run(SensorInput& input) override {
    Arrivals arrivals(input, *process_);
    const Result<void> ended = process_->is_over() ? Result<void>{} : inner_->run(arrivals);
    return ended && process_->is_over() ? process_->end() : ended;
  }
  void stop() override {
    const std::lock_guard lock(mutex_);
    if (inner_) inner_->stop();
  }
  std::unique_ptr<Sink> status_sink() override { return inner_->status_sink(); }
  std::vector<SensorFinding> device_findings() const override { return inner_->device_findings(); }

 private:
  /// Tells the watcher that data come.
  class Arrivals final : public SensorInput {
   public:
    Arrivals(SensorInput& input, BridgeProcess& process) : input_(input), process_(process) {}
    void push(const ImuSample& sample) override {
      process_.something_came();
      input_.push(sample);
    }
    void push(StereoFrame frame) override { input_.push(std::move(frame)); }
    void push_anchor(Anchor anchor) override { input_.push_anchor(std::move(anchor)); }
    void push_aiding(const AidingSample& reading) override { input_.push_aiding(reading); }

   private:
    SensorInput& input_;
    BridgeProcess& process_;
  };

  bool brings_rig() const {
    return options_.dataset.brings_rig() || options_.uncalibrated || std::string_view(bridge_.kind) == "zed";
  }

  Result<std::unique_ptr<Source>> open_zed(const std::string& socket, const SourceOptions& options) const {
    const std::string camera = name_.device.empty() ? "/dev/video0" : name_.device;
    auto source = V4l2Source::open(camera + ",socket:" + socket, options);
    if (!source) return source.error();
    return std::unique_ptr<Source>(*std::move(source));
  }

  /// The socket is an inner matter: its sentences are this source's.
  void say(std::string sentence) {
    const std::string path = folder_.path() + "/s: ";
    if (sentence.starts_with(path)) sentence = fmt::format("{}: {}", bridge_.kind, sentence.substr(path.size()));
    if (sentence.ends_with("waiting for a sender that has the calibration")) return;
    const std::lock_guard lock(say_mutex_);
    say_(sentence);
  }

  const Bridge& bridge_;
  BridgedName name_;
  std::function<void(const std::string&)> say_;
  SourceOptions options_;
  PrivateFolder folder_;
  std::mutex say_mutex_, mutex_;
  std::unique_ptr<BridgeProcess> process_;
  std::unique_ptr<Source> inner_;
};

}  // namespace

bool is_bridged(const std::string& kind) { return find_bridge(kind) != nullptr; }

Result<std::string> bridge_script(const std::string& name) {
  std::vector<std::string> folders;
  if (const char* named = std::getenv("FBVINS_BRIDGES"); named != nullptr && *named != '\0') folders = {named};
  else
    folders = {program_folder() / "../bridges", program_folder() / "../share/fbvins/bridges", FBVINS_INSTALLED_BRIDGES,
               FBVINS_SOURCE_BRIDGES};
  std::error_code error;
  for (const std::string& folder : folders)
    if (fs::exists(folder + "/" + name, error)) return folder + "/" + name;
  return Error{ErrorCode::not_found,
               fmt::format("{}: this program, which reads the device, is in none of {}; FBVINS_BRIDGES may name its folder", name,
                           fmt::join(folders, ", "))};
}

Result<std::unique_ptr<Source>> open_bridged(const std::string& kind, const std::string& where, const SourceOptions& options) {
  Result<BridgedName> name = parse_name(kind, where);
  if (!name) return name.error();
  auto source = std::make_unique<BridgeSource>(*find_bridge(kind), *std::move(name), options);
  if (Result<void> opened = source->open(); !opened) return opened.error();
  return std::unique_ptr<Source>(std::move(source));
}

}  // namespace fbvins::app
