#include "harness/base/files.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/wait.h>

#include <array>
#include <atomic>
#include <climits>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <system_error>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/interrupts.h"

namespace dexcheck {
namespace {

/// One path. A handler may run at any time, so the path is complete before its owner is set.
struct Slot {
  std::atomic<bool> taken = false;
  std::atomic<pid_t> owner = 0;  // 0 while the path is not to be removed
  std::array<char, PATH_MAX> path = {};
};

/// A report has some thirty figures under way.
constexpr size_t kSlots = 128;
std::array<Slot, kSlots> slots;
std::atomic<pid_t> running_child = 0;

void WaitFor(pid_t child) {
  while (::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
}

/// A file, or a folder with all that is in it. In a handler no memory may be taken: a folder is left to rm.
void Remove(const char* path) {
  if (::unlink(path) == 0 || (errno != EISDIR && errno != EPERM)) return;
  const pid_t child = ::vfork();
  if (child == 0) {
    ::execl("/bin/rm", "rm", "-rf", "--", path, static_cast<char*>(nullptr));
    ::_exit(EXIT_FAILURE);
  }
  if (child > 0) WaitFor(child);
}

}  // namespace

TemporaryPath::TemporaryPath(const std::filesystem::path& path) : slot_(kSlots) {
  const std::string& name = path.native();
  if (name.size() >= PATH_MAX) return;
  for (size_t i = 0; i < kSlots; ++i) {
    if (slots[i].taken.exchange(true)) continue;
    slot_ = i;
    std::memcpy(slots[i].path.data(), name.c_str(), name.size() + 1);
    slots[i].owner = ::getpid();
    return;
  }
}

TemporaryPath::~TemporaryPath() {
  if (slot_ == kSlots) return;
  slots[slot_].owner = 0;
  slots[slot_].taken = false;
}

TemporaryChild::TemporaryChild(pid_t child) { running_child = child; }

TemporaryChild::~TemporaryChild() { running_child = 0; }

void RemoveTemporaryPaths() {
  if (const pid_t child = running_child; child > 0 && ::kill(child, SIGKILL) == 0) WaitFor(child);
  const pid_t self = ::getpid();
  for (const Slot& slot : slots) {
    if (slot.owner == self) Remove(slot.path.data());
  }
}

std::string ReadBytes(const std::filesystem::path& path) {
  const auto fail = [&](const std::string& why) {
    throw InputError(path.string() + ": cannot be read: " + why);
  };
  if (std::error_code ignored; std::filesystem::is_directory(path, ignored)) fail("is a directory");
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(std::strerror(errno));
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (file.bad()) fail(std::strerror(errno));
  return bytes;
}

std::string HashBytes(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string digits;
  for (int shift = 60; shift >= 0; shift -= 4) digits += kDigits[(hash >> shift) & 15U];
  return digits;
}

std::filesystem::path FindInstalled(const std::filesystem::path& name) {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  return std::filesystem::weakly_canonical(program.parent_path().parent_path() / name, error);
}

std::string ExtensionOf(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = 'A' <= c && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return extension;
}

TemporaryFolder::TemporaryFolder() {
  std::error_code error;
  const std::filesystem::path parent = std::filesystem::temp_directory_path(error);
  if (error) {
    const char* const named = std::getenv("TMPDIR");
    throw InputError("TMPDIR: must name a folder, got " + Quote(named == nullptr ? "/tmp" : named));
  }
  const HeldSignals until_protected;
  std::string pattern = (parent / "dexcheck-XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr) {
    throw InputError(pattern + ": cannot be made: " + std::strerror(errno));
  }
  path_ = pattern;
  protection_.emplace(path_);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

PartialFile::PartialFile(const std::filesystem::path& target) : path_(target), target_(target) {
  namespace fs = std::filesystem;
  static std::atomic<int> count = 0;
  if (target.empty()) Fail("the name is empty");
  std::error_code error;
  const fs::file_status status = fs::status(target, error);
  if (fs::is_directory(status)) Fail(std::strerror(EISDIR));
  if (fs::exists(status)) {
    if (!fs::is_regular_file(status)) Fail("not a regular file");
    if (::access(target.c_str(), W_OK) != 0) Fail(std::strerror(errno));
    target_ = fs::canonical(target, error);
    if (error) Fail(error.message());
  }
  const std::string partial =
      target_.string() + ".partial-" + std::to_string(::getpid()) + "-" + std::to_string(count++);
  protection_.emplace(partial);
  const int descriptor = ::open(partial.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
  if (descriptor < 0) Fail(std::strerror(errno));
  ::close(descriptor);
  partial_ = partial;
}

PartialFile::~PartialFile() { Abort(); }

void PartialFile::Write(std::string_view bytes) const {
  errno = 0;
  std::ofstream stream(partial_, std::ios::binary);
  stream << bytes;
  stream.close();
  if (!stream) Fail(std::strerror(errno));
}

void PartialFile::Commit() {
  if (std::rename(partial_.c_str(), target_.c_str()) != 0) Fail(std::strerror(errno));
  partial_.clear();
  protection_.reset();
}

void PartialFile::Abort() {
  if (partial_.empty()) return;
  std::remove(partial_.c_str());
  partial_.clear();
  protection_.reset();
}

void PartialFile::Fail(const std::string& reason) const {
  throw InputError(path_.string() + ": cannot be written: " + reason);
}

}  // namespace dexcheck
