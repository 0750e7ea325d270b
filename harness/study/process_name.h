#pragma once

#include <string>

namespace dexcheck {

/// Machine, process id and start of this process: no other process ever has the same.
std::string NameThisProcess();

/// Whether the process of that name runs on this machine; false for those of other machines.
bool IsRunningHere(const std::string& process);

}  // namespace dexcheck
