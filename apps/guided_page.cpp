// SPDX-License-Identifier: Apache-2.0
#include "apps/guided_page.hpp"

#include <fmt/format.h>

#include <chrono>
#include <mutex>
#include <nlohmann/json.hpp>

#include "apps/terminal.hpp"

#ifdef FBVINS_WITH_WEB
#include "apps/web_options.hpp"
#include "fbvins/web/grey_jpeg.hpp"
#include "fbvins/web/page_files.hpp"
#include "fbvins/web/web_messages.hpp"
#endif

namespace fbvins::app {

#ifdef FBVINS_WITH_WEB

namespace {

using Json = nlohmann::ordered_json;

constexpr std::chrono::seconds kFarewell{3};

SharedMessage text(const Json& json) {
  return std::make_shared<const WebMessage>(WebMessage{json.dump(-1, ' ', false, Json::error_handler_t::replace), false, false});
}

/// The page of this command in place of the flight's.
PageFiles guided_files() {
  PageFiles files = page_files();
  std::erase_if(files, [](const PageFile& file) { return file.path == "/index.html"; });
  for (PageFile& file : files)
    if (file.path == "/calibrate.html") file.path = "/index.html";
  return files;
}

SharedMessage state_message(const GuidedState& state) {
  Json json{{"type", "calibration"},      {"stage", state.stage},           {"action", state.action},
            {"reason", state.reason},     {"duration_s", state.duration_s}, {"images", state.images},
            {"left_out", state.left_out}, {"readings", state.readings},     {"noise_px", state.progress.noise_px}};
  Json& parts = json["parts"] = Json::array();
  for (const WeakPart& part : state.progress.parts)
    parts.push_back({{"what", part.what}, {"unit", part.unit}, {"sigma", part.sigma}, {"aim", part.aim}});
  Json& cameras = json["cameras"] = Json::array();
  for (const ImageCoverage& camera : state.progress.cameras)
    cameras.push_back({{"width_px", camera.size.width},
                       {"height_px", camera.size.height},
                       {"columns", camera.grid.columns},
                       {"rows", camera.grid.rows},
                       {"corners", camera.corners},
                       {"views", camera.views}});
  return text(json);
}

class ServedPage final : public GuidedPage {
 public:
  ServedPage(WebOptions options, std::string source) : options_(std::move(options)) {
    hello_ = text({{"type", "hello"}, {"program", "fbvins " FBVINS_VERSION}, {"source", source}});
  }

  Result<void> begin() {
    auto server = WebServer::start(options_, guided_files(), {.greet = [this] { return greeting(); }});
    if (!server) return server.error();
    server_ = *std::move(server);
    note(fmt::format("the page is {}", page_url(options_.address, server_->port(), options_.token)));
    return {};
  }

  void show(const GuidedState& state) override {
    SharedMessage message = state_message(state);
    {
      const std::lock_guard lock(mutex_);
      last_ = message;
    }
    server_->send(std::move(message));
  }

  void show(const BoardWatch::Look& look) override {
    shown_.resize(std::max(shown_.size(), look.cameras.size()));
    for (std::size_t k = 0; k < look.cameras.size() && server_->viewers() > 0; ++k) {
      const BoardWatch::Picture& picture = look.cameras[k];
      if (!picture.image || picture.t == shown_[k]) continue;
      shown_[k] = picture.t;
      std::vector<LiveView::Feature> corners;
      for (const BoardCorner& corner : picture.corners) corners.push_back({{}, corner.pixel, corner.index, 0});
      server_->send(image_message(picture.t.seconds(), encoder_.encode(*picture.image), picture.image->width(),
                                  picture.image->height(), corners, static_cast<int>(k)));
    }
  }

  void finish() override { server_->drain(kFarewell); }

 private:
  std::vector<SharedMessage> greeting() {
    const std::lock_guard lock(mutex_);
    std::vector<SharedMessage> out{hello_};
    if (last_) out.push_back(last_);
    return out;
  }

  WebOptions options_;
  SharedMessage hello_;
  std::mutex mutex_;  ///< guards last_
  SharedMessage last_;
  GreyJpeg encoder_;
  std::vector<Time> shown_;
  std::unique_ptr<WebServer> server_;  ///< last: its thread uses the members above
};

}  // namespace

Result<std::unique_ptr<GuidedPage>> GuidedPage::open(const std::string& where, const std::string& source) {
  auto options = web_options(where);
  if (!options) return options.error();
  auto page = std::make_unique<ServedPage>(*std::move(options), source);
  if (Result<void> begun = page->begin(); !begun) return begun.error();
  return std::unique_ptr<GuidedPage>(std::move(page));
}

#else

Result<std::unique_ptr<GuidedPage>> GuidedPage::open(const std::string&, const std::string&) {
  return Error{ErrorCode::invalid_argument, "this program was built without Boost, which serves the page"};
}

#endif

}  // namespace fbvins::app
