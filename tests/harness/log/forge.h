#pragma once

// Logs that somebody changed on purpose: with a checksum that is right again.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>

#include "harness/log/log_file.h"
#include "tests/common/files.h"

namespace dexcheck::testing {

/// Begin and end of the numbers and late texts, as the seal says.
inline std::pair<std::uint64_t, std::uint64_t> ReadVariablePart(const std::string& bytes) {
  unsigned long long begin = 0;
  unsigned long long end = 0;
  const size_t line = bytes.find("variable ");
  EXPECT_EQ(std::sscanf(bytes.c_str() + line, "variable %llu %llu", &begin, &end), 2);
  return {begin, end};
}

inline void SealAgain(const std::filesystem::path& log,
                      std::pair<std::uint64_t, std::uint64_t> variable_part) {
  const FileDescriptor file(::open(log.c_str(), O_RDWR | O_CLOEXEC));
  ASSERT_TRUE(file.is_open());
  ASSERT_EQ(WriteSeal(file.get(), variable_part.first, variable_part.second), 0);
}

/// Puts these bytes, of the log's size, in the place of the log's.
inline void ForgeBytes(const std::filesystem::path& log, const std::string& bytes) {
  WriteText(log, bytes);
  SealAgain(log, ReadVariablePart(bytes));
}

/// Changes the log as an HDF5 file.
inline void ForgeStructure(const std::filesystem::path& log, const std::function<void(hid_t file)>& change) {
  const auto variable_part = ReadVariablePart(ReadText(log));
  const hid_t file = H5Fopen(log.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  change(file);
  ASSERT_GE(H5Fclose(file), 0);
  SealAgain(log, variable_part);
}

/// Adds an embedded file; its name's parts may be anything that HDF5 takes.
inline void AddForgedFile(hid_t group, const char* name, hid_t creation = H5P_DEFAULT, hsize_t size = 6,
                          bool write = true) {
  const hid_t space = H5Screate_simple(1, &size, nullptr);
  const hid_t set = H5Dcreate2(group, name, H5T_STD_U8LE, space, H5P_DEFAULT, creation, H5P_DEFAULT);
  ASSERT_GE(set, 0) << name;
  if (write) ASSERT_GE(H5Dwrite(set, H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, "forged"), 0);
  H5Dclose(set);
  H5Sclose(space);
}

}  // namespace dexcheck::testing
