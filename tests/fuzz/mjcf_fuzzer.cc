// ListMjcfFiles: of any text, the files that it names all lie in its folder, or it is an InputError that
// names the file.

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "harness/engine/mjcf_file.h"
#include "tests/fuzz/fuzz_target.h"

namespace dexcheck::testing::fuzz {
namespace {

/// A folder with the text and a part that it may include.
class Folder {
 public:
  Folder()
      : path_(std::filesystem::temp_directory_path() / ("dexcheck-fuzz-mjcf-" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path_);
    std::ofstream(path_ / "part.xml") << "<mujocoinclude><include file=\"robot.xml\"/></mujocoinclude>";
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  /// @return the file's path.
  std::filesystem::path Write(std::string_view text) {
    const std::filesystem::path file = path_ / "robot.xml";
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace
}  // namespace dexcheck::testing::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dexcheck::testing::fuzz;
  static Folder folder;
  const std::filesystem::path mjcf = folder.Write(AsText(data, size));
  return Try(mjcf.parent_path().string(), [&] {
    const std::vector<std::string> files = dexcheck::ListMjcfFiles(mjcf);
    Expect(!files.empty() && files.front() == "robot.xml", "the file itself is not the first");
    for (const std::string& file : files) {
      const std::filesystem::path path = file;
      Expect(path.is_relative() && (path.empty() || *path.begin() != ".."), "a file lies elsewhere", file);
    }
  });
}
