// SPDX-License-Identifier: Apache-2.0
// The report's page (report_page.html), with the placeholders <!--TITLE--> and <!--DATA-->.
#pragma once

#include <string>

namespace fbvins {

std::string report_page();

}  // namespace fbvins
