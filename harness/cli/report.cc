#include "harness/cli/report.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <tinyxml2.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <utility>

#include "controller/common/errors.h"
#include "harness/base/interrupts.h"

namespace dexcheck::cli {

namespace {

bool TakesColors() {
  static const bool takes = [] {
    const char* const no_color = std::getenv("NO_COLOR");
    const char* const term = std::getenv("TERM");
    return ::isatty(STDOUT_FILENO) != 0 && (no_color == nullptr || *no_color == '\0') && term != nullptr &&
           std::string_view(term) != "dumb";
  }();
  return takes;
}

constexpr int kUsualColumns = 80;  // of a terminal that does not report them
constexpr int kWidestBar = 40;
constexpr int kNarrowestBar = 8;
constexpr std::chrono::milliseconds kRedrawEvery(100);
// The time left is not estimated before: the first steps touch memory for the first time.
constexpr double kLeastElapsed = 0.5;  // s

}  // namespace

int CountColumns(int descriptor) {
  winsize size{};
  return ::ioctl(descriptor, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

std::string Wrap(std::string_view text, size_t indent) {
  std::string wrapped;
  size_t column = 0;
  while (true) {
    const size_t begin = text.find_first_not_of(" \n");
    if (begin == std::string_view::npos) return wrapped;
    const std::string_view gap = text.substr(0, begin);
    const std::string_view word = text.substr(begin, text.find_first_of(" \n", begin) - begin);
    text.remove_prefix(begin + word.size());
    if (gap.find('\n') != std::string_view::npos) {
      wrapped += gap;
      column = begin - gap.rfind('\n') - 1;
    } else if (column > indent && column + begin + word.size() > kColumns) {
      wrapped += "\n" + std::string(indent, ' ');
      column = indent;
    } else {
      wrapped += gap;
      column += begin;
    }
    wrapped += word;
    column += word.size();
  }
}

std::string Paint(Tone tone, std::string_view text) {
  if (!TakesColors()) return std::string(text);
  const char* const code = tone == Tone::kGood ? "32" : tone == Tone::kBad ? "1;31" : "2";
  return "\033[" + std::string(code) + "m" + std::string(text) + "\033[0m";
}

ProgressBar::ProgressBar(std::string label, long total, bool quiet)
    : label_(std::move(label)), total_(total), visible_(!quiet && ::isatty(STDERR_FILENO) != 0) {}

std::string ProgressBar::MakeLine(long done, Clock::time_point now) const {
  const int reported = CountColumns(STDERR_FILENO);
  // The last column stays free: some terminals wrap when it is written.
  const int columns = (reported > 0 ? reported : kUsualColumns) - 1;
  if (total_ <= 0)
    return fmt::format("{}: {}", label_, done).substr(0, static_cast<size_t>(std::max(columns, 0)));
  const double fraction = std::clamp(static_cast<double>(done) / static_cast<double>(total_), 0.0, 1.0);
  const double elapsed = std::chrono::duration<double>(now - *first_time_).count();
  std::string end = fmt::format(" {:3.0f} %", 100.0 * fraction);
  const std::string count = fmt::format(" ({} of {})", done, total_);
  std::string left;
  if (elapsed >= kLeastElapsed && done > first_done_) {
    const double rate = static_cast<double>(done - first_done_) / elapsed;
    left = fmt::format(", {:.0f} s left", static_cast<double>(total_ - done) / rate);
  }
  // The least important goes first: the count, then the label's end, then the bar.
  const auto room = [&](size_t used) { return columns - static_cast<int>(used) - 3; };  // " [" and "]"
  std::string label = label_;
  if (room(label.size() + end.size() + count.size() + left.size()) >= kNarrowestBar) end += count;
  end += left;
  if (room(label.size() + end.size()) < kNarrowestBar) {
    const int shorter = static_cast<int>(label.size()) + room(label.size() + end.size()) - kNarrowestBar;
    label.resize(static_cast<size_t>(std::max(shorter, 0)));
  }
  const int width = std::min(room(label.size() + end.size()), kWidestBar);
  if (width < kNarrowestBar) return end.substr(0, static_cast<size_t>(std::max(columns, 0)));
  const int filled = static_cast<int>(fraction * width);
  return fmt::format("{} [{}{}]{}", label, std::string(static_cast<size_t>(filled), '#'),
                     std::string(static_cast<size_t>(width - filled), '.'), end);
}

void ProgressBar::Update(long done) {
  if (!visible_) return;
  const Clock::time_point now = Clock::now();
  if (!first_time_) {
    first_time_ = now;
    first_done_ = done;
  }
  if (drawn_ && now - last_drawn_ < kRedrawEvery) return;
  last_drawn_ = now;
  drawn_ = true;
  // Without the rest of an earlier, longer line.
  std::fputs(("\r" + MakeLine(done, now) + "\033[K").c_str(), stderr);  // gone: it does not matter
  std::fflush(stderr);
}

bool ProgressBar::GoOn(long done) {
  Update(done);
  return !IsInterrupted();
}

void ProgressBar::Finish() {
  if (!drawn_) return;
  drawn_ = false;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
}

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
  const std::string page = page_.exists() ? "page: " + page_.path().string() + "\n" : "";
  if (json_.exists()) json_.Write(report.data);
  junit_.Write([&] { return WriteJUnit(report); });
  page_.Write(report.page);
  if (is_printed) {
    if (!report.answer.word.empty()) PrintAnswer(report.answer);
    if (!quiet_) fmt::print("{}", report.details);
    fmt::print("{}{}", report.last, page);
  }
  if (report.code == kDisagreement || report.failure.empty()) return report.code;
  return ReportFailure(report.failure);
}

}  // namespace dexcheck::cli
