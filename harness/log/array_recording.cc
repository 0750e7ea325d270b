// Recordings as arrays: NumPy's .npy and .npz, HDF5, and the logs of runs.

#include <zip.h>

#include <algorithm>

#include "controller/common/errors.h"
#include "harness/base/child_process.h"
#include "harness/base/files.h"
#include "harness/log/hdf5_handle.h"
#include "harness/log/log_reader.h"
#include "harness/log/npy_file.h"
#include "harness/log/recording_reader.h"

namespace dexcheck {
namespace {

using Columns = std::vector<std::vector<double>>;

/// An array with its rows along the first index.
struct NamedArray : NpyArray {
  std::string name;
};

[[noreturn]] void Fail(const std::filesystem::path& path, const std::string& problem) {
  throw InputError(path.string() + ": " + problem);
}

/// Arrays with as many rows as most of them; "q[3]" of one with several columns.
std::unique_ptr<RecordingReader> MakeReader(const std::filesystem::path& path, const std::string& format,
                                            const std::vector<NamedArray>& arrays) {
  std::map<size_t, int> lengths;
  for (const NamedArray& array : arrays) ++lengths[array.shape.front()];
  if (lengths.empty()) Fail(path, "has no arrays of numbers");
  const size_t rows = std::max_element(lengths.begin(), lengths.end(), [](const auto& a, const auto& b) {
                        return std::pair(a.second, a.first) < std::pair(b.second, b.first);
                      })->first;
  std::vector<std::string> names;
  Columns columns;
  for (const NamedArray& array : arrays) {
    if (array.shape.front() != rows) continue;
    const size_t width = rows == 0 ? 0 : array.values.size() / rows;
    for (size_t k = 0; k < width; ++k) {
      names.push_back(array.shape.size() == 1 ? array.name : array.name + "[" + std::to_string(k) + "]");
      std::vector<double>& column = columns.emplace_back(rows);
      for (size_t row = 0; row < rows; ++row) column[row] = array.values[row * width + k];
    }
  }
  if (columns.empty()) Fail(path, "has no rows");
  return std::make_unique<TableReader>(path.string(), format, std::move(names), std::move(columns));
}

NamedArray ToArray(const std::string& name, const std::filesystem::path& path, std::string_view bytes) {
  return {ParseNpy(bytes, path.string() + (name.empty() ? "" : ": " + name)), name};
}

std::vector<NamedArray> ReadZip(const std::filesystem::path& path) {
  int error = 0;
  const std::unique_ptr<zip_t, int (*)(zip_t*)> archive(zip_open(path.c_str(), ZIP_RDONLY, &error),
                                                        &zip_close);
  if (!archive) Fail(path, "is no .npz that can be opened");
  std::vector<NamedArray> arrays;
  std::uintmax_t room = MostUnpacked(SizeOf(path));
  for (zip_uint64_t i = 0; i < static_cast<zip_uint64_t>(zip_get_num_entries(archive.get(), 0)); ++i) {
    zip_stat_t stat;
    const std::unique_ptr<zip_file_t, int (*)(zip_file_t*)> file(zip_fopen_index(archive.get(), i, 0),
                                                                 &zip_fclose);
    if (zip_stat_index(archive.get(), i, 0, &stat) != 0 || !file)
      Fail(path, "has an entry that cannot be read");
    if (stat.size > room) Fail(path, std::string(stat.name) + ": is longer than its file can hold");
    room -= stat.size;
    std::string bytes(stat.size, '\0');
    if (zip_fread(file.get(), bytes.data(), stat.size) != static_cast<zip_int64_t>(stat.size))
      Fail(path, std::string(stat.name) + ": cannot be read to its end");
    NamedArray array = ToArray(std::filesystem::path(stat.name).stem(), path, bytes);
    if (!array.shape.empty()) arrays.push_back(std::move(array));
  }
  return arrays;
}

/// All datasets of numbers with one or two indices.
std::vector<NamedArray> ListArrays(const std::filesystem::path& path) {
  const hdf5::SilencedErrors silenced;
  const hdf5::File file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
  std::vector<NamedArray> arrays;
  std::uintmax_t room = MostUnpacked(SizeOf(path)) / sizeof(double);
  for (const std::string& name : hdf5::ListDatasets(file.id())) {
    const hdf5::Dataset set(H5Dopen2(file.id(), name.c_str(), H5P_DEFAULT));
    const hdf5::Datatype type(H5Dget_type(set.id()));
    const hdf5::Dataspace space(H5Dget_space(set.id()));
    const H5T_class_t kind = H5Tget_class(type.id());
    const int rank = H5Sget_simple_extent_ndims(space.id());
    if ((kind != H5T_FLOAT && kind != H5T_INTEGER) || rank < 1 || rank > 2) continue;
    hsize_t extents[2] = {0, 1};
    hdf5::Check(H5Sget_simple_extent_dims(space.id(), extents, nullptr));
    if (extents[1] != 0 && extents[0] > room / extents[1])
      Fail(path, name + ": is longer than its file can hold");
    room -= extents[0] * extents[1];
    NamedArray array{{{extents, extents + rank}, std::vector<double>(extents[0] * extents[1])}, name};
    hdf5::Check(H5Dread(set.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, array.values.data()));
    arrays.push_back(std::move(array));
  }
  return arrays;
}

/// The signals of a run's log, by their names.
std::unique_ptr<RecordingReader> OpenRunLog(const std::filesystem::path& path, const LogReader& log) {
  std::vector<std::string> names;
  Columns columns;
  for (const SignalInfo& signal : log.signals()) {
    const RowMatrixXd rows = log.ReadSignal(signal.name);
    for (Eigen::Index k = 0; k < rows.cols(); ++k) {
      names.push_back(NameColumn(signal, static_cast<size_t>(k)));
      columns.emplace_back(rows.col(k).begin(), rows.col(k).end());
    }
  }
  return std::make_unique<TableReader>(path.string(), "log of a run", std::move(names), std::move(columns));
}

}  // namespace

std::unique_ptr<RecordingReader> OpenNumpyRecording(const std::filesystem::path& path) {
  const std::string bytes = ReadBytes(path, kMostData);
  if (bytes.starts_with("PK")) return MakeReader(path, "NumPy (.npz)", ReadZip(path));
  const NamedArray array = ToArray("", path, bytes);
  if (array.shape.size() != 2)
    Fail(path, "must have two indices, of rows and columns, has " + std::to_string(array.shape.size()));
  return MakeReader(path, "NumPy (.npy)", {array});
}

std::unique_ptr<RecordingReader> OpenHdf5Recording(const std::filesystem::path& path) {
  // In a process of its own first, since HDF5 1.10 crashes on some damaged files.
  ChildProcess trial("reading " + path.string(), [&](int /*channel*/) { return ListArrays(path), true; });
  if (!trial.Wait().has_succeeded()) Fail(path, "cannot be read: a damaged HDF5 file");
  const std::vector<NamedArray> arrays = ListArrays(path);
  const auto is_run = [](const NamedArray& array) { return array.name.starts_with("check/"); };
  if (std::any_of(arrays.begin(), arrays.end(), is_run)) return OpenRunLog(path, LogReader(path));
  return MakeReader(path, "HDF5", arrays);
}

}  // namespace dexcheck
