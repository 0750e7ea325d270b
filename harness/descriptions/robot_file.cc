#include "harness/descriptions/robot_file.h"

#include <algorithm>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/files.h"

namespace dexcheck {
namespace {

/// The name of the first element; empty when the text does not begin as XML does.
std::string_view FindRootElement(std::string_view text) {
  const auto skip_to = [&](std::string_view end) {
    const size_t at = text.find(end);
    text.remove_prefix(at == std::string_view::npos ? text.size() : at + end.size());
  };
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // byte order mark
  while (true) {
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
    if (text.starts_with("<?")) {
      skip_to("?>");
    } else if (text.starts_with("<!--")) {
      skip_to("-->");
    } else if (text.starts_with("<!")) {
      skip_to(">");
    } else {
      break;
    }
  }
  if (!text.starts_with("<")) return {};
  text.remove_prefix(1);
  return text.substr(0, text.find_first_of(" \t\r\n/>"));
}

}  // namespace

RobotFormat FindFormat(std::string_view text, const std::filesystem::path& path) {
  const std::string_view root = FindRootElement(text);
  if (root == "robot" || (root.empty() && path.extension() == ".urdf")) return RobotFormat::kUrdf;
  if (root == "mujoco" || (root.empty() && path.extension() == ".xml")) return RobotFormat::kMjcf;
  if (root.empty()) return RobotFormat::kToml;
  if (root == "mujocoinclude") {
    throw InputError(path.string() +
                     ": is a part for <include> (<mujocoinclude>); give the file that includes it");
  }
  throw InputError(path.string() +
                   ": must be a parameter file (TOML), a URDF (<robot>) or an MJCF (<mujoco>), got " +
                   Quote("<" + std::string(root) + ">"));
}

RobotFormat FindFormat(const std::filesystem::path& path) { return FindFormat(ReadBytes(path), path); }

}  // namespace dexcheck
