#include "harness/cli/shipped_files.h"

#include <system_error>

#include "controller/common/errors.h"

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

}  // namespace dexcheck::cli
