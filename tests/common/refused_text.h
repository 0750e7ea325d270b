#pragma once

// A text with one thing changed must be refused in one line that names what is wrong: the one such test.
//
//   class BadArms : public ::testing::TestWithParam<RefusedText> {};
//   TEST_P(BadArms, AreRefused) {
//     EXPECT_TRUE(IsRefused(kArm, GetParam(), [](const std::string& text) { ParseArm(text, "arm.toml"); }));
//   }
//   INSTANTIATE_TEST_SUITE_P(All, BadArms, ::testing::ValuesIn(std::vector<RefusedText>{
//       {"NegativeMass", {{"mass = 2", "mass = -2"}}, {"arm.toml:3:", "upper.mass", "-2"}}}), CaseName());

#include <gtest/gtest.h>

#include <exception>
#include <ostream>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "tests/common/files.h"

namespace dexcheck::testing {

/// Names the instances of a parameterised test by their member `name`.
struct CaseName {
  template <typename Info>
  std::string operator()(const Info& info) const {
    return info.param.name;
  }
};

/// Changes of a text, and what the line that refuses it must name: file and line, key, value.
struct RefusedText {
  std::string name;
  std::vector<Edit> edits;
  std::vector<std::string> parts;
};
/// One place changed, and what the line says of it.
inline RefusedText OneEdit(const std::string& name, const std::string& from, const std::string& to,
                           const std::string& part) {
  return {name, {{from, to}}, {part}};
}

inline void PrintTo(const RefusedText& refused, std::ostream* out) { *out << refused.name; }

/// Success when the text is one line, whether its end is there or not, that contains all of the parts.
inline ::testing::AssertionResult IsOneLineWith(const std::string& text,
                                                const std::vector<std::string>& parts) {
  if (text.find('\n') < text.size() - 1) return ::testing::AssertionFailure() << "not one line: " << text;
  for (const std::string& part : parts) {
    if (text.find(part) == std::string::npos)
      return ::testing::AssertionFailure() << "\"" << part << "\" is missing in: " << text;
  }
  return ::testing::AssertionSuccess();
}

/// Success when `read()` throws an InputError in one line that contains all of the parts.
template <typename Read>
::testing::AssertionResult IsRefused(const Read& read, const std::vector<std::string>& parts) {
  try {
    static_cast<void>(read());
  } catch (const InputError& error) {
    return IsOneLineWith(error.what(), parts);
  } catch (const std::exception& error) {
    return ::testing::AssertionFailure() << "another error: " << error.what();
  }
  return ::testing::AssertionFailure() << "accepted";
}

/// Success when `read(text)` refuses the text so changed.
template <typename Read>
::testing::AssertionResult IsRefused(const std::string& text, const RefusedText& refused, const Read& read) {
  const std::string changed = ApplyEdits(text, refused.edits);
  return IsRefused([&] { static_cast<void>(read(changed)); }, refused.parts);
}

}  // namespace dexcheck::testing
