#include "harness/base/temporary_path.h"

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdlib>
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

}  // namespace dexcheck
