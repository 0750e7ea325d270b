#pragma once

#include <gtest/gtest.h>
#include <hdf5.h>

#include <filesystem>
#include <functional>

namespace dexcheck::testing {

/// Changes a log as an HDF5 file, as another program would.
inline void ChangeLog(const std::filesystem::path& log, const std::function<void(hid_t file)>& change) {
  const hid_t file = H5Fopen(log.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  change(file);
  ASSERT_GE(H5Fclose(file), 0);
}

/// Adds a dataset of six bytes; its name may be anything that HDF5 takes.
inline void AddBytes(hid_t group, const char* name, hid_t type = H5T_STD_U8LE) {
  const hsize_t size = 6;
  const hid_t space = H5Screate_simple(1, &size, nullptr);
  const hid_t set = H5Dcreate2(group, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  ASSERT_GE(set, 0) << name;
  H5Dclose(set);
  H5Sclose(space);
}

}  // namespace dexcheck::testing
