#include "tests/common/files.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <system_error>

namespace dexcheck::testing {

TempFolder::TempFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "dexcheck-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make a folder like " + name);
  path_ = name;
}

TempFolder::~TempFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::string ReadText(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file.good()) << path;
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void WriteText(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  EXPECT_TRUE(file.good()) << path;
}

std::string ReplaceFirst(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << "not there: " << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string ReplaceOnce(const std::string& text, const std::string& from, const std::string& to) {
  EXPECT_EQ(text.find(from), text.rfind(from)) << "not unique: " << from;
  return ReplaceFirst(text, from, to);
}

std::string ApplyEdits(std::string text, const std::vector<Edit>& edits) {
  for (const Edit& edit : edits) text = ReplaceOnce(text, edit.from, edit.to);
  return text;
}

}  // namespace dexcheck::testing
