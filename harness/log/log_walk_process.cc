#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <exception>
#include <fstream>
#include <new>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/worker_process.h"
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

void LimitProcess() {
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

bool Work(int descriptor, int channel) {
  LimitProcess();
  std::string told;
  try {
    told = kStructure + PackStructure(WalkStructure(descriptor));
  } catch (const std::bad_alloc&) {
    told = kProblem + std::string("it asks for too much memory");
  } catch (const std::exception& error) {
    told = kProblem + std::string(error.what());
  }
  return Send(channel, told);
}

/// Everything until the other side ends; nothing more than kMostTold.
std::string ReceiveAll(int channel) {
  constexpr size_t kChunk = size_t{1} << 16;
  std::string bytes;
  for (std::string part = Receive(channel, kChunk); !part.empty() && bytes.size() <= kMostTold;
       part = Receive(channel, kChunk)) {
    bytes += part;
  }
  return bytes;
}

/// What the process told. @throws InputError when it ended otherwise.
std::string WalkApart(int descriptor) {
  H5open();  // so that each process need not
  WorkerProcess process("a process that reads the log",
                        [&](int channel) { return Work(descriptor, channel); });
  const std::string told = ReceiveAll(process.channel());
  if (told.size() > kMostTold) throw InputError("it holds too much text");
  const ProcessEnd end = process.Wait();
  if (!told.empty()) return told;
  if (end.signal == SIGXCPU) throw InputError("HDF5 does not come to an end with it");
  throw InputError("HDF5 fails on it: " + end.Describe("it ended without a result"));
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
