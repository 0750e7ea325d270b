// Data in pages, and fewer points of a series, with its extremes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "harness/report/page_frame.h"
#include "tests/common/matchers.h"

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

VectorXd MakeTimes(long rows) { return VectorXd::LinSpaced(rows, 0.0, static_cast<double>(rows - 1)); }

TEST(Thinning, KeepsAllRowsThatFit) {
  const VectorXd time = MakeTimes(10);
  const Thinning thinning(time, 10);
  EXPECT_TRUE(thinning.keeps_all());
  EXPECT_THAT(thinning.times(), ::testing::ElementsAreArray(time));
  EXPECT_THAT(thinning.Apply(time.array().square()),
              ::testing::ElementsAreArray(VectorXd(time.array().square())));
}

TEST(Thinning, KeepsExtremesInTheOrderInWhichTheyOccur) {
  VectorXd values(8);
  values << 1, 5, -3, 2, 0, 0, 7, -1;
  const Thinning thinning(MakeTimes(8), 4);
  EXPECT_THAT(thinning.times(), ElementsAre(0, 3, 4, 7));
  EXPECT_THAT(thinning.Apply(values), ElementsAre(5, -3, 7, -1));
}

TEST(Thinning, LosesNoSpikeOfALongSeries) {
  constexpr long kRows = 100003;
  const VectorXd time = MakeTimes(kRows);
  VectorXd values = (1e-3 * time.array()).sin();
  values[77777] = 40.0;
  values[5] = -30.0;
  const Thinning thinning(time, 500);
  const std::vector<double> kept = thinning.Apply(values);
  EXPECT_FALSE(thinning.keeps_all());
  ASSERT_EQ(kept.size(), thinning.times().size());
  EXPECT_LE(kept.size(), 500U);
  EXPECT_GE(kept.size(), 490U);
  EXPECT_EQ(*std::ranges::max_element(kept), 40.0);
  EXPECT_EQ(*std::ranges::min_element(kept), -30.0);
  EXPECT_TRUE(std::ranges::is_sorted(thinning.times()));
  EXPECT_EQ(thinning.times().front(), 0.0);
  EXPECT_EQ(thinning.times().back(), time[kRows - 1]);
}

TEST(Thinning, KeepsAMonotonicLineExactly) {
  const VectorXd time = MakeTimes(1000);
  const Thinning thinning(time, 100);
  EXPECT_EQ(thinning.Apply(time), thinning.times());
}

TEST(Thinning, LeavesOutWhatIsNotANumberUnlessThereIsNothingElse) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  VectorXd values(8);
  values << nan, 5, 4, nan, nan, nan, nan, std::numeric_limits<double>::infinity();
  const std::vector<double> kept = Thinning(MakeTimes(8), 4).Apply(values);
  ASSERT_EQ(kept.size(), 4U);
  EXPECT_EQ(kept[0], 5);
  EXPECT_EQ(kept[1], 4);
  EXPECT_TRUE(std::isnan(kept[2]) && std::isnan(kept[3]));
}

}  // namespace
}  // namespace dexcheck::testing::page_text_test
