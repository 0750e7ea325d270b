// Values set in place of a file's.

#include <gtest/gtest.h>

#include "controller/common/errors.h"
#include "controller/common/toml_reader.h"
#include "tests/common/throws.h"

namespace dexcheck::testing::toml_override_test {
namespace {

const char* const kText = R"(size = 1
name = "a"
list = [10, 20]
[part]
mass = 2
)";

TEST(TomlOverride, ReplacesAddsAndReachesIntoLists) {
  TomlDocument document(kText, "file.toml");
  document.Override("size=3.5");
  document.Override("part.mass=4");
  document.Override("part.color=dark red");
  document.Override("list.1=21");
  document.Override("new.table.flag=true");
  document.Override("count=7");
  TomlTable root = document.Open();
  EXPECT_EQ(root.Get("size").AsNumber(), 3.5);
  EXPECT_EQ(root.Get("name").AsText(), "a");
  EXPECT_EQ(root.Get("list").AsVector<2>(), Vector2d(10.0, 21.0));
  EXPECT_EQ(root.Get("list").AsVectorOrNumber<2>(), Vector2d(10.0, 21.0));
  EXPECT_EQ(root.Get("size").AsVectorOrNumber<2>(), Vector2d(3.5, 3.5));
  TomlTable part = root.Get("part").AsTable();
  EXPECT_EQ(part.Get("mass").AsNumber(), 4.0);
  EXPECT_EQ(part.Get("color").AsText(), "dark red");
  EXPECT_TRUE(root.Get("new").AsTable().Get("table").AsTable().Get("flag").AsFlag());
  EXPECT_EQ(root.Get("count").AsWhole(0, 7), 7);
}

std::string TakeMessage(const std::string& assignment, const std::string& key = "") {
  return MessageOf<InputError>([&] {
    TomlDocument document(kText, "file.toml");
    document.Override(assignment);
    TomlTable root = document.Open();
    if (!key.empty()) (void)root.Get(key).AsWhole(0, 5);
  });
}

TEST(TomlOverride, WholeNumbersWithoutAnEqualDoubleAreRounded) {
  TomlDocument document(kText, "file.toml");
  document.Override("size=9007199254740993");  // 2^53 + 1
  EXPECT_EQ(document.Open().Get("size").AsNumber(), 9007199254740992.0);
}

TEST(TomlOverride, SaysWhereAValueComesFrom) {
  EXPECT_EQ(TakeMessage("size=9", "size"), "--set size=9: size: must be a whole number from 0 to 5, got 9");
  EXPECT_EQ(TakeMessage("name=b", "size"), "accepted");
}

TEST(TomlOverride, RefusesWhatCannotBeSet) {
  EXPECT_EQ(TakeMessage("size"), "--set size: must be PATH=VALUE");
  EXPECT_EQ(TakeMessage("a..b=1"), "--set a..b=1: its path has an empty part");
  EXPECT_EQ(TakeMessage("size.x=1"), R"(--set size.x=1: "size" is no table or list)");
  EXPECT_EQ(TakeMessage("list.2=1"), R"(--set list.2=1: "2" is no entry of a list of 2)");
  EXPECT_EQ(TakeMessage("list.x=1"), R"(--set list.x=1: "x" is no entry of a list of 2)");
  // A line break cannot smuggle in another key.
  EXPECT_EQ(TakeMessage("name=1\nsize=2", "size"), "accepted");
}

}  // namespace
}  // namespace dexcheck::testing::toml_override_test
