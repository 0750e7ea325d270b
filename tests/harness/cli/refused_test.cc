// The table refused.toml: input that cannot be used is refused in one line that names file, key and value,
// and no file is written or harmed.

#include <toml++/toml.h>

#include <map>
#include <sstream>

#include "tests/common/refused_text.h"
#include "tests/harness/cli/dexcheck_program.h"

namespace dexcheck::testing::refused_test {
namespace {

namespace fs = std::filesystem;

std::string ReplaceAll(std::string text, const std::string& from, const std::string& to) {
  for (size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

std::string GetText(const toml::table& row, const char* key) { return row[key].value_or(std::string()); }

std::vector<std::string> GetTexts(const toml::table& row, const char* key) {
  std::vector<std::string> texts;
  if (const toml::array* list = row[key].as_array()) {
    for (const toml::node& text : *list) texts.push_back(text.value_or(std::string()));
  }
  return texts;
}

/// Returns the text of a file with a row's changes.
std::string ChangeText(std::string text, const toml::table& row) {
  const std::vector<std::string> change = GetTexts(row, "change");
  for (size_t i = 0; i + 1 < change.size(); i += 2) text = ReplaceOnce(text, change[i], change[i + 1]);
  return row.contains("text") ? GetText(row, "text") : text;
}

/// A program that answers one line each with these lines, and then does what the row says.
Words MakeProgram(const toml::table& row) {
  if (!row.contains("answers") && !row.contains("program")) return Words(std::vector<std::string>());
  std::string program;
  for (const std::string& answer : GetTexts(row, "answers")) program += "read a; echo '" + answer + "'; ";
  return {"--program", program + row["program"].value_or(std::string("read a"))};
}

class RefusedFolder : public CommandTest {
 protected:
  RefusedFolder() {
    for (const fs::directory_entry& file : fs::directory_iterator(SourcePath("/tests/harness/cli/files")))
      Copy(file.path().filename());
    for (const char* folder : {"folder.toml", "folder.xml"}) fs::create_directory(Path(folder));
    for (const char* file : {"out.json", "state.json"}) Write(file, "what stood here before");
    Write("scene.sdf", "<sdf/>");
    Write("whole.xml", R"(<mujoco><include file="two.xml"/></mujoco>)");
    fs::create_symlink("pair.xml", Path("link.xml"));
    fs::create_hard_link(Path("pair.xml"), Path("hard.xml"));
  }

  /// All files of the folder and what is in them.
  [[nodiscard]] std::map<std::string, std::string> ReadAll() const {
    std::map<std::string, std::string> files;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_.path())) {
      const std::string name = fs::relative(entry.path(), folder_.path());
      files[name] = entry.is_directory() ? "" : ReadText(entry.path());
    }
    return files;
  }

  /// Runs one case of a group.
  void Try(const toml::table& group, const toml::table& row) {
    const std::string words =
        ReplaceAll(GetText(group, "run") + " " + GetText(row, "run"), "$SOURCE", SourcePath());
    std::ostringstream shown;
    shown << words << "   " << row;
    SCOPED_TRACE(shown.str());
    const std::string file = row.contains("in") ? GetText(row, "in") : GetText(group, "in");
    const std::string before = file.empty() ? "" : Read(file);
    if (!file.empty()) Write(file, ChangeText(before, row));
    const std::map<std::string, std::string> files = ReadAll();
    ProgramResult result = Run(Words(words) + MakeProgram(row));
    EXPECT_EQ(result.exit_code, row["exit"].value_or(2));
    if (row.contains("exit")) result.exit_code = 2;  // the rest is the same
    EXPECT_TRUE(IsRefused(result, GetTexts(row, "names")));
    const std::map<std::string, std::string> after = ReadAll();
    EXPECT_EQ(after.size(), files.size()) << "files were written or removed";
    for (const auto& [name, text] : after)
      EXPECT_TRUE(files.contains(name) && files.at(name) == text) << name << " was written";
    if (!file.empty()) Write(file, before);
  }
};

constexpr const char* kGroups[] = {
    "CommandLine", "RunsOptions", "ParameterFiles", "Mjcfs",    "Descriptions", "Programs",
    "States",      "Grasps",      "JointMotions",   "Logs",     "Pictures",     "Recordings",
    "Outputs",     "Scenarios",   "Studies",        "Searches", "Databases",    "Kinds"};

class Refused : public RefusedFolder, public ::testing::WithParamInterface<const char*> {};

TEST_P(Refused, InOneLineThatNamesWhatIsWrong) {
  const toml::table table = toml::parse_file(SourcePath("/tests/harness/cli/refused.toml"));
  size_t tried = 0;
  // A group that no name below leads to would never be tried.
  EXPECT_EQ(table["group"].as_array()->size(), std::size(kGroups));
  for (const toml::node& node : *table["group"].as_array()) {
    const toml::table& group = *node.as_table();
    if (GetText(group, "name") != GetParam()) continue;
    for (const std::string& command : GetTexts(group, "prepare")) Expect(0, command);
    for (const toml::node& row : *group["cases"].as_array()) {
      Try(group, *row.as_table());
      ++tried;
    }
  }
  EXPECT_GE(tried, 10U);
}

INSTANTIATE_TEST_SUITE_P(All, Refused, ::testing::ValuesIn(kGroups),
                         [](const auto& info) { return std::string(info.param); });

// The unchanged files are good.
TEST_F(RefusedFolder, GoodFilesAreAccepted) {
  Expect(0, "consistency two.toml two.xml --samples 5 --json out.json");
  EXPECT_EQ(ReadJson("out.json").at("verdict"), "pass");
  Expect(0, "consistency pair.urdf pair.xml --samples 5");
  Expect(0, "eval --state grasp.json");
  Expect(0, "import arm.xml --out arm.toml");
  Expect(0, "run own.toml --no-log --set duration=0.02");
}

TEST_F(RefusedFolder, StatesThatNoTableHolds) {
  for (const auto& [text, part] :
       {std::pair(std::string(500000, '[') + std::string(500000, ']'), "more than 32 brackets"),
        {R"({"q": ")" + std::string(5000, 'x') + R"(", "xi": [0, 1]})", "xxx..."}}) {
    Write("state.json", text);
    EXPECT_TRUE(Refused("eval two.toml --state state.json", {"state.json: ", part}));
  }
}

TEST_F(RefusedFolder, AnObjectThatNoFingertipsTouch) {
  Write("two.toml",
        Read("two.toml") +
            "[object]\nbody = \"ball\"\nshape = \"sphere\"\nradius = 0.1\nmass = 0.2\nfriction = 0.5\n");
  Write("state.json", R"({"q": [0, 1], "xi": [0, 1], "kappa": [[0, 0, 0, 0, 0]]})");
  EXPECT_TRUE(Refused("eval two.toml --state state.json", {"state.json: ", "0 fingertips", "3"}));
}

TEST_F(RefusedFolder, AMobileBaseWithoutAFreeJoint) {
  fs::copy(kMjcf, Path("mjcf"), fs::copy_options::recursive);
  WriteChanged("mjcf/robot.xml", Read("mjcf/robot.xml"), "<freejoint name=\"base\"/>", "");
  Write("mjcf/bare.xml", "<mujoco><include file=\"robot.xml\"/><include file=\"torus.xml\"/></mujoco>");
  EXPECT_TRUE(Refused({"consistency", kParameters + "assistant_robot.toml", "mjcf/bare.xml"},
                      {"mjcf/bare.xml: body \"platform\"", "free joint"}));
}

TEST_F(RefusedFolder, AnotherReleaseOfMujocoAndAFaultOfTheProgram) {
  ProgramOptions options;
  options.environment = {{"LD_PRELOAD", BuildPath("/tests/libother_mujoco_version.so")}};
  EXPECT_TRUE(IsRefused(Run("consistency --samples 1", options), {"libmujoco", "2.2.2", "2.3.1"}));
  options.environment.emplace_back("TEST_MISTAKE", "1");
  const ProgramResult result = Expect(3, "consistency --samples 1", options);
  EXPECT_TRUE(IsOneLineWith(result.err, {"dexcheck: internal error: ", "size", "-1"}));
}

}  // namespace
}  // namespace dexcheck::testing::refused_test
