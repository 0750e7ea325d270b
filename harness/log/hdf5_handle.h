#pragma once

// HDF5 for the log's writer and reader only: identifiers that close themselves, failures as exceptions.

#include <hdf5.h>

#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace dexcheck::hdf5 {

/// A call that HDF5 refused. The message is the reason alone; whoever knows the file's name adds it.
class Hdf5Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The operating system's reason when HDF5's error stack has one, otherwise the innermost entry's text.
inline std::string DescribeLastError() {
  std::string reason;
  const auto visit = [](unsigned /*depth*/, const H5E_error2_t* entry, void* out) noexcept -> herr_t {
    constexpr std::string_view kSystemReason = "error message = '";
    auto* const text = static_cast<std::string*>(out);
    const std::string_view description = entry->desc == nullptr ? "" : entry->desc;
    const size_t at = description.find(kSystemReason);
    if (at != std::string_view::npos) {
      const std::string_view rest = description.substr(at + kSystemReason.size());
      *text = rest.substr(0, rest.find('\''));
      return 1;
    }
    if (text->empty()) *text = description;
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, visit, &reason);
  return reason.empty() ? "HDF5 failed without a reason" : reason;
}

/// Passes a result of HDF5 on. @throws Hdf5Error when it is negative.
template <typename Result>
Result Check(Result result) {
  if (result < 0) throw Hdf5Error(DescribeLastError());
  return result;
}

/// An owned identifier.
template <herr_t (*CloseFunction)(hid_t)>
class Handle {
 public:
  /// @throws Hdf5Error when `id` says that opening failed.
  explicit Handle(hid_t id) : id_(Check(id)) {}
  ~Handle() {
    if (id_ >= 0) CloseFunction(id_);
  }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)) {}

  /// Closes now. @throws Hdf5Error when that fails, as for a file whose last bytes cannot be written.
  void Close() { Check(CloseFunction(std::exchange(id_, H5I_INVALID_HID))); }

  [[nodiscard]] hid_t id() const { return id_; }

 private:
  hid_t id_;
};

using Attribute = Handle<H5Aclose>;
using Dataset = Handle<H5Dclose>;
using Dataspace = Handle<H5Sclose>;
using Datatype = Handle<H5Tclose>;
using File = Handle<H5Fclose>;
using Group = Handle<H5Gclose>;
using Properties = Handle<H5Pclose>;

/// Keeps HDF5 from printing its errors while it lives.
class SilencedErrors {
 public:
  SilencedErrors() {
    // HDF5 cannot close the objects of a damaged file, and would report it when the program ends. Only the
    // first call has an effect.
    H5dont_atexit();
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~SilencedErrors() {
    H5Eclear2(H5E_DEFAULT);
    H5Eset_auto2(H5E_DEFAULT, function_, data_);
  }
  SilencedErrors(const SilencedErrors&) = delete;
  SilencedErrors& operator=(const SilencedErrors&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

/// Strings of any length, UTF-8.
inline Datatype MakeStringType() {
  Datatype type(H5Tcopy(H5T_C_S1));
  Check(H5Tset_size(type.id(), H5T_VARIABLE));
  Check(H5Tset_cset(type.id(), H5T_CSET_UTF8));
  return type;
}

/// All datasets, with their groups: "object/X_o".
inline std::vector<std::string> ListDatasets(hid_t file) {
  const auto visit = [](hid_t group, const char* name, const H5L_info_t* link, void* out) noexcept -> herr_t {
    H5O_info_t object;
    if (link->type != H5L_TYPE_HARD) return 0;
    if (H5Oget_info_by_name2(group, name, &object, H5O_INFO_BASIC, H5P_DEFAULT) < 0) return -1;
    if (object.type == H5O_TYPE_DATASET) static_cast<std::vector<std::string>*>(out)->emplace_back(name);
    return 0;
  };
  std::vector<std::string> names;
  Check(H5Lvisit(file, H5_INDEX_NAME, H5_ITER_INC, visit, &names));
  return names;
}

}  // namespace dexcheck::hdf5
