#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <new>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/interrupts.h"
#include "harness/log/hdf5_handle.h"
#include "harness/log/log_file.h"
#include "harness/log/log_structure.h"

namespace dexcheck {
namespace {

/// Hundreds of times what the log of a run needs.
constexpr rlim_t kMostSeconds = 3;
/// What the walk may take beyond what this process has.
constexpr rlim_t kMostMemory = rlim_t{2} << 30;
/// Bytes that the other process may tell; texts are the large ones among them.
constexpr size_t kMostTold = size_t{1} << 30;

// The first byte of what is told.
constexpr char kStructure = 's';
constexpr char kProblem = 'p';

/// Bytes of address space that this process has; 0 when that is unknown.
rlim_t MeasureAddressSpace() {
  std::ifstream file("/proc/self/statm");
  rlim_t pages = 0;
  file >> pages;
  return file ? pages * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE)) : 0;
}

void LimitProcess(pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(EXIT_FAILURE);
  LeaveInterruptsToParent();
  // What catches crashes in a program under test must not take them for its own.
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) std::signal(signal, SIG_DFL);
  const auto limit = [](auto resource, rlim_t most) {
    rlimit now{};
    if (::getrlimit(resource, &now) != 0) return;
    now.rlim_cur = std::min(now.rlim_max, most);
    ::setrlimit(resource, &now);
  };
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, kMostSeconds);
  if (const rlim_t taken = MeasureAddressSpace(); taken > 0) limit(RLIMIT_AS, taken + kMostMemory);
}

void Tell(int pipe, const std::string& bytes) {
  for (size_t done = 0; done < bytes.size();) {
    const ssize_t count = ::write(pipe, bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) ::_exit(EXIT_FAILURE);
    done += static_cast<size_t>(count);
  }
}

[[noreturn]] void Work(int descriptor, int pipe, pid_t parent) {
  LimitProcess(parent);
  std::string told;
  try {
    told = kStructure + PackStructure(WalkStructure(descriptor));
  } catch (const std::bad_alloc&) {
    told = kProblem + std::string("it asks for too much memory");
  } catch (const std::exception& error) {
    told = kProblem + std::string(error.what());
  }
  Tell(pipe, told);
  ::_exit(EXIT_SUCCESS);
}

/// Everything until the other side ends; nothing more than kMostTold.
std::string Receive(int pipe) {
  std::string bytes;
  std::string chunk(size_t{1} << 16, '\0');
  for (;;) {
    const ssize_t count = ::read(pipe, chunk.data(), chunk.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0 || bytes.size() > kMostTold) return bytes;
    bytes.append(chunk, 0, static_cast<size_t>(count));
  }
}

[[noreturn]] void FailToStart() {
  throw Error(std::string("a process that reads the log cannot be started: ") + std::strerror(errno));
}

/// What the process told. @throws InputError when it ended otherwise.
std::string WalkApart(int descriptor) {
  H5open();  // so that each process need not
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) FailToStart();
  const FileDescriptor from(ends[0]);
  FileDescriptor to(ends[1]);
  const pid_t parent = ::getpid();
  const pid_t process = ::fork();
  if (process < 0) FailToStart();
  if (process == 0) Work(descriptor, to.get(), parent);
  to.Close();
  std::string told = Receive(from.get());
  if (told.size() > kMostTold) ::kill(process, SIGKILL);
  int status = 0;
  while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
  }
  if (told.size() > kMostTold) throw InputError("it holds too much text");
  if (!told.empty()) return told;
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)
    throw InputError("HDF5 does not come to an end with it");
  const std::string how = WIFSIGNALED(status) ? ::strsignal(WTERMSIG(status)) : "it ended without a result";
  throw InputError("HDF5 fails on it: " + how);
}

}  // namespace

LogStructure ReadStructure(int descriptor, const std::filesystem::path& path) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) FailToRead(path, errno);
  try {
    const std::string told = WalkApart(descriptor);
    if (told[0] == kProblem) throw InputError(Abbreviate(told.substr(1)));
    LogStructure structure = UnpackStructure(std::string_view(told).substr(1));
    CheckStructure(structure, static_cast<std::uint64_t>(status.st_size));
    return structure;
  } catch (const InputError& error) {
    throw InputError(path.string() + ": the log is damaged: " + error.what());
  }
}

}  // namespace dexcheck
