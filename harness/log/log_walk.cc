#include <algorithm>
#include <exception>
#include <set>
#include <stdexcept>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/log/hdf5_handle.h"
#include "harness/log/log_structure.h"

namespace dexcheck {
namespace {

using hdf5::Check;

[[noreturn]] void RefusePart(const std::string& name, const char* problem) {
  throw std::runtime_error(Quote(name) + " " + problem);
}

hdf5::File OpenFile(int descriptor) {
  const hdf5::Properties access(H5Pcreate(H5P_FILE_ACCESS));
  Check(H5Pset_fclose_degree(access.id(), H5F_CLOSE_STRONG));
  // This very file, whatever has its name by now.
  const std::string path = "/proc/self/fd/" + std::to_string(descriptor);
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
  const auto visit = [](hid_t /*group*/, const char* name, const H5L_info_t* /*info*/,
                        void* out) noexcept -> herr_t {
    static_cast<std::vector<std::string>*>(out)->emplace_back(name);
    return 0;
  };
  std::vector<std::string> links;
  Check(H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, visit, &links));
  return links;
}

std::vector<hsize_t> GetExtents(hid_t dataset) {
  const hdf5::Dataspace space(H5Dget_space(dataset));
  std::vector<hsize_t> extents(static_cast<size_t>(Check(H5Sget_simple_extent_ndims(space.id()))));
  Check(H5Sget_simple_extent_dims(space.id(), extents.data(), nullptr));
  return extents;
}

/// Where the dataset's bytes lie.
ByteRange Locate(const hdf5::Dataset& dataset, const std::string& name, size_t value_size,
                 const std::vector<hsize_t>& extents) {
  std::uint64_t size = value_size;
  for (const hsize_t extent : extents) size *= extent;
  if (size == 0) return {};
  const haddr_t offset = H5Dget_offset(dataset.id());
  if (offset == HADDR_UNDEF) RefusePart(name, "is not stored in one piece");
  return {offset, size};
}

StoredSignal ReadSignal(hid_t file, const std::string& name) {
  const hdf5::Dataset dataset(H5Dopen2(file, name.c_str(), H5P_DEFAULT));
  const hdf5::Datatype type(H5Dget_type(dataset.id()));
  const std::vector<hsize_t> extents = GetExtents(dataset.id());
  if (Check(H5Tequal(type.id(), H5T_IEEE_F64LE)) == 0 || extents.empty() || extents.size() > 2) {
    RefusePart(name, "is not rows of numbers");
  }
  StoredSignal signal;
  signal.rows = extents[0];
  signal.bytes = Locate(dataset, name, sizeof(double), extents);
  SignalInfo& info = signal.info;
  info.name = name;
  if (extents.size() == 2) info.width = static_cast<int>(extents[1]);
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
  return signal;
}

/// Collects what lies in a log besides its signals.
class Walker {
 public:
  explicit Walker(LogStructure* structure) : structure_(structure) {
    for (const StoredSignal& signal : structure->signals) signals_.insert(signal.info.name);
  }

  void Walk(hid_t group, const std::string& prefix) {
    for (const std::string& link : ListLinks(group)) {
      const std::string name = prefix + link;
      if (!IsPlainPath(name)) RefusePart(name, "is not a plain relative path");
      const hdf5::Object object(H5Oopen(group, link.c_str(), H5P_DEFAULT));
      if (H5Iget_type(object.id()) == H5I_GROUP) {
        Walk(object.id(), name + "/");
      } else if (!signals_.contains(name)) {
        Add(group, link, name);
      }
    }
  }

 private:
  void Add(hid_t group, const std::string& link, const std::string& name) {
    constexpr std::string_view kTexts = "meta/";
    const hdf5::Dataset dataset(H5Dopen2(group, link.c_str(), H5P_DEFAULT));
    const hdf5::Datatype type(H5Dget_type(dataset.id()));
    const std::vector<hsize_t> extents = GetExtents(dataset.id());
    if (name.starts_with(kTexts)) {
      const bool is_text = H5Tget_class(type.id()) == H5T_STRING && H5Tis_variable_str(type.id()) == 0;
      if (!is_text || !extents.empty()) RefusePart(name, "is not a text");
      structure_->reserved_texts.emplace_back(name.substr(kTexts.size()),
                                              Locate(dataset, name, H5Tget_size(type.id()), {}));
    } else {
      if (Check(H5Tequal(type.id(), H5T_STD_U8LE)) == 0 || extents.size() != 1)
        RefusePart(name, "is not a file");
      structure_->files.emplace_back(name, Locate(dataset, name, 1, extents));
    }
  }

  LogStructure* structure_;
  std::set<std::string> signals_;
};

LogStructure WalkStructure(int descriptor) {
  const hdf5::SilencedErrors silenced;
  const hdf5::File file = OpenFile(descriptor);
  LogStructure structure;
  for (const std::string& name : ReadStrings(file.id(), "signals")) {
    structure.signals.push_back(ReadSignal(file.id(), name));
    if (structure.signals.back().rows != structure.signals.front().rows) RefusePart(name, "has other rows");
  }
  if (structure.signals.empty()) throw std::runtime_error("it has no signals");
  const hdf5::Group meta(H5Gopen2(file.id(), "meta", H5P_DEFAULT));
  for (const std::string& name : ListAttributes(meta.id())) {
    structure.texts[name] = ReadString(meta.id(), name);
  }
  const hdf5::Group root(H5Gopen2(file.id(), "/", H5P_DEFAULT));
  Walker(&structure).Walk(root.id(), "");
  return structure;
}

}  // namespace

LogStructure ReadStructure(int descriptor, const std::filesystem::path& path) {
  try {
    return WalkStructure(descriptor);
  } catch (const std::exception& error) {
    throw InputError(path.string() + ": the log is damaged: " + Abbreviate(error.what()));
  }
}

}  // namespace dexcheck
