// SPDX-License-Identifier: Apache-2.0
#include "fbvins/page/page.hpp"

#include <gtest/gtest.h>

#include "fbvins/page/curves.hpp"

namespace fbvins {
namespace page_test {

TEST(Page, HoldsDataAndScriptAndFetchesNothing) {
  const std::string html = plot_page("t", R"({"title":"t"})", "drawn();\n");
  EXPECT_NE(html.find("<script type=\"application/json\" id=\"data\">{\"title\":\"t\"}</script>"), std::string::npos);
  EXPECT_LT(html.find("class TimeChart"), html.find("drawn();"));
  for (const char* sign : {"src=", "href=", "@import", "fetch(", "<!--DATA", "<!--SCRIPT", "<!--STYLE", "<!--TITLE"})
    EXPECT_EQ(html.find(sign), std::string::npos) << sign;
}

TEST(Page, ValuesEndNeitherTitleNorScript) {
  const std::string html = plot_page("<b>&", R"({"title":"</script>"})", "");
  EXPECT_NE(html.find("<title>&lt;b>&amp;</title>"), std::string::npos);
  EXPECT_NE(html.find(R"({"title":"<\/script>"})"), std::string::npos);
}

TEST(Curves, AreDecimatedAndHaveNoNumbersForWhatIsNone) {
  Curves curves(4, 2);
  curves.add("y", std::vector<double>{1, 2, NAN, 4});
  EXPECT_EQ(curves.text(), R"({"y":[1,null]})");
}

}  // namespace page_test
}  // namespace fbvins
