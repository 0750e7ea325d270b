#include "harness/cli/output_file.h"

#include <fmt/format.h>
#include <tinyxml2.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <system_error>
#include <utility>

#include "controller/common/errors.h"

namespace dexcheck::cli {

OutputFile::OutputFile(const std::filesystem::path& path) : path_(path) {
  if (path.empty()) return;
  if (path == "-") {
    file_ = stdout;
    return;
  }
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(path, ignored);
  const bool in_place = std::filesystem::is_other(status);
  if (!in_place) partial_.emplace(path);
  file_ = std::fopen(in_place ? path.c_str() : partial_->partial().c_str(), "wb");
  if (file_ == nullptr) Fail(errno);
}

OutputFile::~OutputFile() {
  if (exists() && !is_stdout()) std::fclose(file_);
}

void OutputFile::Append(const std::string& text) {
  if (exists() && std::fwrite(text.data(), 1, text.size(), file_) != text.size()) Fail(errno);
}

void OutputFile::Finish() {
  if (exists() && std::fflush(file_) != 0) Fail(errno);
  if (!exists() || is_stdout()) return;
  if (partial_ && ::fsync(::fileno(file_)) != 0) Fail(errno);
  const int closed = std::fclose(std::exchange(file_, nullptr));
  if (closed != 0) Fail(errno);
  if (partial_) partial_->Commit();
}

void OutputFile::Fail(int error) const {
  const std::string name = path_ == "-" ? "standard output" : path_.string();
  throw InputError(name + ": cannot be written: " + std::strerror(error));
}

const std::filesystem::path& RequirePageName(const std::filesystem::path& path) {
  const std::string extension = ExtensionOf(path);
  const bool is_page = extension.empty() || extension == ".html" || extension == ".htm";
  if (is_page || IsFolder(path)) return path;  // a folder is refused as such
  throw InputError(path.string() + ": cannot be written: a page's name must end in .html");
}

namespace {

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

}  // namespace

JUnitCase MakeJUnitCase(const std::string& group, const CheckRecord& record, const std::string& where) {
  JUnitCase test{group, record.name, "", ""};
  const std::string numbers = DescribeNumbers(record) + (where.empty() ? "" : ", " + where);
  (record.failed ? test.failure : test.output) = numbers;
  return test;
}

std::string WriteJUnit(const std::string& suite, const std::vector<JUnitCase>& cases, double seconds,
                       const std::string& error) {
  const auto failures =
      std::ranges::count_if(cases, [](const JUnitCase& test) { return !test.failure.empty(); });
  tinyxml2::XMLPrinter xml;
  xml.PushHeader(/*writeBOM=*/false, /*writeDeclaration=*/true);
  const auto open = [&](const char* name) {
    xml.OpenElement(name);
    if (std::string_view(name) == "testsuite") xml.PushAttribute("name", Plain(suite).c_str());
    xml.PushAttribute("tests", std::to_string(cases.size() + (error.empty() ? 0 : 1)).c_str());
    xml.PushAttribute("failures", std::to_string(failures).c_str());
    xml.PushAttribute("errors", error.empty() ? 0 : 1);
    xml.PushAttribute("time", fmt::format("{:.3f}", seconds).c_str());
  };
  const auto open_case = [&](const std::string& group, const std::string& name) {
    xml.OpenElement("testcase");
    xml.PushAttribute("classname", Plain(suite + "." + group).c_str());
    xml.PushAttribute("name", Plain(name).c_str());
  };
  open("testsuites");
  open("testsuite");
  for (const JUnitCase& test : cases) {
    open_case(test.group, test.name);
    AddText("failure", test.failure, true, &xml);
    AddText(test.output.starts_with("not reached") ? "skipped" : "system-out", test.output, false, &xml);
    xml.CloseElement();
  }
  if (!error.empty()) {
    open_case("command", "ends");
    AddText("error", error, true, &xml);
    xml.CloseElement();
  }
  xml.CloseElement();
  xml.CloseElement();
  return std::string(xml.CStr()) + "\n";
}

}  // namespace dexcheck::cli
