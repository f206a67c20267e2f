// SPDX-License-Identifier: Apache-2.0
#include "fbvins/web/web_routes.hpp"

#include <algorithm>

namespace fbvins {
namespace {

WebAnswer stream(const WebRequest& request, const WebOptions& options, std::size_t viewers) {
  if (!options.token.empty() && !token_equal(token_of(request.target), options.token)) return {401, "wrong token\n"};
  if (!request.upgrades) return {426, "a WebSocket is required\n"};
  if (viewers >= options.most_viewers) return {503, "too many viewers\n"};
  return {101, ""};
}

}  // namespace

WebAnswer answer_to(const WebRequest& request, const WebOptions& options, const PageFiles& files, std::string_view machine,
                    std::size_t viewers) {
  if (!host_allowed(request.host, machine)) return {403, "wrong host\n"};
  if (!origin_allowed(request.origin, request.host)) return {403, "wrong origin\n"};
  const std::string_view path = request.target.substr(0, request.target.find('?'));
  if (path == "/stream") return stream(request, options, viewers);
  if (!request.reads) return {405, "only GET\n"};
  const std::string_view wanted = path == "/" ? "/index.html" : path;
  const auto file = std::find_if(files.begin(), files.end(), [&](const PageFile& f) { return f.path == wanted; });
  if (file == files.end()) return {404, "there is no such file\n"};
  return {200, file->bytes, file->type, file->gzip};
}

}  // namespace fbvins
