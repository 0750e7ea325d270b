#include "harness/log/npy_file.h"

#include <bit>
#include <charconv>
#include <cstring>
#include <limits>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they stand in the file");

constexpr std::string_view kNpyMagic = "\x93NUMPY";
constexpr size_t kMostDimensions = 8;

/// The text behind "'key':" in the header, which is a Python dictionary.
std::string_view FindValue(std::string_view header, const std::string& key) {
  const std::string quoted = "'" + key + "':";
  const size_t at = header.find(quoted);
  if (at == std::string_view::npos) return {};
  std::string_view rest = header.substr(at + quoted.size());
  rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
  return rest;
}

/// "(2, 3)" as numbers; false when it is something else.
bool ReadShape(std::string_view text, std::vector<size_t>* shape) {
  const size_t end = text.find(')');
  if (text.empty() || text[0] != '(' || end == std::string_view::npos) return false;
  text = text.substr(1, end - 1);
  while (!text.empty()) {
    const size_t digits = text.find_first_not_of(" ,");
    if (digits == std::string_view::npos) return true;
    text.remove_prefix(digits);
    size_t count = 0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), count);
    if (read.ec != std::errc() || shape->size() == kMostDimensions) return false;
    shape->push_back(count);
    text.remove_prefix(static_cast<size_t>(read.ptr - text.data()));
  }
  return true;
}

/// The index in C order of the number at `at` in Fortran order.
size_t FindPlace(size_t at, const std::vector<size_t>& shape) {
  size_t place = 0;
  size_t stride = 1;
  for (size_t size : shape) stride *= size;
  for (const size_t size : shape) {
    stride /= size;
    place += at % size * stride;
    at /= size;
  }
  return place;
}

}  // namespace

std::string WriteNpy(const NpyArray& array) {
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (";
  for (const size_t size : array.shape) header += std::to_string(size) + ", ";
  if (array.shape.size() > 1) header.resize(header.size() - 2);
  header += "), }";
  // The numbers begin at a multiple of 64, behind magic, version and the header's length.
  constexpr size_t kAlignment = 64;
  const size_t before = kNpyMagic.size() + 4;
  const size_t padding = kAlignment - (before + header.size() + 1) % kAlignment;
  header += std::string(padding % kAlignment, ' ') + "\n";
  std::string bytes(kNpyMagic);
  bytes += '\x01';
  bytes += '\x00';
  bytes += static_cast<char>(header.size() & 0xff);
  bytes += static_cast<char>(header.size() >> 8);
  bytes += header;
  const size_t at = bytes.size();
  bytes.resize(at + array.values.size() * sizeof(double));
  if (!array.values.empty()) {
    std::memcpy(bytes.data() + at, array.values.data(), array.values.size() * sizeof(double));
  }
  return bytes;
}

NpyArray ParseNpy(std::string_view bytes, const std::string& source) {
  const auto fail = [&](const std::string& problem) { throw InputError(source + ": " + problem); };
  if (!bytes.starts_with(kNpyMagic) || bytes.size() < kNpyMagic.size() + 4)
    fail("must be a NumPy array (.npy)");
  const auto byte = [&](size_t i) { return static_cast<size_t>(static_cast<unsigned char>(bytes[i])); };
  const size_t version = byte(kNpyMagic.size());
  const size_t length_size = version == 1 ? 2 : 4;
  if (version < 1 || version > 3 || bytes.size() < kNpyMagic.size() + 2 + length_size) {
    fail("must be a NumPy array of version 1 to 3, got version " + std::to_string(version));
  }
  size_t length = 0;
  for (size_t i = 0; i < length_size; ++i) length |= byte(kNpyMagic.size() + 2 + i) << (8 * i);
  const size_t begin = kNpyMagic.size() + 2 + length_size;
  if (length > bytes.size() - begin) fail("ends within its header");
  const std::string_view header = bytes.substr(begin, length);
  const std::string_view descr = FindValue(header, "descr");
  if (!descr.starts_with("'<f8'")) {
    fail("must have numbers of type float64 ('<f8'), got " + Quote(descr.substr(0, descr.find(','))));
  }
  NpyArray array;
  if (!ReadShape(FindValue(header, "shape"), &array.shape)) fail("has no shape, got " + Quote(header));
  size_t count = 1;
  for (const size_t size : array.shape) {
    if (size != 0 && count > std::numeric_limits<size_t>::max() / size / sizeof(double)) count = 0;
    count *= size;
  }
  const std::string_view numbers = bytes.substr(begin + length);
  if (numbers.size() != count * sizeof(double)) {
    fail("must have " + std::to_string(count) + " numbers as its shape says, got " +
         std::to_string(numbers.size()) + " bytes");
  }
  array.values.resize(count);
  if (count > 0) std::memcpy(array.values.data(), numbers.data(), numbers.size());
  if (!FindValue(header, "fortran_order").starts_with("True")) return array;
  const std::vector<double> as_stored = array.values;
  for (size_t i = 0; i < count; ++i) array.values[FindPlace(i, array.shape)] = as_stored[i];
  return array;
}

}  // namespace dexcheck
