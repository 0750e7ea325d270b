// Texts get into HTML escaped, or not at all.

#include "harness/report/html.h"

#include <gtest/gtest.h>

#include <concepts>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace dexcheck::testing::html_test {
namespace {

// Texts are no markup: what forgets to escape them does not compile.
template <typename Text>
concept IsAppendable = requires(Html html, Text text) {
  html += text;
};
static_assert(!std::convertible_to<std::string, Html>);
static_assert(!std::convertible_to<std::string_view, Html>);
static_assert(!IsAppendable<std::string>);
static_assert(!IsAppendable<std::string_view>);
static_assert(IsAppendable<Html>);

TEST(Html, EscapesTextsOfEveryType) {
  const std::string text = "<b> & \"it's\"";
  const std::string escaped = "&lt;b&gt; &amp; &quot;it&#39;s&quot;";
  EXPECT_EQ(Html::Text(text).markup(), escaped);
  EXPECT_EQ(FormatHtml("<i>{}</i>", text).markup(), "<i>" + escaped + "</i>");
  EXPECT_EQ(FormatHtml("{}", std::string_view(text)).markup(), escaped);
  EXPECT_EQ(FormatHtml("{}", text.c_str()).markup(), escaped);
  EXPECT_EQ(FormatHtml("{}", "<b>").markup(), "&lt;b&gt;") << "a literal argument too is text";
}

TEST(Html, LeavesNumbersAndMarkupAsTheyAre) {
  EXPECT_EQ(FormatHtml("{:.2f} {} {}", 0.125, 7, size_t{8}).markup(), "0.12 7 8");
  EXPECT_EQ(FormatHtml("{}", FormatHtml("<b>{}</b>", "<")).markup(), "<b>&lt;</b>");
  Html html("<p>");
  html += Html::Raw("<br>");
  html += "</p>";
  EXPECT_EQ(html.markup(), "<p><br></p>");
}

TEST(Html, DataCannotEndItsElement) {
  const std::string text = "</script><!--\xff";
  const std::string element = EmbedJson("data", {{"name", text}}).markup();
  EXPECT_EQ(element.find('<', 1), element.rfind("</script>"));
  const size_t begin = element.find('>') + 1;
  EXPECT_EQ(nlohmann::json::parse(element.substr(begin, element.rfind("</script>") - begin)).at("name"),
            "</script><!--\uFFFD");
}

TEST(Html, FractionsOfABoundAreNoPowersOfTen) {
  EXPECT_EQ(FormatFraction(0.0), "0");
  EXPECT_EQ(FormatFraction(5e-5), "< 0.01 %");
  EXPECT_EQ(FormatFraction(0.0669), "6.7 %");
  EXPECT_EQ(FormatFraction(0.984), "98 %");
  EXPECT_EQ(FormatFraction(0.997), "99.7 %") << "not yet the whole bound";
  EXPECT_EQ(FormatFraction(1.0), "100 %");
  EXPECT_EQ(FormatFraction(1.5), "150 %");
  EXPECT_EQ(FormatFraction(25.0), "25 ×");
}

}  // namespace
}  // namespace dexcheck::testing::html_test
