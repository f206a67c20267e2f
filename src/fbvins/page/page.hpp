// SPDX-License-Identifier: Apache-2.0
// Private: a page with plots as one self-contained HTML file: its script draws the numbers that it contains; it fetches nothing.
// Pure function, any thread.
//
//   std::string html = plot_page("MH_01", R"({"title":"MH_01","t":[0,1]})", script);
#pragma once

#include <string>

namespace fbvins {

/// `data`: JSON, the script's constant `data`, whose "title" the page shows; `script`: JavaScript, draws with charts.js.
std::string plot_page(const std::string& title, std::string data, const std::string& script);

}  // namespace fbvins
