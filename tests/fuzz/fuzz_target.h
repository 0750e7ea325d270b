#pragma once

// Helpers of the fuzz targets. Each is one LLVMFuzzerTestOneInput: libFuzzer's main calls it with inputs of
// its own making (preset fuzz), replay.cc's main with those of the corpus (every other build).

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "controller/common/errors.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace dexcheck::testing::fuzz {

inline std::string_view AsText(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Ends the program, which is how a fuzz target reports a finding.
inline void Expect(bool condition, const char* what, std::string_view detail = "") {
  if (condition) return;
  std::fprintf(stderr, "fuzz target: %s: %.*s\n", what, static_cast<int>(detail.size()), detail.data());
  std::abort();
}

/// Messages of input errors are one line of bounded length that begins with the file.
inline void ExpectGoodMessage(std::string_view message, std::string_view source) {
  constexpr std::size_t kLongest = 2000;
  Expect(message.starts_with(source), "the message does not name the file", message);
  Expect(message.size() <= kLongest, "the message is too long", message);
  for (const char c : message) Expect(static_cast<unsigned char>(c) >= 0x20, "a control character", message);
}

/// Reads with `read`, whose errors must name `source`. @return 0, for libFuzzer.
template <typename Read>
int Try(std::string_view source, const Read& read) {
  try {
    read();
  } catch (const InputError& error) {
    ExpectGoodMessage(error.what(), source);
  }
  return 0;
}

}  // namespace dexcheck::testing::fuzz
