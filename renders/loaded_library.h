#pragma once

// Mesa, with LLVM in it, and libav, with a hundred libraries behind it, take 75 ms of processor time to load.
// Most commands draw nothing, so these are loaded when something is drawn.

#include <string>

namespace dexcheck {

/// A shared library that is loaded while the program runs, and stays.
class LoadedLibrary {
 public:
  /// @param name with its version: "libOSMesa.so.8".
  /// @throws Error "NAME: cannot be loaded: reason".
  explicit LoadedLibrary(const std::string& name);

  /// @param function where its address goes. @throws Error when the library has none of this name.
  template <typename Function>
  void Find(const char* name, Function** function) const {
    *function = reinterpret_cast<Function*>(FindAddress(name));
  }

 private:
  [[nodiscard]] void* FindAddress(const char* name) const;

  std::string name_;
  void* handle_;
};

}  // namespace dexcheck
