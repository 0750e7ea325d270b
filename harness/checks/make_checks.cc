#include <algorithm>
#include <initializer_list>
#include <map>
#include <set>

#include "harness/checks/run_checks.h"

namespace dexcheck {
namespace {

using Names = std::initializer_list<std::string_view>;

/// Whether only stiffness holds joints that do not carry the object. Imperfections move them, and so do the
/// Coriolis forces and the friction that kPdGravity leaves to it; the least motion in the metric of M_bar'
/// contains them.
bool HoldsIdleJoints(const Setup& setup) {
  const ControlOptions& control = setup.scenario().control;
  return !setup.hold().idle_joints.empty() && setup.scenario().imperfections.is_ideal() &&
         control.law != ControlLaw::kPdGravity && control.law != ControlLaw::kOperationalSpace &&
         control.weight != RedundancyWeight::Kind::kMass;
}

/// Checks that the run does not have.
std::set<std::string_view> ListMissing(const Setup& setup, const JudgedLaw* law) {
  const Scenario& scenario = setup.scenario();
  std::set<std::string_view> missing;
  const auto leave_out = [&](bool leave, Names names) {
    if (leave) missing.insert(names);
  };
  const bool joints = setup.joints() != nullptr;
  const bool rigid = scenario.plant.type == PlantType::kRigid;
  leave_out(law == nullptr,
            {"law_torque", "law_demand", "grasp_null_space", "grasp_cone", "grasp_optimality"});
  leave_out(law == nullptr || !law->CalcSpectralRadius(), {"closed_loop_spectral_radius"});
  leave_out(law == nullptr || !law->has_demand(), {"law_demand"});
  leave_out(law == nullptr || !law->follows_error(),
            {"error_dynamics", "orientation_dynamics", "joint_dynamics"});
  leave_out(!scenario.expect.position, {"expect_position"});
  leave_out(!scenario.expect.orientation, {"expect_orientation"});
  leave_out(!scenario.expect.joints, {"expect_joints"});
  leave_out(joints, {"law_demand", "grasp_null_space", "grasp_cone", "grasp_optimality", "error_dynamics",
                     "orientation_dynamics", "fingertip_slip", "fingertip_slip_rate", "cone_use",
                     "contacts_lost", "penetration", "kappa"});
  const bool stands = !setup.feet().empty();
  leave_out(joints && !stands, {"reduced_acceleration", "contact_force"});
  leave_out(!stands, {"foot_slip", "foot_slip_rate", "foot_cone_use", "feet_lost", "foot_penetration",
                      "foot_distance"});
  leave_out(stands, {"base_tilt"});
  // Implicit damping is predicted for joints that move by themselves, at the true state.
  const bool predicts_damping = setup.model().base().type != BaseType::kDifferentialDrive &&
                                scenario.imperfections.is_ideal() &&
                                setup.engine().opt.integrator != mjINT_IMPLICIT;
  leave_out(!joints || (scenario.plant.implicit_damping && !predicts_damping), {"joint_dynamics"});
  leave_out(!setup.start().bonds.empty(),
            {"fingertip_slip_rate", "cone_use", "contacts_lost", "penetration", "kappa"});
  leave_out(setup.adapter().wheels().empty(), {"wheel_slip", "wheel_slip_rate", "rolling", "traction_use"});
  leave_out(setup.model().base().type == BaseType::kFixed, {"base_tilt"});
  leave_out(!scenario.grasp.hemisphere, {"fingertip_rim"});
  leave_out(!setup.has_object(), {"inverse_dynamics_object"});
  leave_out(!HoldsIdleJoints(setup), {"idle_joints"});
  // A rigid plant's wheels roll, its base is upright and its equations are solved, whatever happens.
  leave_out(rigid, {"mass_matrix", "bias_force", "equations_of_motion", "wheel_slip", "rolling",
                    "wheel_slip_rate", "traction_use", "base_tilt", "solver"});
  leave_out(rigid || !ConstraintLaw::Applies(setup.engine()), {"constraint_force"});
  leave_out(setup.robots().watched_pairs.empty(), {"clearance", "collision"});
  leave_out(!LetsBodiesPush(scenario.plant, setup.engine()), {"collision"});
  const mjModel& engine = setup.engine();
  const auto* const limited = engine.actuator_ctrllimited;
  // Torques that a scenario lets be cut off are no fault of the run.
  leave_out(std::none_of(limited, limited + engine.nu, [](auto flag) { return flag != 0; }) ||
                scenario.imperfections.actuation.saturates(),
            {"actuator_effort"});
  return missing;
}

/// Descriptions that differ from those of check_table.cc.
std::map<std::string_view, const char*> ListDescriptions(const Setup& setup) {
  if (!setup.feet().empty()) {
    return {
        {"closed_loop_spectral_radius",
         "largest eigenvalue of the sampled errors of base and joints under the scenario's gains"},
        {"law_torque",
         "torques and demanded ground forces against the law from the engine's terms, relative to all "
         "forces"},
        {"inverse_dynamics_robot", "the robot's part of that residual, relative to the forces that balance"},
        {"reduced_acceleration", "xi_dot of the robot on rigid feet that do not slip, against the engine's"},
        {"contact_force",
         "foot forces of the rigid system against the engine's, over them and the weight; 0: not determined"},
        {"solver", "remainder of the engine's solver in its equations of motion"}};
  }
  if (setup.joints() != nullptr) {
    return {
        {"closed_loop_spectral_radius",
         "largest eigenvalue of the sampled joint errors under the scenario's gains"},
        {"law_torque",
         "torques sent against the law from the engine's terms, relative to the forces that balance"},
        {"inverse_dynamics_robot", "the robot's part of that residual, relative to the forces that balance"},
        {"solver", "remainder of the engine's solver in its equations of motion"}};
  }
  if (!setup.start().bonds.empty())
    return {{"fingertip_slip", "distance of the joined points on fingertip and object"}};
  return {};
}

/// Returns the bound of a check, with the scenario's own [bounds] and [expect].
double FindBound(const CheckInfo& info, const Scenario& scenario) {
  double bound = CalcBound(info, scenario);
  if (info.name == "expect_position") bound = scenario.expect.position.value_or(0.0);
  if (info.name == "expect_orientation") bound = scenario.expect.orientation.value_or(0.0);
  if (info.name == "expect_joints") bound = scenario.expect.joints.value_or(0.0);
  for (const BoundOverride& stated : scenario.bounds)
    if (stated.first == info.name) bound = CalcStatedBound(info, stated, scenario);
  return bound;
}

}  // namespace

std::unique_ptr<JudgedLaw> MakeJudgedLaw(const Setup& setup, bool knows_law) {
  if (!knows_law) return nullptr;
  if (setup.joints() != nullptr) return MakeJointLaw(setup);
  return setup.scenario().pick_task() != nullptr ? nullptr : MakeObjectLaw(setup);
}

std::vector<Judge> MakeChecks(const Setup& setup, const JudgedLaw* law) {
  RequireKnownBounds(setup.scenario());
  const std::set<std::string_view> missing = ListMissing(setup, law);
  const std::map<std::string_view, const char*> descriptions = ListDescriptions(setup);
  std::vector<Judge> checks;
  for (const CheckInfo& info : ListChecks()) {
    if (missing.contains(info.name)) continue;
    Judge& judge = checks.emplace_back();
    judge.info = &info;
    if (info.by.make != nullptr) judge.state = info.by.make(setup);
    judge.record.name = info.name;
    judge.record.kind = info.category;
    judge.record.unit = info.unit;
    judge.record.bound = FindBound(info, setup.scenario());
    // A rigid plant integrates the equations that its forces are put into.
    judge.record.same_source =
        setup.scenario().plant.type == PlantType::kRigid &&
        (info.category == CheckCategory::kInverseDynamics || info.meaning.rank == Rank::kPrediction);
    const bool has_contacts = setup.joints() == nullptr && setup.start().bonds.empty();
    judge.record.is_empty = info.name == "contact_distance" && !has_contacts;
    const auto own = descriptions.find(info.name);
    judge.record.description = own == descriptions.end() ? info.description : own->second;
  }
  return checks;
}

}  // namespace dexcheck
