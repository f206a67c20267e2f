// SPDX-License-Identifier: Apache-2.0
// The page, embedded in the program when it was built (cmake/FbvinsPage.cmake).
#pragma once

#include "fbvins/web/web_server.hpp"

namespace fbvins {

/// Empty where npm, from which the page's libraries come, was missing or could not reach its registry.
PageFiles page_files();

}  // namespace fbvins
