// SPDX-License-Identifier: Apache-2.0
// The page, embedded in the program when it was built (cmake/FbvinsPage.cmake).
#pragma once

#include "fbvins/web/web_server.hpp"

namespace fbvins {

/// Empty where npm, which has the page's libraries, was not there or not reached.
PageFiles page_files();

}  // namespace fbvins
