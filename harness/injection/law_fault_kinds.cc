// Laws whose torques are not those that they should be: of all joints, or of one joint, wheel or finger.

#include <algorithm>
#include <cmath>

#include "controller/control/joint_controller.h"
#include "controller/control/trajectory_controller.h"
#include "harness/injection/fault_kinds.h"
#include "harness/injection/faulty_law.h"

namespace dexcheck {
namespace law_faults {
namespace {

/// Entries of tau' that belong together.
struct Place {
  std::string name;
  std::vector<Eigen::Index> entries;  ///< Empty for all.
};

Place OneJoint(const FaultContext& context) {
  const Joint& joint = context.DrawJoint();
  return {"law of " + joint.name,
          {context.model().num_base_velocities() + context.model().FindJoint(joint.name)}};
}

Place OneFinger(const FaultContext& context) {
  const std::vector<int>& tips = context.setup.fingertips();
  const Frame& frame = context.model().frames()[static_cast<size_t>(tips[context.draw->Index(tips.size())])];
  Place finger{"law of the finger of " + frame.name, {}};
  const std::vector<int>& arm = context.setup.hold().arm_joints;
  for (int joint = frame.link; joint >= 0;
       joint = context.model().joints()[static_cast<size_t>(joint)].parent)
    if (std::find(arm.begin(), arm.end(), joint) == arm.end())
      finger.entries.push_back(context.model().num_base_velocities() + context.model().dof(joint));
  return finger;
}

Place DrawPlace(const FaultContext& context) {
  const Base& base = context.model().base();
  switch (context.draw->Index(context.rolls() ? 4 : context.holds() ? 3 : 2)) {
    case 0:
      return {"law", {}};
    case 1:
      return OneJoint(context);
    case 2:
      return OneFinger(context);
    default:
      return context.draw->Index(2) == 0 ? Place{"law of " + base.wheel_joint_right, {0}}
                                         : Place{"law of " + base.wheel_joint_left, {1}};
  }
}

double DrawFactor(const FaultContext& context) {
  constexpr double kWhole[] = {0.0, -1.0, 2.0};
  const size_t which = context.draw->Index(6);
  return which < std::size(kWhole) ? kWhole[which] : 1.0 + context.draw->Size(1e-3, 0.3);
}

InjectedFault LawFaultAt(const Place& place, const std::string& fault, double value, double nominal) {
  InjectedFault one = FaultAt(place.name, fault, value, value - nominal);
  one.needs_error = true;
  return one;
}

bool IsOfJoints(const Setup& setup) { return setup.scenario().joint_task() != nullptr; }
bool IsPaperLaw(const FaultContext& context) {
  return !IsOfJoints(context.setup) && context.setup.scenario().control.law == ControlLaw::kComputedTorque;
}
bool KnowsMotion(const FaultContext& context) {
  return context.setup.scenario().control.law != ControlLaw::kPdGravity;
}

/// Whether it is several parts: at one joint all but one of them may vanish, and then it is that one.
bool IsSum(const LawPartName& part) {
  return std::any_of(ListLawParts().begin(), ListLawParts().end(), [&](const LawPartName& other) {
    return other.parts != part.parts && (other.parts & part.parts) == other.parts;
  });
}

InjectedFault Summand(const FaultContext& context) {
  const std::span<const LawPartName> parts = ListLawParts();
  const Place place = DrawPlace(context);
  size_t part = context.draw->Index(parts.size());
  while (!place.entries.empty() && IsSum(parts[part])) part = context.draw->Index(parts.size());
  const double factor = DrawFactor(context);
  InjectedFault one =
      LawFaultAt(place, std::string(parts[part].name) + " (" + parts[part].symbol + "), factor", factor, 1.0);
  one.controller = [fault =
                        LawFault{.name = one.name, .part = part, .factor = factor, .entries = place.entries}](
                       const Setup& setup, std::unique_ptr<Controller> /*right*/, const IsOn& is_on) {
    return std::make_unique<FaultyLaw>(setup, fault, is_on);
  };
  return one;
}

/// A right law of any kind, with something added to its torques.
class ChangedLaw final : public Controller {
 public:
  /// Adds to tau' (n). @param model as the controller evaluated it.
  using Change = std::function<void(const Reading& reading, const GraspModel& model, VectorXd* tau)>;
  ChangedLaw(std::unique_ptr<Controller> right, IsOn is_on, Change change)
      : right_(std::move(right)), is_on_(std::move(is_on)), change_(std::move(change)) {}

  void Follow(const Trajectory& motion) override { right_->Follow(motion); }
  void Begin(double t, const Reading& reading) override { right_->Begin(t, reading); }
  void Step(const Reading& reading, double t, Command* command) override {
    right_->Step(reading, t, command);
    if (is_on_()) change_(reading, right_->model(), &command->tau);
  }
  [[nodiscard]] const GraspModel& model() const override { return right_->model(); }

 private:
  std::unique_ptr<Controller> right_;
  IsOn is_on_;
  Change change_;
};

/// Gravity, or friction, of F_bar' times a factor, by the controller's own model.
template <bool kGravity>
InjectedFault PartOfF(const FaultContext& context) {
  const std::string name = kGravity ? "gravity" : "friction";
  const Place place = DrawPlace(context);
  const double factor = DrawFactor(context);
  InjectedFault one = LawFaultAt(place, name + " (F_bar' (" + name + ")), factor", factor, 1.0);
  one.controller = [=](const Setup& setup, std::unique_ptr<Controller> right, const IsOn& is_on) {
    return std::make_unique<ChangedLaw>(
        std::move(right), is_on,
        [=, actuation = ActuationMap(setup.model())](const Reading&, const GraspModel& model, VectorXd* tau) {
          VectorXd part = kGravity ? model.robot().gravity() : model.robot().friction();
          actuation.CalcTorque(part, part);
          if (place.entries.empty()) *tau += (factor - 1.0) * part;
          for (const Eigen::Index entry : place.entries) (*tau)[entry] += (factor - 1.0) * part[entry];
        });
  };
  return one;
}

/// A torque of one joint that is added. @param get it, by the joint's measured rate.
InjectedFault Added(const FaultContext& context, const char* name, double size,
                    const std::function<double(double rate)>& get) {
  const Place place = OneJoint(context);
  InjectedFault one = LawFaultAt(place, name, size, 0.0);
  one.controller = [get, entry = place.entries.front()](const Setup&, std::unique_ptr<Controller> right,
                                                        const IsOn& is_on) {
    return std::make_unique<ChangedLaw>(std::move(right), is_on,
                                        [=](const Reading& reading, const GraspModel&, VectorXd* tau) {
                                          (*tau)[entry] += get(reading.state.xi[entry]);
                                        });
  };
  return one;
}

InjectedFault AddedTorque(const FaultContext& context) {
  const double torque = context.draw->Size(1e-3, 0.1);
  return Added(context, "torque", torque, [torque](double) { return torque; });
}

/// Where the law has friction it would be a part of that.
InjectedFault AddedFriction(const FaultContext& context) {
  const double friction = context.draw->Positive(1e-2, 1.0);
  return Added(context, "viscous friction", friction, [friction](double rate) { return -friction * rate; });
}

/// The law of the setup's joints with other gains.
std::unique_ptr<Controller> MakeJointController(const Setup& setup, const JointGains& gains) {
  return std::make_unique<JointController>(setup.model(), setup.object().body, setup.surface(),
                                           setup.scenario().control.law, gains, setup.joints()->motion,
                                           setup.MakeSampling());
}

bool CompensatesCoulomb(const FaultContext& context) {
  return IsOfJoints(context.setup) && context.setup.joints()->gains.coulomb.size() > 0;
}

InjectedFault CoulombCompensation(const FaultContext& context) {
  const double factor = DrawFactor(context);
  InjectedFault one = LawFaultAt(
      {"law", {}}, "compensation of Coulomb friction (coulomb tanh(q_d_dot / coulomb_velocity)), factor",
      factor, 1.0);
  one.controller = [factor](const Setup& setup, std::unique_ptr<Controller>, const IsOn&) {
    JointGains gains = setup.joints()->gains;
    gains.coulomb *= factor;
    return MakeJointController(setup, gains);
  };
  return one;
}

/// All gains of position, or of velocity, times a factor, or one of them.
template <bool of_velocity, bool is_one>
InjectedFault Gains(const FaultContext& context) {
  const double factor = 1.0 + context.draw->Size(1e-3, 0.3);
  const bool joints = IsOfJoints(context.setup);
  // The last gains are those of the joints; before them stand those of a base that floats.
  const size_t count = joints ? static_cast<size_t>(context.model().num_dofs()) : 6;
  const size_t axis = context.draw->Index(count);
  const auto change = [=](auto* gains) {
    if (is_one) {
      (*gains)[gains->size() - static_cast<Eigen::Index>(count - axis)] *= factor;
    } else {
      *gains *= factor;
    }
  };
  const size_t part = of_velocity ? 1 : 2;  // in both lists of parts
  const std::string name =
      joints ? (of_velocity ? "velocity feedback (K_v e_dot), factor" : "position feedback (K_p e), factor")
             : std::string(ListLawParts()[part].name) + " (" + ListLawParts()[part].symbol + "), factor";
  const bool computed = context.setup.scenario().control.law == ControlLaw::kComputedTorque;
  constexpr const char* kAxes[] = {"x", "y", "z", "rotation 1", "rotation 2", "rotation 3"};
  const std::string one_name = std::string("gain ") +
                               (of_velocity ? (computed ? "K_v" : "D") : (computed ? "K_p" : "K")) + " of " +
                               (joints     ? context.model().dof_name(static_cast<int>(axis))
                                : axis < 6 ? kAxes[axis]
                                           : "") +
                               ", factor";
  InjectedFault one = LawFaultAt({"law", {}}, is_one ? one_name : name, factor, 1.0);
  // Without the mass matrix it is the feedback in the torque of one joint.
  if (is_one && joints && !computed)
    one = LawFaultAt({"law of " + context.model().dof_name(static_cast<int>(axis)), {}}, name, factor, 1.0);
  one.controller = [=](const Setup& setup, std::unique_ptr<Controller>,
                       const IsOn&) -> std::unique_ptr<Controller> {
    if (const JointPlan* const plan = setup.joints()) {
      JointGains gains = plan->gains;
      for (VectorXd* gain : of_velocity ? std::array{&gains.K_v, &gains.D} : std::array{&gains.K_p, &gains.K})
        change(gain);
      return MakeJointController(setup, gains);
    }
    // Contacts are measured, as the judge takes them to be.
    Sampling sampling = setup.MakeSampling();
    sampling.contacts.reset();
    GraspControllerOptions options = setup.MakeControllerOptions();
    change(of_velocity ? &options.gains.K_v : &options.gains.K_p);
    change(of_velocity ? &options.stiffness.D : &options.stiffness.K);
    // D of an impedance follows from K.
    if (of_velocity) options.stiffness.damping_ratio *= factor;
    return std::make_unique<TrajectoryController>(setup.model(), setup.fingertips(), setup.object().body,
                                                  setup.surface(), options, sampling);
  };
  return one;
}

/// With an impedance another stiffness is another damping, too.
bool HasOwnStiffness(const FaultContext& context) {
  return IsOfJoints(context.setup) || context.setup.scenario().control.law != ControlLaw::kImpedance;
}

constexpr const char* kLaw = "law";
constexpr FaultKind kKinds[] = {
    {kLaw, "summand", Summand, IsPaperLaw},
    {kLaw, "gravity", PartOfF<true>},
    {kLaw, "friction", PartOfF<false>, KnowsMotion},
    {kLaw, "compensation of Coulomb friction", CoulombCompensation, CompensatesCoulomb},
    {kLaw, "torque", AddedTorque},
    {kLaw, "viscous friction", AddedFriction,
     [](const FaultContext& context) { return !KnowsMotion(context); }},
    {kLaw, "gains of position", Gains<false, false>, HasOwnStiffness},
    {kLaw, "gains of velocity", Gains<true, false>},
    {kLaw, "one gain of position", Gains<false, true>, HasOwnStiffness},
    {kLaw, "one gain of velocity", Gains<true, true>, HasOwnStiffness},
};

}  // namespace
}  // namespace law_faults

std::span<const FaultKind> ListLawFaultKinds() { return law_faults::kKinds; }

}  // namespace dexcheck
