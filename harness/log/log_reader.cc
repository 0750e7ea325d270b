#include "harness/log/log_reader.h"

#include <fnmatch.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <exception>
#include <map>
#include <stdexcept>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/child_process.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/log/hdf5_handle.h"
#include "harness/log/log_content.h"

namespace dexcheck {
namespace {

using hdf5::Check;

[[noreturn]] void RefusePart(const std::string& name, const char* problem) {
  throw std::runtime_error(Quote(name) + " " + problem);
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
  for (const char* value : values) texts.emplace_back(value == nullptr ? "" : value);
  Check(H5Dvlen_reclaim(type.id(), space.id(), H5P_DEFAULT, values.data()));
  return texts;
}

std::string ReadString(hid_t object, const std::string& name) {
  const std::vector<std::string> texts = ReadStrings(object, name);
  return texts.empty() ? "" : texts.front();
}

std::vector<std::string> ListAttributes(hid_t object) {
  const auto visit = [](hid_t /*object*/, const char* name, const H5A_info_t* /*info*/,
                        void* out) noexcept -> herr_t {
    static_cast<std::vector<std::string>*>(out)->emplace_back(name);
    return 0;
  };
  std::vector<std::string> names;
  Check(H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_INC, nullptr, visit, &names));
  return names;
}

struct DatasetShape {
  hdf5::Datatype type;
  std::vector<hsize_t> extents;  // none of a single value
};

DatasetShape GetShape(const hdf5::Dataset& dataset) {
  const hdf5::Dataspace space(H5Dget_space(dataset.id()));
  std::vector<hsize_t> extents(static_cast<size_t>(Check(H5Sget_simple_extent_ndims(space.id()))));
  Check(H5Sget_simple_extent_dims(space.id(), extents.data(), nullptr));
  return {hdf5::Datatype(H5Dget_type(dataset.id())), std::move(extents)};
}

hdf5::Dataset Open(hid_t file, const std::string& name) {
  return hdf5::Dataset(H5Dopen2(file, name.c_str(), H5P_DEFAULT));
}

SignalInfo ReadInfo(const hdf5::Dataset& dataset, const std::string& name) {
  const DatasetShape shape = GetShape(dataset);
  if (Check(H5Tequal(shape.type.id(), H5T_IEEE_F64LE)) == 0 || shape.extents.empty() ||
      shape.extents.size() > 2) {
    RefusePart(name, "is not rows of numbers");
  }
  SignalInfo info;
  info.name = name;
  if (shape.extents.size() == 2) info.width = static_cast<int>(shape.extents[1]);
  for (const std::string& attribute : ListAttributes(dataset.id())) {
    if (attribute == "unit") {
      info.unit = ReadString(dataset.id(), attribute);
    } else if (attribute == "description") {
      info.description = ReadString(dataset.id(), attribute);
    } else if (attribute == "columns") {
      info.columns = ReadStrings(dataset.id(), attribute);
    } else {
      const hdf5::Attribute number(H5Aopen(dataset.id(), attribute.c_str(), H5P_DEFAULT));
      const hdf5::Dataspace space(H5Aget_space(number.id()));
      if (Check(H5Sget_simple_extent_npoints(space.id())) != 1) RefusePart(attribute, "is not one number");
      Check(H5Aread(number.id(), H5T_NATIVE_DOUBLE, &info.attributes[attribute]));
    }
  }
  if (!info.columns.empty() && info.columns.size() != static_cast<size_t>(info.width))
    RefusePart(name, "has not as many columns as numbers");
  return info;
}

/// @throws std::runtime_error of more bytes than the file can hold, before they are allocated.
void RequireRoom(const std::string& name, std::uintmax_t count, std::uintmax_t each, std::uintmax_t* room) {
  if (each != 0 && count > *room / each) RefusePart(name, "is longer than the file can hold");
  *room -= count * each;
}

RowMatrixXd ReadRows(hid_t file, const std::string& name, hsize_t rows, int width) {
  const hdf5::Dataset dataset = Open(file, name);
  const hdf5::Dataspace space(H5Dget_space(dataset.id()));
  const hsize_t begin[2] = {0, 0};
  const hsize_t counts[2] = {rows, static_cast<hsize_t>(width)};
  RowMatrixXd values(static_cast<Eigen::Index>(rows), width);
  if (values.size() == 0) return values;
  Check(H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, begin, nullptr, counts, nullptr));
  const hdf5::Dataspace memory(H5Screate_simple(2, counts, nullptr));
  Check(H5Dread(dataset.id(), H5T_NATIVE_DOUBLE, memory.id(), space.id(), H5P_DEFAULT, values.data()));
  return values;
}

/// @throws InputError of what is no file of HDF5's at all.
void RequireHdf5(const std::filesystem::path& path) {
  const auto fail = [&](const char* problem) { throw InputError(path.string() + ": " + problem); };
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) FailToRead(path, errno);
  if (S_ISDIR(status.st_mode)) FailToRead(path, EISDIR);
  if (!S_ISREG(status.st_mode)) fail("not a dexcheck log: not a regular file");
  if (::access(path.c_str(), R_OK) != 0) FailToRead(path, errno);
  if (status.st_size == 0) fail("not a dexcheck log: the file is empty");
  if (H5Fis_hdf5(path.c_str()) <= 0) fail("not a dexcheck log");
}

/// Returns what `work` returns. @throws InputError that names the log for any exception of `work`.
template <typename Work>
auto Guard(const std::filesystem::path& path, const Work& work) {
  try {
    return work();
  } catch (const std::runtime_error& error) {
    throw InputError(path.string() + ": the log is damaged: " + Abbreviate(error.what()));
  } catch (const std::exception&) {  // sizes that no memory and no list can have
    throw InputError(path.string() + ": the log is damaged");
  }
}

[[noreturn]] void FailToFind(const std::filesystem::path& path, const std::string& kind,
                             const std::string& name, const std::vector<std::string>& known) {
  throw InputError(path.string() + ": no " + kind + " " + Quote(name) + SuggestNearest(name, known));
}

}  // namespace

/// Content of the file that is read on opening. Throws any std::exception when it is damaged.
class LogReader::File {
 public:
  explicit File(const std::filesystem::path& path)
      : file_(OpenFile(path)), room_left_(MostUnpacked(SizeOf(path))) {
    if (H5Aexists(file_.id(), "signals") <= 0) throw std::runtime_error("it has no list of signals");
    const bool has_format = H5Aexists(file_.id(), kFormatAttribute) > 0;
    if (has_format && ReadString(file_.id(), kFormatAttribute) != kLogFormat)
      throw std::runtime_error("written by another version of dexcheck");
    is_old_ = !has_format;
    for (const std::string& name : ReadStrings(file_.id(), "signals")) AddSignal(name);
    if (signals_.empty()) throw std::runtime_error("it has no signals");
    const hdf5::Group meta(H5Gopen2(file_.id(), "meta", H5P_DEFAULT));
    for (const std::string& name : ListAttributes(meta.id())) texts_[name] = ReadString(meta.id(), name);
    for (const std::string& name : hdf5::ListDatasets(file_.id())) AddFile(name);
    if (is_old_) RenameTexts();
  }

  [[nodiscard]] std::vector<SignalInfo> ListSignals() const {
    std::vector<SignalInfo> signals = signals_;
    for (SignalInfo& signal : signals) signal.name = RenameSignal(signal.name);
    return signals;
  }
  [[nodiscard]] const std::map<std::string, std::string>& texts() const { return texts_; }
  [[nodiscard]] const std::vector<std::string>& files() const { return files_; }

  [[nodiscard]] long CountRows() const {
    const RowMatrixXd times = ReadRows(file_.id(), signals_.front().name, room_, 1);
    const auto is_unwritten = [](double value) { return std::isnan(value); };
    return std::find_if(times.data(), times.data() + times.size(), is_unwritten) - times.data();
  }

  [[nodiscard]] RowMatrixXd ReadSignal(const SignalInfo& signal, size_t index, long rows) const {
    return ReadRows(file_.id(), signals_[index].name, static_cast<hsize_t>(rows), signal.width);
  }

  [[nodiscard]] std::string ReadFile(const std::string& name) const {
    const hdf5::Dataset dataset = Open(file_.id(), name);
    std::string bytes(GetShape(dataset).extents.at(0), '\0');
    Check(H5Dread(dataset.id(), H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()));
    return is_old_ && name.ends_with(".toml") ? RenameKeys(bytes) : bytes;
  }

 private:
  static hdf5::File OpenFile(const std::filesystem::path& path) {
    const hdf5::Properties access(H5Pcreate(H5P_FILE_ACCESS));
    Check(H5Pset_fclose_degree(access.id(), H5F_CLOSE_STRONG));
    return hdf5::File(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.id()));
  }

  void AddSignal(const std::string& name) {
    const hdf5::Dataset dataset = Open(file_.id(), name);
    signals_.push_back(ReadInfo(dataset, name));
    const hsize_t rows = GetShape(dataset).extents[0];
    if (signals_.size() == 1) room_ = rows;
    if (rows != room_) RefusePart(name, "has other rows");
    RequireRoom(name, rows, sizeof(double) * static_cast<size_t>(std::max(signals_.back().width, 0)),
                &room_left_);
  }

  /// Adds a dataset that is no signal.
  void AddFile(const std::string& name) {
    if (std::ranges::find(signals_, name, &SignalInfo::name) != signals_.end()) return;
    if (!IsPlainPath(name)) RefusePart(name, "is not a plain relative path");
    const DatasetShape shape = GetShape(Open(file_.id(), name));
    if (Check(H5Tequal(shape.type.id(), H5T_STD_U8LE)) == 0 || shape.extents.size() != 1)
      RefusePart(name, "is not a file");
    RequireRoom(name, shape.extents[0], 1, &room_left_);
    files_.push_back(name);
  }

  [[nodiscard]] std::string RenameSignal(const std::string& name) const {
    return is_old_ ? dexcheck::RenameSignal(name) : name;
  }

  void RenameTexts() {
    if (const auto summary = texts_.find("summary"); summary != texts_.end())
      summary->second = RenameSummary(summary->second);
    if (const auto overrides = texts_.find("overrides"); overrides != texts_.end())
      overrides->second = RenameKeys(overrides->second);
  }

  hdf5::SilencedErrors silenced_;
  hdf5::File file_;
  std::uintmax_t room_left_;         // bytes that further parts may state
  bool is_old_ = false;              // format 1
  hsize_t room_ = 0;                 // rows, written or not
  std::vector<SignalInfo> signals_;  // by their names in the file
  std::map<std::string, std::string> texts_;
  std::vector<std::string> files_;
};

LogReader::LogReader(const std::filesystem::path& path) : path_(path) {
  const hdf5::SilencedErrors silenced;
  if (path.has_parent_path() && std::filesystem::is_regular_file(path.parent_path()))
    throw InputError(path.parent_path().string() + ": must be the folder of a run, is a file");
  RequireHdf5(path);
  NoteInput(path);
  ChildProcess trial("reading a log", [&](int /*channel*/) {
    constexpr rlimit kLongest{3, 3};  // s
    ::setrlimit(RLIMIT_CPU, &kLongest);
    ::close(STDERR_FILENO);  // the C library says there that the heap is damaged
    try {
      (void)File(path).CountRows();
    } catch (const std::exception&) {  // which this process finds, too
    }
    return true;
  });
  if (!trial.Wait().has_succeeded()) throw InputError(path.string() + ": the log is damaged");
  Guard(path, [&] {
    file_ = std::make_unique<File>(path);
    signals_ = file_->ListSignals();
    rows_ = file_->CountRows();
  });
}

LogReader::~LogReader() = default;

const SignalInfo* LogReader::Find(const std::string& signal) const {
  const auto found = std::ranges::find(signals_, signal, &SignalInfo::name);
  return found == signals_.end() ? nullptr : &*found;
}

RowMatrixXd LogReader::ReadSignal(const std::string& name) const {
  const SignalInfo* const signal = Find(name);
  if (signal == nullptr) {
    std::vector<std::string> known;
    for (const SignalInfo& other : signals_) known.push_back(other.name);
    FailToFind(path_, "signal", name, known);
  }
  const auto index = static_cast<size_t>(signal - signals_.data());
  return Guard(path_, [&] { return file_->ReadSignal(*signal, index, rows_); });
}

std::vector<std::string> LogReader::ListTexts() const {
  std::vector<std::string> names;
  for (const auto& [name, text] : file_->texts()) names.push_back(name);
  return names;
}

std::string LogReader::ReadText(const std::string& name) const {
  if (!file_->texts().contains(name)) FailToFind(path_, "text", name, ListTexts());
  return FindText(name);
}

std::string LogReader::FindText(const std::string& name) const {
  const auto found = file_->texts().find(name);
  return found == file_->texts().end() ? "" : found->second;
}

std::vector<std::string> LogReader::ListFiles(const std::string& group) const {
  const std::string prefix = group + "/";
  std::vector<std::string> names;
  for (const std::string& name : file_->files()) {
    if (name.starts_with(prefix)) names.push_back(name.substr(prefix.size()));
  }
  if (names.empty()) FailToFind(path_, "group of files", group, {});
  std::ranges::sort(names);
  return names;
}

std::string LogReader::ReadFile(const std::string& group, const std::string& relative_name) const {
  const std::string name = group + "/" + relative_name;
  const std::vector<std::string>& files = file_->files();
  if (std::ranges::find(files, name) == files.end()) FailToFind(path_, "embedded file", name, {});
  return Guard(path_, [&] { return file_->ReadFile(name); });
}

void LogReader::ExtractFiles(const std::string& group, const std::filesystem::path& folder) const {
  ShowFolderAs(folder.string(), path_.string());
  for (const std::string& name : ListFiles(group)) {
    const std::filesystem::path path = folder / name;
    if (Exists(path)) FailToWrite(path, EEXIST);
    WriteFile(path, ReadFile(group, name));
  }
}

std::vector<SignalInfo> ChooseSignals(const LogReader& log, const std::vector<std::string>& patterns) {
  if (patterns.empty()) return log.signals();
  std::vector<std::string> names;
  for (const SignalInfo& signal : log.signals()) names.push_back(signal.name);
  std::vector<bool> wanted(names.size(), false);
  for (const std::string& pattern : patterns) {
    bool found = false;
    for (size_t i = 0; i < names.size(); ++i) {
      if (::fnmatch(pattern.c_str(), names[i].c_str(), 0) == 0) wanted[i] = found = true;
    }
    if (found) continue;
    const std::string nearest = SuggestNearest(pattern, names);
    throw InputError("--signals: no signal matches " + Quote(pattern) +
                     (nearest.empty() ? " (dexcheck export --list names them)" : nearest));
  }
  std::vector<SignalInfo> chosen;
  for (size_t i = 0; i < names.size(); ++i) {
    if (wanted[i]) chosen.push_back(log.signals()[i]);
  }
  return chosen;
}

}  // namespace dexcheck
