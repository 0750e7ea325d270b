#include "harness/descriptions/body_comparison.h"

#include <algorithm>
#include <cmath>

#include "controller/model/rigid_body.h"
#include "harness/descriptions/description_match.h"
#include "harness/descriptions/link_frame_tree.h"

namespace dexcheck {
namespace {

/// Radius of gyration, m.
double CalcGyration(const MassProperties& body) {
  return std::sqrt(body.inertia.trace() / (2.0 * body.mass));
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

std::vector<Pose> PlaceLinkFrames(const RobotDescription& a, const RobotDescription& b) {
  const std::vector<int> b_of_a = MatchJoints(a.spec, b.spec);
  const std::vector<Pose> poses_a = CalcZeroPoses(a);
  const std::vector<Pose> poses_b = CalcZeroPoses(b);
  std::vector<Pose> placed(b_of_a.size(), Pose::Identity());
  for (size_t i = 0; i < placed.size(); ++i) {
    if (b_of_a[i] < 0) continue;
    placed[i] = poses_a[i + 1].inverse(Eigen::Isometry) * poses_b[static_cast<size_t>(b_of_a[i] + 1)];
  }
  return placed;
}

ConstantChecks CompareBodies(const RobotDescription& a, const RobotDescription& b,
                             const std::vector<Pose>& X_ab) {
  ConstantChecks result;
  const RobotModel model(a.spec);
  BodyComparison comparison(model, &result);
  if (a.spec.base.type == BaseType::kFloating) comparison.CompareLink(-1, a.spec.base.body, b.spec.base.body);
  const std::vector<int> b_of_a = MatchJoints(a.spec, b.spec);
  const std::vector<JointInLinkFrames> rows_a = ListJointsInLinkFrames(a);
  const std::vector<JointInLinkFrames> rows_b = ListJointsInLinkFrames(b);
  for (size_t i = 0; i < rows_a.size(); ++i) {
    if (b_of_a[i] < 0) continue;
    const MassProperties& other = rows_b[static_cast<size_t>(b_of_a[i])].body;
    comparison.CompareLink(static_cast<int>(i), rows_a[i].body,
                           X_ab.empty() ? other : ExpressIn(other, X_ab[i]));
  }
  return result;
}

}  // namespace dexcheck
