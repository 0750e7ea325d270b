#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <limits>

#include "controller/common/errors.h"
#include "harness/log/hdf5_handle.h"
#include "harness/log/log_content.h"

namespace dexcheck {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

using hdf5::Check;

/// A dataset's or attribute's extents: none for a single value.
using Extents = std::vector<hsize_t>;

hdf5::Dataspace MakeSpace(const Extents& extents) {
  if (extents.empty()) return hdf5::Dataspace(H5Screate(H5S_SCALAR));
  return hdf5::Dataspace(H5Screate_simple(static_cast<int>(extents.size()), extents.data(), nullptr));
}

/// How a dataset is stored: in one piece, without a time stamp; its numbers' place is taken at once, and not
/// filled.
hdf5::Properties MakeDatasetProperties() {
  hdf5::Properties properties(H5Pcreate(H5P_DATASET_CREATE));
  Check(H5Pset_obj_track_times(properties.id(), false));
  Check(H5Pset_layout(properties.id(), H5D_CONTIGUOUS));
  Check(H5Pset_alloc_time(properties.id(), H5D_ALLOC_TIME_EARLY));
  Check(H5Pset_fill_time(properties.id(), H5D_FILL_TIME_NEVER));
  return properties;
}

class LogBuilder {
 public:
  LogBuilder(const LogContent& content, long rows, const std::filesystem::path& path)
      : content_(content),
        rows_(static_cast<hsize_t>(rows)),
        string_type_(hdf5::MakeStringType()),
        dataset_properties_(MakeDatasetProperties()),
        group_properties_(H5Pcreate(H5P_GROUP_CREATE)),
        link_properties_(H5Pcreate(H5P_LINK_CREATE)),
        file_(CreateFile(path)) {
    Check(H5Pset_obj_track_times(group_properties_.id(), false));
    Check(H5Pset_create_intermediate_group(link_properties_.id(), 1));
  }

  /// Writes everything but the numbers, and closes the file. @return the signals' offsets.
  std::vector<std::uint64_t> Build() {
    AddRootAttributes();
    AddTexts();
    for (const EmbeddedFile& file : content_.files) AddFile(file);
    std::vector<std::uint64_t> offsets;
    for (const SignalInfo& signal : content_.signals) offsets.push_back(AddSignal(signal));
    file_.Close();
    return offsets;
  }

 private:
  static hdf5::File CreateFile(const std::filesystem::path& path) {
    const hdf5::Properties creation(H5Pcreate(H5P_FILE_CREATE));
    Check(H5Pset_obj_track_times(creation.id(), false));
    const hdf5::Properties access(H5Pcreate(H5P_FILE_ACCESS));
    Check(H5Pset_libver_bounds(access.id(), H5F_LIBVER_EARLIEST, H5F_LIBVER_LATEST));
    Check(H5Pset_fclose_degree(access.id(), H5F_CLOSE_STRONG));
    return hdf5::File(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation.id(), access.id()));
  }

  void AddAttribute(hid_t object, const std::string& name, hid_t type, const Extents& extents,
                    const void* value) const {
    const hdf5::Dataspace space = MakeSpace(extents);
    const hdf5::Attribute attribute(
        H5Acreate2(object, name.c_str(), type, space.id(), H5P_DEFAULT, H5P_DEFAULT));
    Check(H5Awrite(attribute.id(), type, value));
  }

  void AddAttribute(hid_t object, const std::string& name, const std::string& text) const {
    const char* const value = text.c_str();
    AddAttribute(object, name, string_type_.id(), {}, &value);
  }

  void AddAttribute(hid_t object, const std::string& name, const std::vector<std::string>& texts) const {
    std::vector<const char*> values;
    values.reserve(texts.size());
    for (const std::string& text : texts) values.push_back(text.c_str());
    AddAttribute(object, name, string_type_.id(), {values.size()}, values.data());
  }

  [[nodiscard]] hdf5::Dataset AddDataset(const std::string& name, hid_t type, const Extents& extents) const {
    const hdf5::Dataspace space = MakeSpace(extents);
    return hdf5::Dataset(H5Dcreate2(file_.id(), name.c_str(), type, space.id(), link_properties_.id(),
                                    dataset_properties_.id(), H5P_DEFAULT));
  }

  void AddRootAttributes() const {
    std::vector<std::string> names;
    for (const SignalInfo& signal : content_.signals) names.push_back(signal.name);
    AddAttribute(file_.id(), kFormatAttribute, std::string(kLogFormat));
    AddAttribute(file_.id(), "signals", names);
  }

  void AddTexts() const {
    const hdf5::Group meta(H5Gcreate2(file_.id(), "meta", H5P_DEFAULT, group_properties_.id(), H5P_DEFAULT));
    for (const auto& [name, text] : content_.texts) AddAttribute(meta.id(), name, text);
  }

  void AddFile(const EmbeddedFile& file) const {
    const hdf5::Dataset dataset = AddDataset(file.path, H5T_STD_U8LE, {file.bytes.size()});
    if (file.bytes.empty()) return;
    Check(H5Dwrite(dataset.id(), H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, file.bytes.data()));
  }

  /// @return its offset.
  [[nodiscard]] std::uint64_t AddSignal(const SignalInfo& signal) const {
    Extents extents = {rows_};
    if (signal.width != 1) extents.push_back(static_cast<hsize_t>(signal.width));
    const hdf5::Dataset dataset = AddDataset(signal.name, H5T_IEEE_F64LE, extents);
    AddAttribute(dataset.id(), "unit", signal.unit);
    AddAttribute(dataset.id(), "description", signal.description);
    if (!signal.columns.empty()) AddAttribute(dataset.id(), "columns", signal.columns);
    for (const auto& [name, value] : signal.attributes) {
      AddAttribute(dataset.id(), name, H5T_IEEE_F64LE, {}, &value);
    }
    if (rows_ == 0) return 0;
    const haddr_t offset = H5Dget_offset(dataset.id());
    if (offset == HADDR_UNDEF) throw hdf5::Hdf5Error(hdf5::DescribeLastError());
    return offset;
  }

  const LogContent& content_;
  hsize_t rows_;
  hdf5::Datatype string_type_;
  hdf5::Properties dataset_properties_;
  hdf5::Properties group_properties_;
  hdf5::Properties link_properties_;
  hdf5::File file_;
};

void MarkAllRowsUnwritten(const std::string& name, int descriptor, std::uint64_t time_offset, long rows) {
  std::array<double, 4096> chunk;
  chunk.fill(std::numeric_limits<double>::quiet_NaN());
  for (size_t row = 0; row < static_cast<size_t>(rows); row += chunk.size()) {
    const size_t count = std::min(chunk.size(), static_cast<size_t>(rows) - row);
    WriteAt(name, descriptor, chunk.data(), count * sizeof(double), time_offset + row * sizeof(double));
  }
}

}  // namespace

void FailToWrite(const std::filesystem::path& path, int error) {
  throw InputError(path.string() + ": cannot be written: " + std::strerror(error));
}

void FailToRead(const std::filesystem::path& path, int error) {
  throw InputError(path.string() + ": cannot be read: " + std::strerror(error));
}

void WriteAt(const std::string& name, int descriptor, const void* bytes, size_t count, std::uint64_t offset) {
  for (size_t done = 0; done < count;) {
    const ssize_t step = ::pwrite(descriptor, static_cast<const char*>(bytes) + done, count - done,
                                  static_cast<off_t>(offset + done));
    if (step < 0 && errno == EINTR) continue;
    if (step < 0) FailToWrite(name, errno);
    done += static_cast<size_t>(step);
  }
}

void CopyBytes(const std::string& name, int from, std::uint64_t from_offset, int to, std::uint64_t to_offset,
               size_t count) {
  constexpr size_t kChunk = size_t{1} << 20;
  std::vector<char> chunk(std::min(kChunk, count));
  for (size_t done = 0; done < count;) {
    const ssize_t step = ::pread(from, chunk.data(), std::min(chunk.size(), count - done),
                                 static_cast<off_t>(from_offset + done));
    if (step < 0 && errno == EINTR) continue;
    if (step <= 0) FailToWrite(name, step == 0 ? EIO : errno);
    WriteAt(name, to, chunk.data(), static_cast<size_t>(step), to_offset + done);
    done += static_cast<size_t>(step);
  }
}

LogFile WriteLogFile(const std::filesystem::path& path, const std::string& name, const LogContent& content,
                     long rows) {
  std::vector<std::uint64_t> offsets;
  try {
    // HDF5 cannot close a file on a full disk, and without this would crash over it at the program's end.
    const hdf5::SilencedErrors silenced;
    offsets = LogBuilder(content, rows, path).Build();
  } catch (const hdf5::Hdf5Error& error) {
    throw InputError(name + ": cannot be written: " + error.what());
  }
  LogFile file{FileDescriptor(::open(path.c_str(), O_RDWR | O_CLOEXEC)), std::move(offsets)};
  if (!file.is_open()) FailToWrite(name, errno);
  MarkAllRowsUnwritten(name, file.get(), file.offsets.front(), rows);
  return file;
}

}  // namespace dexcheck
