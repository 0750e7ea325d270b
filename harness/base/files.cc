#include "harness/base/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <climits>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <mutex>
#include <system_error>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/base/interrupts.h"

namespace dexcheck {
namespace {

/// One path. A handler may run at any time, so the path is complete before its owner is set.
struct Slot {
  std::atomic<bool> taken = false;
  std::atomic<pid_t> owner = 0;  // 0 while the path is not to be removed
  std::array<char, PATH_MAX> path = {};
};

/// A report has some thirty figures under way.
constexpr size_t kSlots = 128;
std::array<Slot, kSlots> slots;
std::atomic<pid_t> running_child = 0;

void WaitFor(pid_t child) {
  while (::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
}

/// A file, or a folder with all that is in it. In a handler no memory may be taken: a folder is left to rm.
void Remove(const char* path) {
  if (::unlink(path) == 0 || (errno != EISDIR && errno != EPERM)) return;
  const std::array<const char*, 5> words = {"rm", "-rf", "--", path, nullptr};
  pid_t child = 0;
  if (::posix_spawn(&child, "/bin/rm", nullptr, nullptr, const_cast<char* const*>(words.data()), environ) ==
      0)
    WaitFor(child);
}

}  // namespace

TemporaryPath::TemporaryPath(const std::filesystem::path& path) : slot_(kSlots) {
  const std::string& name = path.native();
  if (name.size() >= PATH_MAX) return;
  for (size_t i = 0; i < kSlots; ++i) {
    if (slots[i].taken.exchange(true)) continue;
    slot_ = i;
    std::memcpy(slots[i].path.data(), name.c_str(), name.size() + 1);
    slots[i].owner = ::getpid();
    return;
  }
}

TemporaryPath::~TemporaryPath() {
  if (slot_ == kSlots) return;
  slots[slot_].owner = 0;
  slots[slot_].taken = false;
}

TemporaryChild::TemporaryChild(pid_t child) { running_child = child; }

TemporaryChild::~TemporaryChild() { running_child = 0; }

void RemoveTemporaryPaths() {
  if (const pid_t child = running_child; child > 0 && ::kill(child, SIGKILL) == 0) WaitFor(child);
  const pid_t self = ::getpid();
  for (const Slot& slot : slots) {
    if (slot.owner == self) Remove(slot.path.data());
  }
}

namespace {

/// A file by what it is, whatever its names are.
struct NamedFile {
  dev_t device = 0;
  ino_t number = 0;
  std::filesystem::path name;
};

/// The regular file of this name; none when there is no such.
std::optional<NamedFile> Identify(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return std::nullopt;
  return NamedFile{status.st_dev, status.st_ino, path};
}

/// Finds the same file in a list, when it still has that name: inode numbers are reused.
const NamedFile* Find(const std::vector<NamedFile>& files, const NamedFile& file) {
  const auto is_same = [&](const NamedFile& other) {
    if (other.device != file.device || other.number != file.number) return false;
    const std::optional<NamedFile> now = Identify(other.name);
    return now && now->device == file.device && now->number == file.number;
  };
  const auto found = std::ranges::find_if(files, is_same);
  return found == files.end() ? nullptr : &*found;
}

/// Files that this process has read, and targets that stand while their replacements are written.
struct FilesInUse {
  std::mutex mutex;
  std::vector<NamedFile> inputs;
  std::vector<NamedFile> targets;
  std::vector<NamedFile> written;              // by this process, which may write them again
  std::vector<std::filesystem::path> partial;  // targets whose replacements are written, links followed
};

FilesInUse& AllFilesInUse() {
  static FilesInUse files;
  return files;
}

[[noreturn]] void RefuseOutput(const std::filesystem::path& output, const std::filesystem::path& input) {
  throw InputError(output.string() + ": cannot be written: it is an input of this command" +
                   (output == input ? "" : ", " + input.string()));
}

/// Reads from a descriptor to its end. @returns the system's error number; EFBIG above `most` bytes.
int ReadAll(int descriptor, std::uintmax_t most, std::string* bytes) {
  constexpr size_t kPart = size_t{1} << 18U;
  while (bytes->size() <= most) {
    const size_t size = bytes->size();
    bytes->resize(size + kPart);
    const ssize_t count = ::read(descriptor, bytes->data() + size, kPart);
    const int error = errno;
    bytes->resize(size + static_cast<size_t>(std::max<ssize_t>(count, 0)));
    if (count == 0) return 0;
    if (count < 0 && error != EINTR) return error;
  }
  return EFBIG;
}

}  // namespace

void NoteInput(const std::filesystem::path& path) {
  const std::optional<NamedFile> file = Identify(path);
  if (!file) return;
  FilesInUse& files = AllFilesInUse();
  const std::scoped_lock lock(files.mutex);
  if (Find(files.written, *file) != nullptr) return;
  if (const NamedFile* const target = Find(files.targets, *file)) RefuseOutput(target->name, path);
  if (Find(files.inputs, *file) == nullptr) files.inputs.push_back(*file);
}

std::string ReadBytes(const std::filesystem::path& path, std::uintmax_t most, const std::string& shown) {
  const auto fail = [&](const std::string& why) {
    throw InputError((shown.empty() ? path.string() : shown) + ": cannot be read: " + why);
  };
  if (path.native().find('\0') != std::string::npos) fail("a file's name has no NUL");
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY));
  struct stat status {};
  if (!file.is_open() || ::fstat(file.get(), &status) != 0) fail(std::strerror(errno));
  if (S_ISDIR(status.st_mode)) fail("is a directory");
  NoteInput(path);
  const bool is_regular = S_ISREG(status.st_mode);
  if (!is_regular) most = std::min(most, kMostText);
  std::string bytes;
  const bool fits = !is_regular || static_cast<std::uintmax_t>(status.st_size) <= most;
  const int error = fits ? ReadAll(file.get(), most, &bytes) : EFBIG;
  if (error == EFBIG) fail("is longer than " + std::to_string(most >> 20U) + " MiB");
  if (error != 0) fail(std::strerror(error));
  return bytes;
}

bool Exists(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::exists(path, ignored);
}

bool IsFolder(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored);
}

std::uintmax_t SizeOf(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  return error ? 0 : size;
}

std::filesystem::path CurrentFolder() {
  std::error_code error;
  std::filesystem::path folder = std::filesystem::current_path(error);
  if (error) throw InputError("the current folder: cannot be read: " + error.message());
  return folder;
}

std::filesystem::path MakeAbsolute(const std::filesystem::path& path) {
  return path.is_absolute() ? path : CurrentFolder() / path;
}

void MakeFolder(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) throw InputError(path.string() + ": cannot be made: " + error.message());
}

std::vector<std::filesystem::path> ListFolder(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    paths.push_back(at->path());
  if (error) throw InputError(folder.string() + ": cannot be read: " + error.message());
  std::ranges::sort(paths);
  return paths;
}

std::string HashBytes(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return fmt::format("{:016x}", hash);
}

std::filesystem::path FindInstalled(const std::filesystem::path& name) {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  return std::filesystem::weakly_canonical(program.parent_path().parent_path() / name, error);
}

std::string ExtensionOf(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = 'A' <= c && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return extension;
}

TemporaryFolder::TemporaryFolder() {
  std::error_code error;
  const std::filesystem::path parent = std::filesystem::temp_directory_path(error);
  if (error) {
    const char* const named = std::getenv("TMPDIR");
    throw InputError("TMPDIR: must name a folder, got " + Quote(named == nullptr ? "/tmp" : named));
  }
  const HeldSignals until_protected;
  std::string pattern = (parent / "dexcheck-XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr) {
    throw InputError(pattern + ": cannot be made: " + std::strerror(errno));
  }
  path_ = pattern;
  protection_.emplace(path_);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

PartialFile::PartialFile(const std::filesystem::path& target) : path_(target), target_(target) {
  namespace fs = std::filesystem;
  static std::atomic<int> count = 0;
  if (target.empty()) Fail("the name is empty");
  std::error_code error;
  const fs::file_status status = fs::status(target, error);
  if (fs::is_directory(status)) Fail(std::strerror(EISDIR));
  if (fs::exists(status)) {
    if (!fs::is_regular_file(status)) Fail("not a regular file");
    if (::access(target.c_str(), W_OK) != 0) Fail(std::strerror(errno));
    target_ = fs::canonical(target, error);
    if (error) Fail(error.message());
    RefuseInput();
  }
  target_ = fs::weakly_canonical(MakeAbsolute(target_), error);
  if (error) Fail(error.message());
  FilesInUse& files = AllFilesInUse();
  const std::scoped_lock lock(files.mutex);
  if (std::ranges::find(files.partial, target_) != files.partial.end())
    Fail("another output of this command is the same file");
  const std::string partial =
      target_.string() + ".partial-" + std::to_string(::getpid()) + "-" + std::to_string(count++);
  protection_.emplace(partial);
  const int descriptor = ::open(partial.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
  if (descriptor < 0) Fail(std::strerror(errno));
  ::close(descriptor);
  partial_ = partial;
  files.partial.push_back(target_);
  if (const std::optional<NamedFile> replaced = Identify(target_))
    files.targets.push_back({replaced->device, replaced->number, path_});
}

PartialFile::~PartialFile() { Abort(); }

void PartialFile::Write(std::string_view bytes) const {
  errno = 0;
  std::ofstream stream(partial_, std::ios::binary);
  stream << bytes;
  stream.close();
  if (!stream) Fail(std::strerror(errno));
}

void PartialFile::Commit() {
  RefuseInput();
  if (std::rename(partial_.c_str(), target_.c_str()) != 0) Fail(std::strerror(errno));
  if (const std::optional<NamedFile> own = Identify(target_)) {
    FilesInUse& files = AllFilesInUse();
    const std::scoped_lock lock(files.mutex);
    files.written.push_back(*own);
  }
  Release();
}

void PartialFile::Abort() {
  if (partial_.empty()) return;
  std::remove(partial_.c_str());
  Release();
}

void PartialFile::Release() {
  partial_.clear();
  protection_.reset();
  FilesInUse& files = AllFilesInUse();
  const std::scoped_lock lock(files.mutex);
  const auto own = std::ranges::find(files.targets, path_, &NamedFile::name);
  if (own != files.targets.end()) files.targets.erase(own);
  std::erase(files.partial, target_);
}

void PartialFile::RefuseInput() const {
  const std::optional<NamedFile> replaced = Identify(target_);
  FilesInUse& files = AllFilesInUse();
  const std::scoped_lock lock(files.mutex);
  const NamedFile* const input = replaced ? Find(files.inputs, *replaced) : nullptr;
  if (input != nullptr) RefuseOutput(path_, input->name);
}

void PartialFile::Fail(const std::string& reason) const {
  throw InputError(path_.string() + ": cannot be written: " + reason);
}

void WriteFile(const std::filesystem::path& path, std::string_view bytes) {
  MakeFolder(path.parent_path());
  PartialFile file(path);
  file.Write(bytes);
  file.Commit();
}

}  // namespace dexcheck
