#include "harness/cli/shipped_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck::cli {

std::filesystem::path FindShippedFile(const std::filesystem::path& name) {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  std::filesystem::path installed = program.parent_path().parent_path() / "share/dexcheck" / name;
  if (!error && std::filesystem::exists(installed, error)) return installed;
  std::filesystem::path source = std::filesystem::path(DEXCHECK_DATA_DIR) / name;
  if (!std::filesystem::exists(source, error)) {
    throw InputError(source.string() + ": does not exist, nor does " + installed.string() +
                     ": this program's shipped files are missing");
  }
  return source;
}

std::vector<std::string> ShippedKind::ListNames() const {
  std::vector<std::string> names;
  for (const std::filesystem::directory_entry& entry :
       std::filesystem::directory_iterator(FindShippedFile(folder))) {
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::filesystem::path ShippedKind::Find(const std::string& name_or_file) const {
  if (IsTomlFile(name_or_file)) return name_or_file;
  const std::vector<std::string> known = ListNames();
  if (std::find(known.begin(), known.end(), name_or_file) != known.end())
    return FindShippedFile(folder) / (name_or_file + ".toml");
  const std::string where = *listed != '\0' ? listed : fmt::format("{}", fmt::join(known, ", "));
  throw InputError(fmt::format("{} {}: is neither shipped ({}) nor a TOML file{}", name, Quote(name_or_file),
                               where, SuggestNearest(name_or_file, known)));
}

bool IsTomlFile(const std::string& name) {
  return name.ends_with(".toml") || name.find('/') != std::string::npos;
}

}  // namespace dexcheck::cli
