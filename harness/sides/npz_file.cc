#include "harness/sides/npz_file.h"

#include <zlib.h>

#include <cstdint>
#include <new>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

constexpr std::string_view kEndOfDirectory = "PK\x05\x06";
constexpr std::string_view kDirectoryEntry = "PK\x01\x02";
constexpr std::string_view kMember = "PK\x03\x04";
constexpr std::uint64_t kZip64 = 0xffffffff;  // a size that stands elsewhere
constexpr std::uint64_t kStored = 0;
constexpr std::uint64_t kDeflated = 8;

/// Reads an archive by the directory at its end.
class NpzReader {
 public:
  NpzReader(std::string_view bytes, const std::string& source) : bytes_(bytes), source_(source) {}

  std::map<std::string, std::string> Read() {
    const size_t end = bytes_.rfind(kEndOfDirectory);
    if (end == std::string_view::npos) Fail("must be a .npz file (a ZIP archive)");
    const std::uint64_t count = Number(end + 10, 2);
    std::uint64_t at = Number(end + 16, 4);
    std::map<std::string, std::string> members;
    for (std::uint64_t i = 0; i < count; ++i) {
      Require(at, kDirectoryEntry);
      const std::uint64_t name_size = Number(at + 28, 2);
      const std::string name(Bytes(at + 46, name_size));
      members[name] = ReadMember(at, name);
      at += 46 + name_size + Number(at + 30, 2) + Number(at + 32, 2);
    }
    return members;
  }

 private:
  [[noreturn]] void Fail(const std::string& problem) const { throw InputError(source_ + ": " + problem); }

  [[nodiscard]] std::string_view Bytes(std::uint64_t at, std::uint64_t size) const {
    if (at > bytes_.size() || size > bytes_.size() - at) Fail("is damaged: it ends too early");
    return bytes_.substr(at, size);
  }
  void Require(std::uint64_t at, std::string_view mark) const {
    if (Bytes(at, mark.size()) != mark) Fail("is damaged: no entry where one must be");
  }
  /// Little endian.
  [[nodiscard]] std::uint64_t Number(std::uint64_t at, std::uint64_t size) const {
    std::uint64_t value = 0;
    const std::string_view digits = Bytes(at, size);
    for (size_t i = digits.size(); i-- > 0;) value = value << 8 | static_cast<unsigned char>(digits[i]);
    return value;
  }

  [[nodiscard]] std::string ReadMember(std::uint64_t entry, const std::string& name) const {
    constexpr std::uint64_t kEncrypted = 1;
    const std::uint64_t method = Number(entry + 10, 2);
    const std::uint64_t packed = Number(entry + 20, 4);
    const std::uint64_t size = Number(entry + 24, 4);
    const std::uint64_t start = Number(entry + 42, 4);
    const bool is_readable = (Number(entry + 8, 2) & kEncrypted) == 0 &&
                             (method == kStored || method == kDeflated) && packed != kZip64 &&
                             size != kZip64 && start != kZip64;
    if (!is_readable)
      Fail(Quote(name) + ": must be stored or deflated, not encrypted, and smaller than 4 GB");
    Require(start, kMember);
    const std::uint64_t data = start + 30 + Number(start + 26, 2) + Number(start + 28, 2);
    const std::string_view stored = Bytes(data, packed);
    std::string content = method == kStored ? std::string(stored) : Inflate(stored, size, name);
    const uLong sum = crc32_z(0, reinterpret_cast<const Bytef*>(content.data()), content.size());
    if (content.size() != size || sum != Number(entry + 16, 4))
      Fail(Quote(name) + ": is damaged: its sum differs");
    return content;
  }

  [[nodiscard]] std::string Inflate(std::string_view packed, std::uint64_t size,
                                    const std::string& name) const {
    // Deflate packs at most about a thousand to one.
    constexpr std::uint64_t kMostPacked = 1100;
    if (size > kMostPacked * (packed.size() + 1)) Fail(Quote(name) + ": is damaged: it cannot be that large");
    std::string content(size, '\0');
    z_stream stream{};
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
    stream.avail_in = static_cast<uInt>(packed.size());
    stream.next_out = reinterpret_cast<Bytef*>(content.data());
    stream.avail_out = static_cast<uInt>(content.size());
    constexpr int kRaw = -15;  // no header of zlib's own
    if (inflateInit2(&stream, kRaw) != Z_OK) throw std::bad_alloc();
    const int status = inflate(&stream, Z_FINISH);
    inflateEnd(&stream);
    if (status != Z_STREAM_END) Fail(Quote(name) + ": is damaged: it cannot be unpacked");
    return content;
  }

  std::string_view bytes_;
  const std::string& source_;
};

}  // namespace

std::map<std::string, std::string> ReadNpz(std::string_view bytes, const std::string& source) {
  return NpzReader(bytes, source).Read();
}

}  // namespace dexcheck
