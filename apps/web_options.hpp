// SPDX-License-Identifier: Apache-2.0
// Where a page is served, and who may see it. In programs that are built with Boost.
#pragma once

#include <string>

#include "fbvins/web/web_server.hpp"

namespace fbvins::app {

/// For the page at `where`, [ADDRESS:]PORT. The token is random, unless FBVINS_WEB_TOKEN is set. An error where the program was
/// built without its page.
Result<WebOptions> web_options(const std::string& where);

}  // namespace fbvins::app
