#include "harness/base/temporary_path.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstring>
#include <string>

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

/// Deeper folders stay: the handler must not use up the stack.
constexpr int kMaxDepth = 40;
/// Passes over a folder, for file systems that skip entries when others are removed meanwhile.
constexpr int kPasses = 8;

void Remove(int folder, const char* name, int depth);

/// Removes what an open folder holds.
void RemoveEntries(int folder, int depth) {
  alignas(dirent64) std::array<char, 2048> entries;
  for (;;) {
    const long count = ::syscall(SYS_getdents64, folder, entries.data(), entries.size());
    if (count <= 0) return;
    for (long at = 0; at < count;) {
      const auto* const entry = reinterpret_cast<const dirent64*>(entries.data() + at);
      at += entry->d_reclen;
      const bool is_link_to_folder =
          std::strcmp(entry->d_name, ".") == 0 || std::strcmp(entry->d_name, "..") == 0;
      if (!is_link_to_folder) Remove(folder, entry->d_name, depth);
    }
  }
}

void Remove(int folder, const char* name, int depth) {
  if (::unlinkat(folder, name, 0) == 0 || (errno != EISDIR && errno != EPERM) || depth >= kMaxDepth) return;
  const int inner = ::openat(folder, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (inner < 0) return;
  for (int pass = 0; pass < kPasses; ++pass) {
    RemoveEntries(inner, depth + 1);
    if (::unlinkat(folder, name, AT_REMOVEDIR) == 0) break;
    ::lseek(inner, 0, SEEK_SET);
  }
  ::close(inner);
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
  if (const pid_t child = running_child; child > 0 && ::kill(child, SIGKILL) == 0) {
    while (::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  const pid_t self = ::getpid();
  for (const Slot& slot : slots) {
    if (slot.owner == self) Remove(AT_FDCWD, slot.path.data(), 0);
  }
}

}  // namespace dexcheck
