#include "harness/report/simplify_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace dexcheck {
namespace {

constexpr double kFinest = 400.0;  // cells along the longest side
constexpr double kCoarsening = 1.3;

using Cell = std::array<int, 3>;

struct Cluster {
  std::array<double, 3> sum{};
  int count = 0;
  int index = 0;
};

/// @param size of a cell's edge, m.
TriangleMesh Cluster(const TriangleMesh& mesh, double size) {
  std::map<Cell, struct Cluster> clusters;
  std::vector<int> where;
  for (const std::array<float, 3>& p : mesh.vertices) {
    Cell cell;
    for (size_t k = 0; k < 3; ++k) cell[k] = static_cast<int>(std::floor(p[k] / size));
    auto [found, is_new] = clusters.try_emplace(cell);
    struct Cluster& cluster = found->second;
    if (is_new) cluster.index = static_cast<int>(clusters.size()) - 1;
    for (size_t k = 0; k < 3; ++k) cluster.sum[k] += p[k];
    ++cluster.count;
    where.push_back(cluster.index);
  }
  TriangleMesh coarse;
  coarse.vertices.resize(clusters.size());
  for (const auto& [cell, cluster] : clusters) {
    for (size_t k = 0; k < 3; ++k) {
      coarse.vertices[static_cast<size_t>(cluster.index)][k] =
          static_cast<float>(cluster.sum[k] / cluster.count);
    }
  }
  std::set<std::array<int, 3>> known;
  for (const std::array<int, 3>& face : mesh.faces) {
    std::array<int, 3> corners;
    for (size_t k = 0; k < 3; ++k) corners[k] = where[static_cast<size_t>(face[k])];
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    // The same face whichever corner it begins with.
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    if (known.insert(corners).second) coarse.faces.push_back(corners);
  }
  return coarse;
}

}  // namespace

TriangleMesh SimplifyMesh(const TriangleMesh& mesh, size_t most_faces) {
  if (mesh.faces.size() <= most_faces || mesh.vertices.empty()) return mesh;
  double extent = 0.0;
  for (size_t k = 0; k < 3; ++k) {
    const auto [low, high] = std::minmax_element(mesh.vertices.begin(), mesh.vertices.end(),
                                                 [k](const auto& a, const auto& b) { return a[k] < b[k]; });
    extent = std::max(extent, static_cast<double>((*high)[k]) - (*low)[k]);
  }
  TriangleMesh coarse;
  for (double cells = kFinest; cells > 1.0; cells /= kCoarsening) {
    coarse = Cluster(mesh, extent / cells);
    if (coarse.faces.size() <= most_faces) break;
  }
  return coarse;
}

}  // namespace dexcheck
