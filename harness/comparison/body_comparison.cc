#include "harness/comparison/body_comparison.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>

#include "controller/model/rigid_body.h"
#include "harness/base/worst.h"
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
    const double length = Worst(CalcGyration(a), a.com.norm(), b.com.norm());
    for (int k = 0; k < 3; ++k) Compare("link_com", AtLink(link), a.com[k], b.com[k], length);
    const double inertia = Worst(MaxAbs(a.inertia), MaxAbs(b.inertia));
    for (const auto& [row, col] : kEntries)
      Compare("link_inertia", AtLink(link), a.inertia(row, col), b.inertia(row, col), inertia);
  }
};

/// The joint that moves a body; none of what the description does not have. -1 is the base.
std::optional<int> FindJointOf(const std::string& body, const RobotDescription& robot) {
  const auto part = std::ranges::find(robot.parts, body, &DescribedPart::name);
  return part == robot.parts.end() ? std::nullopt : std::optional(part->joint);
}

const MassProperties& FindBody(int joint, const RobotSpec& spec) {
  return joint < 0 ? spec.base.body : spec.joints[static_cast<size_t>(joint)].body;
}

}  // namespace

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

void NameCompiledChanges(const std::vector<CompiledChange>& changes,
                         const std::array<const RobotDescription*, 2>& robots, size_t side,
                         ConstantChecks* constants, std::vector<std::string>* notes) {
  constexpr double kSame = 0.01;  // of what the text states, which the other file prints with other digits
  const RobotDescription& own = *robots[side];
  const RobotDescription& other = *robots[1 - side];
  const std::string file = std::filesystem::path(own.spec.source).filename().string();
  const std::vector<int> match = MatchJoints(own.spec, other.spec);
  std::map<std::string, std::pair<std::string, int>> first_of;  // by setting, and how many more
  for (const CompiledChange& change : changes) {
    const bool is_mass = change.stated.size() == 1;
    const std::string effect =
        fmt::format("{} of {}'s compiler changed the {} of {} from {:.6g} to {:.6g} {}", change.setting, file,
                    is_mass ? "mass" : "moments of inertia", change.body, fmt::join(change.stated, ", "),
                    fmt::join(change.made, ", "), is_mass ? "kg" : "kg m^2");
    const auto [line, is_new] = first_of.emplace(change.setting, std::pair(effect, 0));
    line->second.second += is_new ? 0 : 1;
    const std::optional<int> joint = FindJointOf(change.body, own);
    if (!joint || (*joint >= 0 && match[static_cast<size_t>(*joint)] < 0)) continue;
    const int joint_there = *joint < 0 ? -1 : match[static_cast<size_t>(*joint)];
    const RobotSpec& first = robots[0]->spec;
    const int joint_first = side == 0 ? *joint : joint_there;
    const std::string where =
        "link " + (joint_first < 0 ? first.base.link : first.joints[static_cast<size_t>(joint_first)].link);
    if (is_mass) {
      for (ConstantFinding& finding : constants->findings) {
        if (finding.check == "link_mass" && finding.where == where) finding.effect = effect;
      }
      continue;
    }
    const Vector3d stated(change.stated.data()), made(change.made.data());
    const Vector3d there = CalcMoments(FindBody(joint_there, other.spec).inertia);
    const double apart = (there - stated).norm();
    if (apart > kSame * stated.norm() || apart >= (there - made).norm()) continue;
    Eigen::Index k = 0;
    for (const Eigen::Index i : {1, 2}) {
      if (std::abs(made[i] - stated[i]) > std::abs(made[k] - stated[k])) k = i;
    }
    constants->Add({"compiled_inertia", where, side == 0 ? made[k] : stated[k],
                    side == 0 ? stated[k] : made[k], AtLink(joint_first), static_cast<int>(k), effect});
  }
  for (const auto& [setting, line] : first_of)
    notes->push_back(line.first + (line.second > 0 ? fmt::format(", and {} more", line.second) : ""));
}

}  // namespace dexcheck
