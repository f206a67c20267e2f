// SPDX-License-Identifier: Apache-2.0
// The report's page (report_page.html), with the marks <!--TITLE--> and <!--DATA--> where contents go.
#pragma once

#include <string>

namespace fbvins {

std::string report_page();

}  // namespace fbvins
