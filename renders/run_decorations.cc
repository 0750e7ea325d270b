#include "renders/run_decorations.h"

#include <algorithm>
#include <cmath>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "renders/canvas.h"

namespace dexcheck {
namespace {

const Color kForce = MakeColor(0xe0102e);
const Color kCone = MakeColor(0x2fb7ff, 0.30F);

// Sizes that suit a hand, m.
constexpr double kLongestForce = 0.042;
constexpr double kConeHeight = 0.026;
constexpr double kForceRadius = 0.0018;

Vector3d ContactVector(const RowMatrixXd& rows, long row, long contact) {
  return rows.block<1, 3>(row, 3 * contact).transpose();
}

}  // namespace

std::vector<Decoration> MakeForces(const RunFrames& run, long row, double meters_per_newton) {
  std::vector<Decoration> decorations;
  if (run.contact_forces.size() == 0) return decorations;
  for (long k = 0; k < run.contacts(); ++k) {
    const Vector3d p = ContactVector(run.contact_positions, row, k);
    const Vector3d force = ContactVector(run.contact_forces, row, k);
    if (!p.allFinite() || !force.allFinite() || force.isZero()) continue;
    decorations.emplace_back(Arrow{p, p + meters_per_newton * force, kForceRadius, kForce});
    if (run.contact_normals.size() == 0 || !(run.friction > 0.0)) continue;
    const Vector3d normal = ContactVector(run.contact_normals, row, k);
    if (!normal.allFinite() || normal.isZero()) continue;
    decorations.emplace_back(Cone{p, normal.normalized(), kConeHeight, std::atan(run.friction), kCone});
  }
  return decorations;
}

void SetRow(const mjModel& model, const RunFrames& run, long row, mjData* data) {
  mju_copy(data->qpos, run.qpos.row(row).data(), static_cast<int>(model.nq));
  mj_kinematics(&model, data);
  mj_comPos(&model, data);
  mj_camlight(&model, data);
}

double CalcMetersPerNewton(const RunFrames& run) {
  double largest = 0.0;
  for (long row = 0; row < run.contact_forces.rows(); ++row) {
    for (long k = 0; k < run.contact_forces.cols() / 3; ++k) {
      const double size = ContactVector(run.contact_forces, row, k).norm();
      if (std::isfinite(size)) largest = std::max(largest, size);
    }
  }
  return largest > 0.0 ? kLongestForce / largest : 1.0;
}

std::vector<LegendEntry> MakeForceLegend(const RunFrames& run) {
  std::vector<LegendEntry> legend;
  if (run.contact_forces.size() == 0) return legend;
  legend.push_back({"force on the object", kForce});
  if (run.friction > 0.0) legend.push_back({"friction cone", {kCone[0], kCone[1], kCone[2], 1.0F}});
  return legend;
}

}  // namespace dexcheck
