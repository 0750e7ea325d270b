#include "harness/study/process_name.h"

#include <unistd.h>

#include <fstream>
#include <sstream>

namespace dexcheck {
namespace {

/// Changes with every boot.
std::string ReadMachine() {
  std::string boot;
  std::ifstream("/proc/sys/kernel/random/boot_id") >> boot;
  char host[256] = "";
  ::gethostname(host, sizeof(host) - 1);
  return std::string(host) + "/" + boot;
}

/// Start of a living process in ticks since boot; empty when there is none.
std::string ReadStart(const std::string& pid) {
  std::ifstream file("/proc/" + pid + "/stat");
  std::stringstream text;
  text << file.rdbuf();
  // The second field, in parentheses, may hold anything; the start is the 22nd, the state the third.
  const std::string all = text.str();
  const size_t after = all.rfind(')');
  if (after == std::string::npos) return "";
  std::istringstream rest(all.substr(after + 1));
  constexpr int kFieldsToStart = 20;
  std::string field;
  for (int i = 0; i < kFieldsToStart; ++i) {
    rest >> field;
    if (i == 0 && (field == "Z" || field == "X")) return "";
  }
  return field;
}

}  // namespace

std::string NameThisProcess() {
  const std::string pid = std::to_string(::getpid());
  return ReadMachine() + "/" + pid + "/" + ReadStart(pid);
}

bool IsRunningHere(const std::string& process) {
  const std::string machine = ReadMachine() + "/";
  if (!process.starts_with(machine)) return false;
  const size_t slash = process.find('/', machine.size());
  if (slash == std::string::npos) return false;
  const std::string start = ReadStart(process.substr(machine.size(), slash - machine.size()));
  return !start.empty() && process.substr(slash + 1) == start;
}

}  // namespace dexcheck
