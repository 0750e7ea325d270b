// Data in pages, and numbers as pages show them.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "harness/report/page_frame.h"

namespace dexcheck::testing::page_text_test {
namespace {

TEST(PageText, DataCannotEndItsElement) {
  const std::string text = "</script><!--\xff";
  const std::string element = EmbedJson("data", {{"name", text}});
  EXPECT_EQ(element.find('<', 1), element.rfind("</script>"));
  const size_t begin = element.find('>') + 1;
  EXPECT_EQ(nlohmann::json::parse(element.substr(begin, element.rfind("</script>") - begin)).at("name"),
            "</script><!--\uFFFD");
}

TEST(PageText, Base64HasTheVectorsOfRfc4648) {
  EXPECT_EQ(EncodeBase64(""), "");
  EXPECT_EQ(EncodeBase64("f"), "Zg==");
  EXPECT_EQ(EncodeBase64("fo"), "Zm8=");
  EXPECT_EQ(EncodeBase64("foo"), "Zm9v");
  EXPECT_EQ(EncodeBase64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(EncodeBase64("\xff\xfe"), "//4=");
}

TEST(PageText, FractionsOfABoundAreNoPowersOfTen) {
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
}  // namespace dexcheck::testing::page_text_test
