#include "harness/descriptions/body_comparison.h"

#include <algorithm>
#include <cmath>

#include "controller/model/rigid_body.h"
#include "harness/descriptions/description_match.h"
#include "harness/descriptions/fault_search.h"

namespace dexcheck {
namespace {

/// Radius of gyration, m.
double CalcGyration(const MassProperties& body) {
  return std::sqrt(body.inertia.trace() / (2.0 * body.mass));
}

/// Sum of the relative distances of two centres of mass and of two inertias.
double CalcDistance(const MassProperties& a, const MassProperties& b) {
  const double length = std::max({CalcGyration(a), a.com.norm(), b.com.norm()});
  const double inertia = std::max(a.inertia.norm(), b.inertia.norm());
  const auto divide = [](double error, double scale) { return scale > 0.0 ? error / scale : error; };
  return divide((a.com - b.com).norm(), length) + divide((a.inertia - b.inertia).norm(), inertia);
}

class BodyComparison : public ConstantComparison {
 public:
  BodyComparison(const RobotModel& model, ConstantChecks* result) : ConstantComparison(model, result) {}

  void CompareLink(int link, const MassProperties& a, const MassProperties& b) {
    constexpr std::pair<int, int> kEntries[] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    if (a.mass <= 0.0 || b.mass <= 0.0) return;
    const double length = std::max({CalcGyration(a), a.com.norm(), b.com.norm()});
    for (int k = 0; k < 3; ++k) Compare("link_com", AtLink(link), a.com[k], b.com[k], length);
    const double inertia = std::max(a.inertia.cwiseAbs().maxCoeff(), b.inertia.cwiseAbs().maxCoeff());
    for (const auto& [row, col] : kEntries)
      Compare("link_inertia", AtLink(link), a.inertia(row, col), b.inertia(row, col), inertia);
  }
};

}  // namespace

std::vector<Pose> RegisterLinks(const RobotDescription& a, const RobotDescription& b) {
  const std::vector<int> b_of_a = MatchJoints(a.spec, b.spec);
  const std::vector<OwnRow> rows_a = ListOwnRows(a);
  const std::vector<OwnRow> rows_b = ListOwnRows(b);
  const std::vector<Pose> poses_a = CalcZeroPoses(a);
  const std::vector<Pose> poses_b = CalcZeroPoses(b);
  std::vector<Pose> registered(rows_a.size(), Pose::Identity());
  std::vector<bool> is_placed(rows_a.size(), false);
  for (size_t i = 0; i < rows_a.size(); ++i) {
    if (b_of_a[i] < 0) continue;
    const auto j = static_cast<size_t>(b_of_a[i]);
    const Pose X_ab = poses_a[i + 1].inverse(Eigen::Isometry) * poses_b[j + 1];
    const MassProperties& own = rows_a[i].body;
    const MassProperties& other = rows_b[j].body;
    if (own.mass > 0.0 && other.mass > 0.0) {
      is_placed[i] = CalcDistance(own, ExpressIn(other, X_ab)) < CalcDistance(own, other);
    } else {
      is_placed[i] = rows_a[i].parent >= 0 && is_placed[static_cast<size_t>(rows_a[i].parent)];
    }
    if (is_placed[i]) registered[i] = X_ab;
  }
  return registered;
}

ConstantChecks CompareBodies(const RobotDescription& a, const RobotDescription& b) {
  ConstantChecks result;
  const RobotModel model(a.spec);
  BodyComparison comparison(model, &result);
  if (a.spec.base.type == BaseType::kFloating) comparison.CompareLink(-1, a.spec.base.body, b.spec.base.body);
  const std::vector<int> b_of_a = MatchJoints(a.spec, b.spec);
  const std::vector<Pose> X_ab = RegisterLinks(a, b);
  const std::vector<OwnRow> rows_b = ListOwnRows(b);
  size_t i = 0;
  for (const OwnRow& own : ListOwnRows(a)) {
    if (b_of_a[i] >= 0) {
      const MassProperties other = ExpressIn(rows_b[static_cast<size_t>(b_of_a[i])].body, X_ab[i]);
      comparison.CompareLink(static_cast<int>(i), own.body, other);
    }
    ++i;
  }
  return result;
}

}  // namespace dexcheck
