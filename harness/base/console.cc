#include "harness/base/console.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>
#include <vector>

#include "controller/common/errors.h"

namespace dexcheck {

void OccupyStandardStreams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) != -1 || errno != EBADF) continue;
    // The lowest free number is this one. Opened the wrong way round, so that using it fails.
    ::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

namespace {

/// Names that no file can have (4095 bytes are the most) and attributes of a megabyte, shortened.
std::string Shorten(const std::string& text) {
  constexpr size_t kHead = 400;
  constexpr size_t kTail = 100;
  constexpr size_t kMost = 4095;
  const auto shorten = [](const std::string& part) {
    return part.size() <= kMost ? part : part.substr(0, kHead) + "..." + part.substr(part.size() - kTail);
  };
  std::string shown;
  for (size_t start = 0; start < text.size();) {
    const size_t end = std::min(text.find(' ', start), text.size() - 1) + 1;
    shown += shorten(text.substr(start, end - start));
    start = end;
  }
  return shown.size() <= 2 * kMost ? shown
                                   : shown.substr(0, kMost) + "..." + shown.substr(shown.size() - kMost);
}

/// Folders, and what they are shown as.
using ShownFolders = std::vector<std::pair<std::string, std::string>>;

ShownFolders& AllShownFolders() {
  static ShownFolders folders;
  return folders;
}

std::string ShowFolders(std::string text) {
  for (const auto& [folder, name] : AllShownFolders()) {
    for (size_t at = text.find(folder); at != std::string::npos; at = text.find(folder, at + name.size()))
      text.replace(at, folder.size(), name);
  }
  return text;
}

}  // namespace

void ShowFolderAs(const std::string& folder, const std::string& name) {
  AllShownFolders().emplace_back(folder + "/", name + ": ");
}

void Warn(const std::string& text) {
  std::string line = "dexcheck: " + Shorten(ShowFolders(text));
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  line += '\n';
  std::fwrite(line.data(), 1, line.size(), stderr);
}

void FlushOutput() {
  const bool is_flushed = std::fflush(stdout) == 0;
  if (is_flushed && std::ferror(stdout) == 0) return;
  throw InputError(std::string("standard output: cannot be written: ") +
                   (is_flushed ? "a part of it was lost" : std::strerror(errno)));
}

std::string QuoteForShell(const std::string& text) {
  constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./,:@%";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace dexcheck
