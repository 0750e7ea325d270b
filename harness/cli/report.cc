#include "harness/cli/report.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>

namespace dexcheck::cli {
namespace {

/// Prints a verdict, its causes with their numbers, and its remarks, wrapped.
void PrintAnswer(const Answer& answer) {
  constexpr size_t kMostShown = 30;
  const std::string line = Wrap(answer.word + ": " + answer.sentence, 2);
  fmt::print("{}{}\n", Paint(answer.tone, answer.word), line.substr(answer.word.size()));
  for (size_t i = 0; i < std::min(answer.causes.size(), kMostShown); ++i)
    fmt::print("{}\n", Wrap(fmt::format("  {}. {}", i + 1, answer.causes[i]), 5));
  if (answer.causes.size() > kMostShown)
    fmt::print("  and {} more (--json)\n", answer.causes.size() - kMostShown);
  for (const std::string& remark : answer.remarks) fmt::print("{}\n", Wrap("  " + remark, 5));
}

/// Most control characters cannot stand in XML at all.
std::string Plain(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 && c != '\n') c = '?';
  }
  return text;
}

/// An element of text alone, with the first line of `message` as its attribute.
void AddText(const char* name, const std::string& text, bool has_message, tinyxml2::XMLPrinter* xml) {
  if (text.empty()) return;
  xml->OpenElement(name);
  if (has_message) xml->PushAttribute("message", Plain(text.substr(0, text.find('\n'))).c_str());
  xml->PushText(Plain(text).c_str());
  xml->CloseElement();
}

/// The cases as a JUnit XML document, which servers of continuous integration read.
std::string WriteJUnit(const Report& report) {
  const auto failures =
      std::ranges::count_if(report.cases, [](const JUnitCase& test) { return !test.failure.empty(); });
  const bool has_error = !report.failure.empty();
  const std::string suite = Plain("dexcheck." + report.suite);
  tinyxml2::XMLPrinter xml;
  xml.PushHeader(/*writeBOM=*/false, /*writeDeclaration=*/true);
  for (const bool is_suite : {false, true}) {
    xml.OpenElement(is_suite ? "testsuite" : "testsuites");
    if (is_suite) xml.PushAttribute("name", suite.c_str());
    xml.PushAttribute("tests", std::to_string(report.cases.size() + (has_error ? 1 : 0)).c_str());
    xml.PushAttribute("failures", std::to_string(failures).c_str());
    xml.PushAttribute("errors", has_error ? 1 : 0);
    xml.PushAttribute("time", fmt::format("{:.3f}", report.seconds).c_str());
  }
  const auto add = [&](const JUnitCase& test, const std::string& error) {
    xml.OpenElement("testcase");
    xml.PushAttribute("classname", Plain(suite + "." + test.group).c_str());
    xml.PushAttribute("name", Plain(test.name).c_str());
    AddText("failure", test.failure, true, &xml);
    AddText(test.output.starts_with("not reached") ? "skipped" : "system-out", test.output, false, &xml);
    AddText("error", error, true, &xml);
    xml.CloseElement();
  };
  for (const JUnitCase& test : report.cases) add(test, "");
  if (has_error) add({"command", "ends"}, report.failure);
  xml.CloseElement();
  xml.CloseElement();
  return std::string(xml.CStr()) + "\n";
}

}  // namespace

void Report::AddTable(std::string_view align, const std::vector<TableRow>& rows) {
  std::vector<size_t> widths(align.size(), 0);
  for (const TableRow& row : rows) {
    for (size_t i = 0; i < row.cells.size(); ++i) widths[i] = std::max(widths[i], row.cells[i].size());
  }
  for (const TableRow& row : rows) {
    std::string line;
    for (size_t i = 0; i < row.cells.size(); ++i) {
      const std::string gap(widths[i] - row.cells[i].size(), ' ');
      line += (i == 0 ? "" : "  ") + (align[i] == '<' ? row.cells[i] + gap : gap + row.cells[i]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    if (!row.cells.empty() || row.note.empty()) details += line + "\n";
    if (!row.note.empty()) Add(row.note, 6);
  }
}

void Report::AddCase(const std::string& group, const CheckRecord& record, const std::string& where) {
  JUnitCase& test = cases.emplace_back(JUnitCase{group, record.name});
  (record.failed ? test.failure : test.output) =
      DescribeNumbers(record) + (where.empty() ? "" : ", " + where);
}

void Report::SetIncomplete(long done, long total, const std::string& what) {
  answer.remarks.push_back(fmt::format("interrupted: only {} of {} {}", done, total, what));
  failure = fmt::format("only {} of {} {}", done, total, what);
}

ReportOutput::ReportOutput(const Outputs& outputs)
    : quiet_(outputs.quiet),
      json_(outputs.json_file),
      junit_(outputs.junit_file),
      page_(RequirePageName(outputs.page_file)) {}

ExitCode ReportOutput::Write(const Report& report, bool is_printed) {
  is_printed = is_printed && prints();
  if (json_.exists()) json_.Write(report.data);
  junit_.Write([&] { return WriteJUnit(report); });
  page_.Write(report.page);
  if (is_printed) {
    if (!report.answer.word.empty()) PrintAnswer(report.answer);
    if (!quiet_) fmt::print("{}", report.details);
    fmt::print("{}", report.last);
  }
  if (report.code == kDisagreement || report.failure.empty()) return report.code;
  return ReportFailure(report.failure);
}

}  // namespace dexcheck::cli
