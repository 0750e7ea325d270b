#include <strings.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string_view>
#include <vector>

#include "controller/common/errors.h"
#include "harness/base/files.h"
#include "harness/engine/mjcf_passes.h"

namespace dexcheck {
namespace {

/// Largest coordinate of an STL that the engine accepts.
constexpr double kLargestCoordinate = 1 << 30;

/// The vertices of a mesh.
class Cloud {
 public:
  /// Adds a point. @return whether the engine can compute with it.
  bool Add(const Eigen::Vector3d& p) {
    if (!(p.cwiseAbs().maxCoeff() <= kLargestCoordinate)) return false;  // nan too
    points_.push_back(p);
    return true;
  }
  [[nodiscard]] size_t size() const { return points_.size(); }

  /// Whether a mesh has no tetrahedron, and so no hull by the engine (qhull): each corner is the point
  /// farthest from those before.
  [[nodiscard]] bool IsFlat() const {
    if (points_.size() < 4) return true;
    const auto farthest = [&](const auto& distance) {
      size_t best = 0;
      for (size_t i = 1; i < points_.size(); ++i) {
        if (distance(points_[i]) > distance(points_[best])) best = i;
      }
      return points_[best];
    };
    const Eigen::Vector3d a = farthest([](const Eigen::Vector3d& p) { return p.x(); });
    const Eigen::Vector3d b = farthest([&](const Eigen::Vector3d& p) { return (p - a).norm(); });
    const Eigen::Vector3d along = (b - a).normalized();
    const Eigen::Vector3d c = farthest([&](const Eigen::Vector3d& p) { return (p - a).cross(along).norm(); });
    const Eigen::Vector3d normal = along.cross(c - a).normalized();
    const auto height = [&](const Eigen::Vector3d& p) { return std::abs((p - a).dot(normal)); };
    const double size = std::max((b - a).norm(), a.norm());
    // Products of three coordinates and their sums: tens of roundings.
    return height(farthest(height)) <= 100.0 * std::numeric_limits<double>::epsilon() * size;
  }

 private:
  std::vector<Eigen::Vector3d> points_;
};

std::string DescribeRange(const std::string& what, size_t index) {
  return what + " " + std::to_string(index) + " must be finite and at most 2^30";
}

template <typename Number>
Number ReadAt(std::string_view bytes, size_t offset) {
  Number value;
  std::memcpy(&value, bytes.data() + offset, sizeof(value));
  return value;
}

Eigen::Vector3d ReadPoint(std::string_view bytes, size_t offset) {
  return {ReadAt<float>(bytes, offset), ReadAt<float>(bytes, offset + 4), ReadAt<float>(bytes, offset + 8)};
}

std::string CheckStl(std::string_view bytes, Cloud* cloud) {
  constexpr size_t kHeader = 84;
  constexpr size_t kFace = 50;
  constexpr size_t kMostFaces = 200000;
  if (bytes.size() < kHeader) return "is shorter than the header of a binary STL";
  const size_t faces = ReadAt<std::uint32_t>(bytes, kHeader - 4);
  if (bytes.size() - kHeader != faces * kFace)
    return "is no binary STL: it says " + std::to_string(faces) + " faces and has " +
           std::to_string(bytes.size()) + " bytes";
  if (faces < 1 || faces > kMostFaces) return "must have 1 to 200000 faces, got " + std::to_string(faces);
  for (size_t i = 0; i < 3 * faces; ++i) {
    const size_t offset = kHeader + kFace * (i / 3) + 12 * (i % 3 + 1);
    if (!cloud->Add(ReadPoint(bytes, offset))) return DescribeRange("vertex of face", i / 3 + 1);
  }
  return {};
}

/// Sizes (vertices, normals, texture coordinates, faces), vertices, normals, texture coordinates, faces.
std::string CheckMsh(std::string_view bytes, Cloud* cloud) {
  constexpr size_t kHeader = 16;
  if (bytes.size() < kHeader) return "is shorter than the header of an MSH";
  std::array<std::int64_t, 4> sizes{};
  for (size_t i = 0; i < 4; ++i) sizes[i] = ReadAt<std::int32_t>(bytes, 4 * i);
  const auto [vertices, normals, texture, faces] = sizes;
  const bool has_sizes = vertices >= 4 && faces >= 0 && (normals == 0 || normals == vertices) &&
                         (texture == 0 || texture == vertices);
  const std::int64_t start = 16 + 12 * vertices + 12 * normals + 8 * texture;
  if (!has_sizes || static_cast<std::int64_t>(bytes.size()) != start + 12 * faces)
    return "is no MSH: its header does not fit its " + std::to_string(bytes.size()) + " bytes";
  for (std::int64_t i = 0; i < vertices; ++i) {
    if (!cloud->Add(ReadPoint(bytes, kHeader + 12 * static_cast<size_t>(i))))
      return DescribeRange("vertex", static_cast<size_t>(i) + 1);
  }
  for (std::int64_t i = 0; i < 3 * faces; ++i) {
    const std::int64_t vertex = ReadAt<std::int32_t>(bytes, static_cast<size_t>(start + 4 * i));
    if (vertex < 0 || vertex >= vertices)
      return "face " + std::to_string(i / 3 + 1) + " has vertex " + std::to_string(vertex) + " of " +
             std::to_string(vertices);
  }
  return {};
}

/// The lines that the engine's reader takes: vertices, and faces as "vertex/texture/normal", counted from 1
/// or back from the last.
class ObjCheck {
 public:
  explicit ObjCheck(Cloud* cloud) : cloud_(*cloud) {}

  std::string Run(const std::string& text) {
    for (const char* line = text.c_str(); *line != '\0';) {
      std::string fault = ReadLine(line + std::strspn(line, " \t"));
      if (!fault.empty()) return fault;
      line += std::strcspn(line, "\r\n");
      line += std::strspn(line, "\r\n");
    }
    constexpr std::array<const char*, 3> kNames = {"vertex", "texture coordinate", "normal"};
    for (size_t kind = 0; kind < kNames.size(); ++kind) {
      if (largest_[kind] > counts_[kind])
        return "a face has " + std::string(kNames[kind]) + " " + std::to_string(largest_[kind]) + " of " +
               std::to_string(counts_[kind]);
      // Without faces each vertex has its own.
      if (!has_faces_ && counts_[kind] != 0 && counts_[kind] != counts_[0])
        return "has " + std::to_string(counts_[0]) + " vertices without faces, and " +
               std::to_string(counts_[kind]) + " of " + kNames[kind];
    }
    return {};
  }

 private:
  std::string ReadLine(const char* line) {
    const auto begins = [&](std::string_view word) {
      return std::strncmp(line, word.data(), word.size()) == 0 &&
             (line[word.size()] == ' ' || line[word.size()] == '\t');
    };
    // Tags of subdivision have sizes that the engine's reader allocates unseen.
    if (begins("t")) return "has subdivision tags (t), which cannot be read";
    if (begins("vt")) ++counts_[1];
    if (begins("vn")) ++counts_[2];
    if (begins("f")) return ReadFace(line + 1);
    if (!begins("v")) return {};
    ++counts_[0];
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    const char* at = line + 1;
    for (double& coordinate : point) {
      at += std::strspn(at, " \t");
      coordinate = std::strtod(std::string(at, std::strcspn(at, " \t\r\n")).c_str(), nullptr);
      at += std::strcspn(at, " \t\r\n");
    }
    if (!cloud_.Add(point)) return DescribeRange("vertex", static_cast<size_t>(counts_[0]));
    return {};
  }

  std::string ReadFace(const char* at) {
    for (int corners = 0;; ++corners) {
      at += std::strspn(at, " \t");
      if (*at == '\0' || *at == '\r' || *at == '\n') {
        has_faces_ |= corners == 3 || corners == 4;
        return {};
      }
      for (size_t kind = 0;; ++kind) {
        const long index = std::strtol(at, nullptr, 10);
        if (kind < 3) {
          if (index < -counts_[kind]) return "a face has index " + std::to_string(index);
          largest_[kind] = std::max(largest_[kind], index);
        }
        at += std::strcspn(at, "/ \t\r\n");
        if (*at != '/') break;
        ++at;
        if (*at == ' ' || *at == '\t' || *at == '\r' || *at == '\n' || *at == '\0') break;
      }
    }
  }

  Cloud& cloud_;
  std::array<long, 3> counts_{};   // vertices, texture coordinates, normals so far
  std::array<long, 3> largest_{};  // index of faces, each
  bool has_faces_ = false;         // that are no polygons, which the engine's reader may drop
};

}  // namespace

std::string FindMeshFault(const std::filesystem::path& file) {
  const std::string name = file.string();
  const char* const kind = name.c_str() + name.size() - std::min<size_t>(name.size(), 3);
  const auto is = [&](const char* ending) { return ::strcasecmp(kind, ending) == 0; };
  if (!is("stl") && !is("obj") && !is("msh")) return "must be an STL, OBJ or MSH";
  if (!Exists(file)) return "does not exist";
  std::string bytes;
  try {
    bytes = ReadBytes(file, kMostData);
  } catch (const InputError&) {
    return "cannot be read";
  }
  Cloud cloud;
  std::string fault = is("stl")   ? CheckStl(bytes, &cloud)
                      : is("msh") ? CheckMsh(bytes, &cloud)
                                  : ObjCheck(&cloud).Run(bytes);
  if (fault.empty() && cloud.IsFlat()) fault = "is flat: no four of its vertices make a tetrahedron";
  return fault;
}

}  // namespace dexcheck
