#include "harness/engine/mjcf_files.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <regex>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

std::string ReadWithoutComments(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(path.string() + ": cannot be read");
  std::string text{std::istreambuf_iterator<char>(file), {}};
  for (size_t begin = text.find("<!--"); begin != std::string::npos; begin = text.find("<!--", begin)) {
    const size_t end = text.find("-->", begin);
    text.erase(begin, end == std::string::npos ? end : end + 3 - begin);
  }
  return text;
}

/// Values of an attribute in all elements of a kind.
std::vector<std::string> FindAttributes(const std::string& text, const std::string& element,
                                        const std::string& attribute) {
  const std::regex tag("<" + element + "\\b[^>]*\\s" + attribute + "\\s*=\\s*[\"']([^\"'>]*)[\"']");
  std::vector<std::string> values;
  for (std::sregex_iterator it(text.begin(), text.end(), tag), end; it != end; ++it) {
    values.push_back((*it)[1]);
  }
  return values;
}

}  // namespace

std::vector<std::string> ListMjcfFiles(const std::filesystem::path& mjcf) {
  const std::filesystem::path folder = mjcf.parent_path();
  std::vector<std::string> files;
  std::vector<std::string> pending = {mjcf.filename().string()};
  std::vector<std::string> meshes;
  std::vector<std::string> textures;
  std::filesystem::path mesh_folder;
  std::filesystem::path texture_folder;
  const auto collect = [](std::vector<std::string>* all, const std::vector<std::string>& more) {
    all->insert(all->end(), more.begin(), more.end());
  };
  while (!pending.empty()) {
    const std::string name = pending.back();
    pending.pop_back();
    if (std::find(files.begin(), files.end(), name) != files.end()) continue;
    files.push_back(name);
    const std::string text = ReadWithoutComments(folder / name);
    collect(&pending, FindAttributes(text, "include", "file"));
    for (const std::string& value : FindAttributes(text, "compiler", "meshdir")) mesh_folder = value;
    for (const std::string& value : FindAttributes(text, "compiler", "texturedir")) texture_folder = value;
    for (const char* element : {"mesh", "hfield", "skin"}) {
      collect(&meshes, FindAttributes(text, element, "file"));
    }
    for (const char* side : {"", "right", "left", "up", "down", "front", "back"}) {
      collect(&textures, FindAttributes(text, "texture", std::string("file") + side));
    }
  }
  for (const std::string& file : meshes) files.push_back((mesh_folder / file).lexically_normal().string());
  for (const std::string& file : textures)
    files.push_back((texture_folder / file).lexically_normal().string());
  for (const std::string& file : files) {
    if (!file.starts_with("..") && !file.starts_with("/")) continue;
    throw InputError(mjcf.string() + ": file " + Quote(file) +
                     ": must lie in the MJCF's folder, so that the log can keep it");
  }
  std::sort(files.begin() + 1, files.end());
  files.erase(std::unique(files.begin(), files.end()), files.end());
  return files;
}

}  // namespace dexcheck
