#include "harness/cli/junit_file.h"

#include <fmt/format.h>

#include <algorithm>

namespace dexcheck::cli {
namespace {

/// As text or attribute of XML, in which most control characters cannot stand at all.
std::string Escape(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '&':
        escaped += "&amp;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\n':
        escaped += "&#10;";
        break;
      default:
        escaped += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
    }
  }
  return escaped;
}

}  // namespace

JUnitCase MakeJUnitCase(const std::string& group, const CheckRecord& record, const std::string& where) {
  JUnitCase test{group, record.name, "", ""};
  const std::string numbers = fmt::format("worst {:.3g}, bound {:.3g}{}{}", record.worst, record.bound,
                                          where.empty() ? "" : ", ", where);
  (record.failed ? test.failure : test.output) = numbers;
  return test;
}

std::string WriteJUnit(const std::string& suite, const std::vector<JUnitCase>& cases, double seconds,
                       const std::string& error) {
  const auto failures =
      std::count_if(cases.begin(), cases.end(), [](const JUnitCase& test) { return !test.failure.empty(); });
  const std::string counts =
      fmt::format("tests=\"{}\" failures=\"{}\" errors=\"{}\" time=\"{:.3f}\"",
                  cases.size() + (error.empty() ? 0 : 1), failures, error.empty() ? 0 : 1, seconds);
  std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  text += fmt::format("<testsuites {}>\n <testsuite name=\"{}\" {}>\n", counts, Escape(suite), counts);
  for (const JUnitCase& test : cases) {
    text += fmt::format("  <testcase classname=\"{}.{}\" name=\"{}\"", Escape(suite), Escape(test.group),
                        Escape(test.name));
    if (test.failure.empty() && test.output.empty()) {
      text += "/>\n";
      continue;
    }
    text += ">";
    if (!test.failure.empty()) {
      const std::string line = test.failure.substr(0, test.failure.find('\n'));
      text += fmt::format("<failure message=\"{}\">{}</failure>", Escape(line), Escape(test.failure));
    }
    if (!test.output.empty()) text += fmt::format("<system-out>{}</system-out>", Escape(test.output));
    text += "</testcase>\n";
  }
  if (!error.empty()) {
    text += fmt::format(
        "  <testcase classname=\"{0}.command\" name=\"ends\"><error message=\"{1}\">{1}</error></testcase>\n",
        Escape(suite), Escape(error));
  }
  return text + " </testsuite>\n</testsuites>\n";
}

}  // namespace dexcheck::cli
