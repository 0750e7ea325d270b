#include "harness/descriptions/description_check.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "harness/descriptions/engine_coupling.h"
#include "harness/descriptions/join_names.h"
#include "harness/engine/engine.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

// Both sides read decimal numbers and form at most short sums and products of them.
constexpr double kRowRounding = 64.0 * std::numeric_limits<double>::epsilon();

class DescriptionCheck {
 public:
  DescriptionCheck(const RobotDescription& robot, const Adapter& adapter, bool ignores_couplings,
                   ConstantChecks* constants)
      : robot_(robot),
        adapter_(adapter),
        engine_(adapter.engine()),
        ignores_couplings_(ignores_couplings),
        constants_(*constants) {}

  std::vector<std::string> Run() {
    CheckCouplings();
    return notes_;
  }

 private:
  /// Takes back findings of the constant checks about what it believes that only the engine has. The check
  /// goes with the last of them.
  void TakeBack(const std::string& check, const std::function<bool(const ConstantFinding&)>& is_known) {
    std::erase_if(constants_.findings, [&](const ConstantFinding& finding) {
      return finding.check == check && is_known(finding);
    });
    const bool has_more = std::any_of(constants_.findings.begin(), constants_.findings.end(),
                                      [&](const ConstantFinding& finding) { return finding.check == check; });
    if (has_more) return;
    std::erase_if(constants_.records, [&](const CheckRecord& record) { return record.name == check; });
  }

  void Compare(CheckRecord* record, int joint, double model, double engine, int entry) {
    const Location where{Location::Kind::kJoint, joint, -1};
    const double size = std::max(std::abs(model), std::abs(engine));
    const double error = record->Compare(model, engine, size > 0.0 ? size : 1.0, where, -1);
    if (error <= kRowRounding) return;
    const RobotModel& described = adapter_.model();
    constants_.findings.push_back({record->name, Describe(where, described, described.num_base_velocities()),
                                   model, engine, where, entry});
  }

  /// The description's index of a joint of the engine's model; -1 when it has none.
  [[nodiscard]] int FindIndex(int engine_joint) const {
    const std::vector<int>& ids = adapter_.joint_ids();
    const auto found = std::find(ids.begin(), ids.end(), engine_joint);
    return found == ids.end() ? -1 : static_cast<int>(found - ids.begin());
  }

  void CheckCouplings() {
    std::vector<std::string> only_there;
    std::vector<std::string> constraints;
    for (size_t i = 0; i < robot_.joints.size(); ++i) {
      const Joint& described = robot_.spec.joints[i];
      const std::optional<JointCoupling>& own = described.coupling;
      const std::optional<JointCoupling> other = FindEngineCoupling(engine_, adapter_.joint_ids()[i]);
      const int joint = static_cast<int>(i);
      if (other && (own || ignores_couplings_)) {
        constraints.push_back(
            "constraint " +
            NameOf(engine_, mjOBJ_EQUALITY, FindCouplingConstraint(engine_, adapter_.joint_ids()[i])));
      }
      if (ignores_couplings_) continue;
      if (own && !other) {
        const std::string leader = robot_.spec.joints[static_cast<size_t>(own->leader)].name;
        constants_.Add({"joint_coupling",
                        Describe({Location::Kind::kJoint, joint, -1}, adapter_.model(), 0),
                        own->multiplier,
                        0.0,
                        {Location::Kind::kJoint, joint, -1},
                        1,
                        false,
                        "only " + robot_.spec.source + " states it: it follows " + leader});
      }
      if (!own && other) only_there.push_back(described.name);
      if (!own || !other) continue;
      CheckRecord* const record = constants_.Define("joint_coupling");
      Compare(record, joint, own->leader, FindIndex(other->leader), 0);
      Compare(record, joint, own->multiplier, other->multiplier, 1);
      Compare(record, joint, own->offset, other->offset, 2);
    }
    if (!constraints.empty()) {
      TakeBack("equality_constraint", [&](const ConstantFinding& finding) {
        return std::find(constraints.begin(), constraints.end(), finding.where) != constraints.end();
      });
    }
    if (only_there.empty()) return;
    notes_.push_back("coupled joints: only the MJCF couples " + JoinNames(only_there) +
                     "; terms are compared with all joints free");
  }

  const RobotDescription& robot_;
  const Adapter& adapter_;
  const mjModel& engine_;
  bool ignores_couplings_;
  ConstantChecks& constants_;
  std::vector<std::string> notes_;
};

}  // namespace

int FindCouplingConstraint(const mjModel& engine, int joint) {
  for (int eq = 0; eq < engine.neq; ++eq) {
    if (engine.eq_type[eq] != mjEQ_JOINT || GetEqualityActive(engine)[eq] == 0) continue;
    if (engine.eq_obj1id[eq] != joint || engine.eq_obj2id[eq] < 0) continue;
    const mjtNum* a = engine.eq_data + mjNEQDATA * eq;
    if (a[2] == 0.0 && a[3] == 0.0 && a[4] == 0.0) return eq;
  }
  return -1;
}

std::optional<JointCoupling> FindEngineCoupling(const mjModel& engine, int joint) {
  const int eq = FindCouplingConstraint(engine, joint);
  if (eq < 0) return std::nullopt;
  // q1 - q1_0 = a0 + a1 (q2 - q2_0)
  const mjtNum* a = engine.eq_data + mjNEQDATA * eq;
  const int leader = engine.eq_obj2id[eq];
  const double q1_0 = engine.qpos0[engine.jnt_qposadr[joint]];
  const double q2_0 = engine.qpos0[engine.jnt_qposadr[leader]];
  return JointCoupling{leader, a[1], a[0] + q1_0 - a[1] * q2_0};
}

std::vector<std::string> CheckDescription(const RobotDescription& robot, const Adapter& adapter,
                                          ConstantChecks* constants, bool ignores_couplings) {
  return DescriptionCheck(robot, adapter, ignores_couplings, constants).Run();
}

}  // namespace dexcheck
