#include "harness/record/log_reader.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <system_error>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/record/hdf5_handle.h"
#include "harness/record/log_file.h"

namespace dexcheck {
namespace {

using hdf5::Check;
using hdf5::Hdf5Error;

hdf5::File OpenFile(const std::filesystem::path& path) {
  // Non-blocking, for the sake of pipes; it changes nothing for files.
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  if (!file.is_open()) FailToRead(path, errno);
  CheckSeal(file.get(), path);
  const hdf5::Properties access(H5Pcreate(H5P_FILE_ACCESS));
  Check(H5Pset_fclose_degree(access.id(), H5F_CLOSE_STRONG));
  return hdf5::File(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id()));
}

/// The texts of an attribute, one or several.
std::vector<std::string> ReadStrings(hid_t object, const std::string& name) {
  const hdf5::Attribute attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT));
  const hdf5::Dataspace space(H5Aget_space(attribute.id()));
  const auto count = static_cast<size_t>(Check(H5Sget_simple_extent_npoints(space.id())));
  const hdf5::Datatype type = hdf5::MakeStringType();
  std::vector<char*> values(count, nullptr);
  Check(H5Aread(attribute.id(), type.id(), values.data()));
  std::vector<std::string> texts;
  texts.reserve(count);
  for (const char* value : values) texts.emplace_back(value == nullptr ? "" : value);
  Check(H5Dvlen_reclaim(type.id(), space.id(), H5P_DEFAULT, values.data()));
  return texts;
}

std::string ReadString(hid_t object, const std::string& name) {
  const std::vector<std::string> texts = ReadStrings(object, name);
  return texts.empty() ? "" : texts.front();
}

std::string ReadReservedText(hid_t group, const std::string& name) {
  const hdf5::Dataset dataset(H5Dopen2(group, name.c_str(), H5P_DEFAULT));
  const hdf5::Datatype type(H5Dget_type(dataset.id()));
  std::string text(H5Tget_size(type.id()), '\0');
  Check(H5Dread(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()));
  return text.substr(0, text.find('\0'));
}

std::vector<std::string> ListAttributes(hid_t object) {
  H5O_info_t info;
  Check(H5Oget_info2(object, &info, H5O_INFO_NUM_ATTRS));
  std::vector<std::string> names;
  for (hsize_t i = 0; i < info.num_attrs; ++i) {
    const hdf5::Attribute attribute(
        H5Aopen_by_idx(object, ".", H5_INDEX_NAME, H5_ITER_INC, i, H5P_DEFAULT, H5P_DEFAULT));
    std::string name(static_cast<size_t>(Check(H5Aget_name(attribute.id(), 0, nullptr))), '\0');
    Check(H5Aget_name(attribute.id(), name.size() + 1, name.data()));
    names.push_back(name);
  }
  return names;
}

std::vector<std::string> ListLinks(hid_t group) {
  H5G_info_t info;
  Check(H5Gget_info(group, &info));
  std::vector<std::string> names;
  for (hsize_t i = 0; i < info.nlinks; ++i) {
    const auto get = [&](char* text, size_t size) {
      return H5Lget_name_by_idx(group, ".", H5_INDEX_NAME, H5_ITER_INC, i, text, size, H5P_DEFAULT);
    };
    std::string name(static_cast<size_t>(Check(get(nullptr, 0))), '\0');
    Check(get(name.data(), name.size() + 1));
    names.push_back(name);
  }
  return names;
}

std::vector<hsize_t> GetExtents(hid_t dataset) {
  const hdf5::Dataspace space(H5Dget_space(dataset));
  std::vector<hsize_t> extents(static_cast<size_t>(Check(H5Sget_simple_extent_ndims(space.id()))));
  Check(H5Sget_simple_extent_dims(space.id(), extents.data(), nullptr));
  return extents;
}

SignalInfo ReadSignalInfo(hid_t file, const std::string& name) {
  const hdf5::Dataset dataset(H5Dopen2(file, name.c_str(), H5P_DEFAULT));
  const std::vector<hsize_t> extents = GetExtents(dataset.id());
  SignalInfo signal;
  signal.name = name;
  signal.width = extents.size() == 2 ? static_cast<int>(extents[1]) : 1;
  for (const std::string& attribute : ListAttributes(dataset.id())) {
    if (attribute == "unit") {
      signal.unit = ReadString(dataset.id(), attribute);
    } else if (attribute == "description") {
      signal.description = ReadString(dataset.id(), attribute);
    } else if (attribute == "columns") {
      signal.columns = ReadStrings(dataset.id(), attribute);
    } else {
      const hdf5::Attribute number(H5Aopen(dataset.id(), attribute.c_str(), H5P_DEFAULT));
      Check(H5Aread(number.id(), H5T_NATIVE_DOUBLE, &signal.attributes[attribute]));
    }
  }
  return signal;
}

/// The first `rows` rows, in row-major order.
void ReadRows(hid_t file, const std::string& name, hsize_t rows, double* out) {
  if (rows == 0) return;
  const hdf5::Dataset dataset(H5Dopen2(file, name.c_str(), H5P_DEFAULT));
  std::vector<hsize_t> extents = GetExtents(dataset.id());
  extents[0] = rows;
  const std::array<hsize_t, 2> begin{};
  const hdf5::Dataspace from(H5Dget_space(dataset.id()));
  Check(H5Sselect_hyperslab(from.id(), H5S_SELECT_SET, begin.data(), nullptr, extents.data(), nullptr));
  const hdf5::Dataspace to(H5Screate_simple(static_cast<int>(extents.size()), extents.data(), nullptr));
  Check(H5Dread(dataset.id(), H5T_NATIVE_DOUBLE, to.id(), from.id(), H5P_DEFAULT, out));
}

void AddFiles(hid_t group, const std::string& prefix, std::vector<std::string>* files) {
  for (const std::string& name : ListLinks(group)) {
    const hdf5::Object object(H5Oopen(group, name.c_str(), H5P_DEFAULT));
    if (H5Iget_type(object.id()) == H5I_GROUP) {
      AddFiles(object.id(), prefix + name + "/", files);
    } else {
      const hdf5::Datatype type(H5Dget_type(object.id()));
      if (H5Tget_class(type.id()) == H5T_INTEGER) files->push_back(prefix + name);
    }
  }
}

[[noreturn]] void FailToFind(const std::filesystem::path& path, const std::string& kind,
                             const std::string& name, const std::vector<std::string>& known) {
  const std::string nearest = FindNearest(name, known);
  throw InputError(path.string() + ": no " + kind + " " + Quote(name) +
                   (nearest.empty() ? "" : ", did you mean " + Quote(nearest) + "?"));
}

/// Runs `read`, and gives HDF5's failures the file's name.
template <typename Function>
auto Guard(const std::filesystem::path& path, const Function& read) {
  const hdf5::SilencedErrors silenced;
  try {
    return read();
  } catch (const Hdf5Error& error) {
    throw InputError(path.string() + ": the log is damaged: " + error.what());
  }
}

}  // namespace

struct LogReader::Hdf5 {
  hdf5::File file;
};

LogReader::LogReader(const std::filesystem::path& path) : path_(path) {
  Guard(path_, [&] {
    hdf5_ = std::make_unique<Hdf5>(Hdf5{OpenFile(path_)});
    ReadSignals();
    CountRows();
  });
}

LogReader::~LogReader() = default;

void LogReader::ReadSignals() {
  const hid_t file = hdf5_->file.id();
  for (const std::string& name : ReadStrings(file, "signals")) signals_.push_back(ReadSignalInfo(file, name));
}

void LogReader::CountRows() {
  const hid_t file = hdf5_->file.id();
  const std::string& name = signals_.at(0).name;
  const hdf5::Dataset dataset(H5Dopen2(file, name.c_str(), H5P_DEFAULT));
  const hsize_t room = GetExtents(dataset.id()).at(0);
  std::vector<double> times(room);
  ReadRows(file, name, room, times.data());
  const auto is_unwritten = [](double time) { return std::isnan(time); };
  rows_ = static_cast<long>(std::find_if(times.begin(), times.end(), is_unwritten) - times.begin());
}

RowMatrixXd LogReader::ReadSignal(const std::string& name) const {
  const auto is_wanted = [&](const SignalInfo& signal) { return signal.name == name; };
  const auto signal = std::find_if(signals_.begin(), signals_.end(), is_wanted);
  if (signal == signals_.end()) {
    std::vector<std::string> known;
    for (const SignalInfo& other : signals_) known.push_back(other.name);
    FailToFind(path_, "signal", name, known);
  }
  return Guard(path_, [&] {
    RowMatrixXd rows(rows_, signal->width);
    ReadRows(hdf5_->file.id(), name, static_cast<hsize_t>(rows_), rows.data());
    return rows;
  });
}

std::vector<std::string> LogReader::ListTexts() const {
  return Guard(path_, [&] {
    const hdf5::Group meta(H5Gopen2(hdf5_->file.id(), "meta", H5P_DEFAULT));
    std::vector<std::string> names = ListAttributes(meta.id());
    const std::vector<std::string> reserved = ListLinks(meta.id());
    names.insert(names.end(), reserved.begin(), reserved.end());
    std::sort(names.begin(), names.end());
    return names;
  });
}

std::string LogReader::ReadText(const std::string& name) const {
  const std::vector<std::string> known = ListTexts();
  if (std::find(known.begin(), known.end(), name) == known.end()) FailToFind(path_, "text", name, known);
  return Guard(path_, [&] {
    const hdf5::Group meta(H5Gopen2(hdf5_->file.id(), "meta", H5P_DEFAULT));
    const bool is_reserved = Check(H5Aexists(meta.id(), name.c_str())) == 0;
    return is_reserved ? ReadReservedText(meta.id(), name) : ReadString(meta.id(), name);
  });
}

std::vector<std::string> LogReader::ListFiles(const std::string& group) const {
  return Guard(path_, [&] {
    const hid_t id = H5Gopen2(hdf5_->file.id(), group.c_str(), H5P_DEFAULT);
    if (id < 0) FailToFind(path_, "group of files", group, {});
    std::vector<std::string> files;
    AddFiles(hdf5::Group(id).id(), "", &files);
    if (files.empty()) FailToFind(path_, "group of files", group, {});
    std::sort(files.begin(), files.end());
    return files;
  });
}

std::string LogReader::ReadFile(const std::string& group, const std::string& relative_name) const {
  const std::vector<std::string> known = ListFiles(group);
  if (std::find(known.begin(), known.end(), relative_name) == known.end()) {
    FailToFind(path_, "embedded file", group + "/" + relative_name, {});
  }
  return Guard(path_, [&] {
    const std::string name = group + "/" + relative_name;
    const hdf5::Dataset dataset(H5Dopen2(hdf5_->file.id(), name.c_str(), H5P_DEFAULT));
    std::string bytes(GetExtents(dataset.id()).at(0), '\0');
    if (!bytes.empty()) {
      Check(H5Dread(dataset.id(), H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()));
    }
    return bytes;
  });
}

void LogReader::ExtractFiles(const std::string& group, const std::filesystem::path& folder) const {
  namespace fs = std::filesystem;
  for (const std::string& name : ListFiles(group)) {
    const std::string bytes = ReadFile(group, name);
    const fs::path path = folder / name;
    if (fs::path(name).lexically_normal() != name) {
      throw InputError(path_.string() + ": embedded file " + Quote(name) + " leads out of its folder");
    }
    std::error_code error;
    fs::create_directories(path.parent_path(), error);
    if (error) FailToWrite(path.parent_path(), error.value());
    FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    if (!file.is_open()) FailToWrite(path, errno);
    int problem = WriteAt(file.get(), bytes.data(), bytes.size(), 0);
    if (problem == 0) problem = file.Close();
    if (problem != 0) FailToWrite(path, problem);
  }
}

}  // namespace dexcheck
