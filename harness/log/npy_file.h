#pragma once

// Arrays of numbers in NumPy's format (.npy).

#include <string>
#include <string_view>
#include <vector>

namespace dexcheck {

/// An array of float64, its last index running fastest.
struct NpyArray {
  std::vector<size_t> shape;
  std::vector<double> values;
};

/// The bytes of a .npy file, version 1.0.
std::string WriteNpy(const NpyArray& array);

/// Reads the bytes of a .npy file: float64, little endian, in C or Fortran order.
/// @throws InputError, one line that names `source`, for anything else.
NpyArray ParseNpy(std::string_view bytes, const std::string& source);

}  // namespace dexcheck
