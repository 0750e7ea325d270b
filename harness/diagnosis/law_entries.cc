#include "harness/diagnosis/law_entries.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "harness/diagnosis/equation_faults.h"
#include "harness/diagnosis/law_entry_list.h"

namespace dexcheck {
namespace {

/// X_o_dot.
Vector6d CalcCoordinateRates(const LawObject& object) {
  Vector6d rates;
  rates << object.X_Bo.linear() * object.V_Bo.head<3>(),
      CalcAngleMap(object.X_o.tail<3>()).inverse() * object.V_Bo.tail<3>();
  return rates;
}

/// The errors of X_o, or of its rate, of another step. Orientations have such errors where they are angles.
void ShiftPosition(const LawStep& then, LawInputs* inputs) {
  if (inputs->spec->orientation == OrientationFeedback::kAngles)
    inputs->now.desired.X_d += inputs->now.object.X_o - then.object.X_o;
}
void ShiftVelocity(const LawStep& then, LawInputs* inputs) {
  if (inputs->spec->orientation == OrientationFeedback::kAngles)
    inputs->now.desired.X_d_dot += CalcCoordinateRates(inputs->now.object) - CalcCoordinateRates(then.object);
}

/// Entries of tau' that something drives begin here.
Eigen::Index FindFirstDriven(const RobotModel& model) {
  return model.base().type == BaseType::kFloating ? model.num_base_velocities() : 0;
}

double CalcSign(double rate) { return rate == 0.0 ? 0.0 : std::copysign(1.0, rate); }

struct JointTorque {
  const char* fault;
  const char* unit;  // of a joint that turns
  const char* unit_of_slide;
  double (*size)(double rate);  // of an amplitude of 1
};
constexpr JointTorque kJointTorques[] = {
    {"torque", "N m", "N", [](double) { return 1.0; }},
    {"viscous friction", "N m s/rad", "N s/m", [](double rate) { return -rate; }},
    {"compensation of viscous friction", "N m s/rad", "N s/m", [](double rate) { return rate; }},
    {"dry friction", "N m", "N", [](double rate) { return -CalcSign(rate); }},
    {"compensation of dry friction", "N m", "N", CalcSign}};

}  // namespace

std::string NameEntry(const RobotModel& model, Eigen::Index entry) {
  const Base& base = model.base();
  const Eigen::Index offset = model.num_base_velocities();
  if (entry >= offset) return model.dof_name(static_cast<int>(entry - offset));
  if (base.type != BaseType::kDifferentialDrive) return "base velocity " + std::to_string(entry);
  return entry == 0 ? base.wheel_joint_right : base.wheel_joint_left;
}

std::vector<LawPlace> ListLawPlaces(const Setup& setup) {
  const RobotModel& model = setup.model();
  const int offset = model.num_base_velocities();
  std::vector<LawPlace> places = {{"law", {}}};
  for (Eigen::Index i = 0; i < model.num_velocities(); ++i) places.front().entries.push_back(i);
  // The law of a robot that stands may be wrong before the ground's forces are subtracted, or after.
  if (model.base().type == BaseType::kFloating) places.push_back({"law", {}, true});
  std::vector<bool> carries(static_cast<size_t>(model.num_joints()), false);
  for (const int joint : setup.hold().arm_joints) carries[static_cast<size_t>(joint)] = true;
  for (const int tip : setup.fingertips()) {
    const Frame& frame = model.frames()[static_cast<size_t>(tip)];
    LawPlace finger{"law of the finger of " + frame.name, {}};
    for (int joint = frame.link; joint >= 0; joint = model.joints()[static_cast<size_t>(joint)].parent)
      if (!carries[static_cast<size_t>(joint)]) finger.entries.push_back(offset + model.dof(joint));
    if (finger.entries.size() > 1) places.push_back(finger);
  }
  for (Eigen::Index i = FindFirstDriven(model); i < model.num_velocities(); ++i)
    places.push_back({"law of " + NameEntry(model, i), {i}});
  return places;
}

VectorXd KeepAt(const ActuationMap& actuation, const LawPlace& place, const VectorXd& force) {
  if (place.is_balanced) return force;
  VectorXd tau(force.size());
  actuation.CalcTorque(force, tau);
  VectorXd own = VectorXd::Zero(force.size());
  for (const Eigen::Index entry : place.entries) own[entry] = tau[entry];
  actuation.CalcForce(own, own);
  return own;
}

std::vector<LawEntry> LawEntryList::Make() {
  AddFactors();
  AddOldSignals();
  AddExchanges();
  AddMatrices();
  AddJointTorques();
  AddOtherStates();
  if (is_of_joints_) AddJointFaults();
  if (is_of_joints_) AddModelFaults();
  if (!is_of_joints_) AddObjectFaults();
  return std::move(entries_);
}

VectorXd LawAtStep::CalcChange(const LawInputs& changed) const {
  VectorXd other = law(changed);
  if (other.size() == 0 || force.size() == 0) return VectorXd::Zero(step.difference.size());
  return other - force;
}

const VectorXd& LawAtStep::demand() const {
  if (demand_.size() > 0) return demand_;
  LawInputs heavier = inputs;
  heavier.M *= 2.0;
  demand_ = inputs.M.ldlt().solve(CalcChange(heavier));
  return demand_;
}

bool LawTerm::CanBe() const {
  constexpr double kPlausible = 300.0;   // of factors, which are units mistaken at the most
  constexpr double kMostReversed = 3.0;  // of factors of the other sign
  if (entry->plausible > 0.0 && sizes.cwiseAbs().maxCoeff() >= entry->plausible) return false;
  if (entry->is_positive) return sizes[0] >= 0.0;
  const bool is_factor = entry->nominal == 1.0 && entry->unit.empty();
  return !is_factor || (std::abs(sizes[0]) < kPlausible && 1.0 + sizes[0] > -kMostReversed);
}

VectorXd LawTerm::CalcChange(const ActuationMap& actuation, const LawAtStep& at) const {
  const VectorXd change = entry->change ? entry->change(at, sizes) : VectorXd(entry->force(at) * sizes);
  return place != nullptr ? KeepAt(actuation, *place, change) : change;
}

LawEntry& LawEntryList::Add(const std::string& fault, std::function<MatrixXd(const LawAtStep&)> force) {
  LawEntry& entry = entries_.emplace_back();
  entry.fault = fault;
  entry.force = std::move(force);
  return entry;
}

LawEntry& LawEntryList::AddEdit(const std::string& fault, const Edit& edit) {
  LawEntry& entry = Add(fault, [edit](const LawAtStep& at) -> MatrixXd {
    LawInputs inputs = at.inputs;
    edit(at, &inputs);
    return at.CalcChange(inputs);
  });
  entry.is_whole = true;
  return entry;
}

void LawEntryList::AddFactor(const std::string& fault, const Edit& remove) {
  LawEntry& entry = AddEdit(fault, remove);
  entry.force = [whole = entry.force](const LawAtStep& at) -> MatrixXd { return -whole(at); };
  entry.is_whole = false;
  entry.nominal = 1.0;
}

void LawEntryList::AddFactors() {
  for (const LawPartName& name : law_.ListParts()) {
    if (name.is_of_acceleration && !law_.demands_acceleration()) continue;
    LawEntry& entry = Add(std::string(name.name) + " (" + name.symbol + "), factor",
                          [name](const LawAtStep& at) -> MatrixXd {
                            if (name.remove == nullptr) return at.force;
                            LawInputs inputs = at.inputs;
                            if (name.without != nullptr) name.without(&inputs);
                            const LawAtStep whole(at.step, inputs, at.law);
                            LawInputs changed = inputs;
                            name.remove(&changed);
                            return (name.doubles ? 1.0 : -1.0) * whole.CalcChange(changed);
                          });
    entry.nominal = 1.0;
    entry.parts = name.parts;
    entry.at_places = true;
  }
  for (size_t gain = 0; gain < law_.gains().size(); ++gain)
    AddFactor("gain " + law_.gains()[gain] + ", factor",
              [law = &law_, gain](const LawAtStep&, LawInputs* inputs) { law->RemoveGain(gain, inputs); });
}

void LawEntryList::AddOldSignals() {
  for (const size_t age : {1U, 2U, 3U, 4U, 5U, 8U, 10U}) {
    const std::string when = age == 1 ? "of the step before" : fmt::format("of {} steps before", age);
    const auto old = [age](const LawAtStep& at) -> const LawStep* {
      return at.step.before.size() >= age ? &at.step.before[age - 1] : nullptr;
    };
    LawEntry& torques = Add("torques " + when, [old](const LawAtStep& at) -> MatrixXd {
      const LawStep* const then = old(at);
      if (then == nullptr) return VectorXd::Zero(at.force.size());
      return then->force - at.force;
    });
    torques.is_whole = true;
    torques.is_variant = age > 1;
    const auto add = [&](const std::string& what, void (*edit)(const LawStep&, LawInputs*)) {
      AddEdit(fmt::format("{} {}", what, when), [old, edit](const LawAtStep& at, LawInputs* inputs) {
        if (const LawStep* const then = old(at)) edit(*then, inputs);
      }).is_variant = age > 1;
    };
    if (is_of_joints_) {
      add("feedback", [](const LawStep& then, LawInputs* inputs) {
        inputs->now.position_error = then.position_error;
        inputs->velocity_error = then.joints.q_dot - then.xi;
      });
      add("measured velocity in the feedback", [](const LawStep& then, LawInputs* inputs) {
        inputs->velocity_error = inputs->now.joints.q_dot - then.xi;
      });
      add("measured position in the feedback", [](const LawStep& then, LawInputs* inputs) {
        inputs->now.position_error += inputs->now.q - then.q;
      });
      add("measured positions and velocities in the feedback", [](const LawStep& then, LawInputs* inputs) {
        inputs->now.position_error += inputs->now.q - then.q;
        inputs->velocity_error = inputs->now.joints.q_dot - then.xi;
      });
      add("desired motion", [](const LawStep& then, LawInputs* inputs) {
        inputs->now.position_error += then.joints.q - inputs->now.joints.q;
        inputs->velocity_error += then.joints.q_dot - inputs->now.joints.q_dot;
        inputs->now.joints = then.joints;
      });
      add("desired position", [](const LawStep& then, LawInputs* inputs) {
        inputs->now.position_error += then.joints.q - inputs->now.joints.q;
      });
      add("desired velocity", [](const LawStep& then, LawInputs* inputs) {
        inputs->velocity_error += then.joints.q_dot - inputs->now.joints.q_dot;
      });
      add("desired acceleration",
          [](const LawStep& then, LawInputs* inputs) { inputs->now.joints.q_ddot = then.joints.q_ddot; });
    } else {
      add("measured position of the object in the feedback",
          [](const LawStep& then, LawInputs* inputs) { ShiftPosition(then, inputs); });
      add("measured velocity of the object in the feedback",
          [](const LawStep& then, LawInputs* inputs) { ShiftVelocity(then, inputs); });
      add("measured object in the feedback", [](const LawStep& then, LawInputs* inputs) {
        ShiftPosition(then, inputs);
        ShiftVelocity(then, inputs);
      });
      add("desired motion",
          [](const LawStep& then, LawInputs* inputs) { inputs->now.desired = then.desired; });
      add("desired position",
          [](const LawStep& then, LawInputs* inputs) { inputs->now.desired.X_d = then.desired.X_d; });
      add("desired velocity",
          [](const LawStep& then, LawInputs* inputs) { inputs->now.desired.X_d_dot = then.desired.X_d_dot; });
      add("desired acceleration", [](const LawStep& then, LawInputs* inputs) {
        inputs->now.desired.X_d_ddot = then.desired.X_d_ddot;
      });
    }
  }
}

std::vector<std::pair<Eigen::Index, Eigen::Index>> LawEntryList::ListPairs() const {
  constexpr Index kFew = 12;
  std::vector<std::pair<Index, Index>> pairs;
  for (Index i = 0; i < n_; ++i)
    for (Index j = i + 1; j < (n_ <= kFew ? n_ : std::min(n_, i + 2)); ++j) pairs.emplace_back(i, j);
  return pairs;
}

void LawEntryList::AddExchanges() {
  for (const auto& [i, j] : ListPairs()) {
    const std::string both = NameEntry(model_, i) + " and " + NameEntry(model_, j);
    LawEntry& torques = Add("torques of " + both + " exchanged",
                            [this_model = &model_, i = i, j = j](const LawAtStep& at) -> MatrixXd {
                              const ActuationMap actuation(*this_model);
                              VectorXd tau(at.force.size());
                              actuation.CalcTorque(at.force, tau);
                              VectorXd change = VectorXd::Zero(tau.size());
                              change[i] = tau[j] - tau[i];
                              change[j] = -change[i];
                              actuation.CalcForce(change, change);
                              return change;
                            });
    torques.is_whole = true;
    torques.is_variant = i > 0;
    if (is_of_joints_) AddSignalExchanges(both, i, j);
    AddEdit("M_bar' without the coupling of " + both, [i = i, j = j](const LawAtStep&, LawInputs* inputs) {
      inputs->M(i, j) = inputs->M(j, i) = 0.0;
    }).is_variant = i > 0;
  }
}

void LawEntryList::AddJointTorques() {
  for (Index i = FindFirstDriven(model_); i < n_; ++i) {
    const int dof = static_cast<int>(i) - model_.num_base_velocities();
    const bool slides = dof >= 0 && model_.joints()[static_cast<size_t>(model_.joint_of_dof(dof))].type ==
                                        JointType::kPrismatic;
    for (const JointTorque& kind : kJointTorques) {
      LawEntry& entry =
          Add(kind.fault,
              [actuation = ActuationMap(model_), size = kind.size, i](const LawAtStep& at) -> MatrixXd {
                VectorXd own(at.force.size());
                actuation.CalcForce(VectorXd::Unit(own.size(), i), own);
                return size(at.inputs.terms.xi[i]) * own;
              });
      entry.place = "law of " + NameEntry(model_, i);
      entry.unit = slides ? kind.unit_of_slide : kind.unit;
      entry.is_positive = &kind != &kJointTorques[0];
    }
  }
}

void LawEntryList::AddMatrices() {
  AddEdit("diagonal of M_bar' alone", [](const LawAtStep&, LawInputs* inputs) {
    inputs->M = MatrixXd(inputs->M.diagonal().asDiagonal());
  });
  for (const EquationFault& equation : ListEquationFaults(model_)) {
    if (!equation.change.robot) continue;
    AddEdit(equation.name, [this_model = &model_, make = equation.change.robot](const LawAtStep& at,
                                                                                LawInputs* inputs) {
      LawTerms& terms = inputs->terms;
      make({*this_model, inputs->now.q, inputs->now.xi, inputs->M, inputs->C, terms.gravity, terms.friction});
      terms.C_xi += (inputs->C - at.inputs.C) * inputs->now.xi;
    }).is_variant = true;
  }
}

void LawEntryList::AddObjectFaults() {
  AddEdit("sigma' is not projected into the null space",
          [](const LawAtStep&, LawInputs* inputs) { inputs->spec->projects = false; });
  AddFactor("desired velocity in the feedback (K_v X_d_dot), factor",
            [](const LawAtStep&, LawInputs* inputs) { inputs->now.desired.X_d_dot.setZero(); });
  AddEdit("tangential axes of the contact forces exchanged",
          [](const LawAtStep&, LawInputs* inputs) { inputs->exchanges_force_axes = true; });
  AddEdit("G^T in the place of G^+",
          [](const LawAtStep&, LawInputs* inputs) { inputs->spec->transposes_grasp = true; });
  AddEdit("weight M_bar' of the pseudoinverse of J_B'", [](const LawAtStep&, LawInputs* inputs) {
    inputs->spec->weight.kind = RedundancyWeight::Kind::kMass;
  });
  AddEdit("weight 1 of the pseudoinverse of J_B'", [](const LawAtStep&, LawInputs* inputs) {
    inputs->spec->weight.kind = RedundancyWeight::Kind::kIdentity;
  });
  if (model_.base().type != BaseType::kDifferentialDrive) return;
  LawEntry& map =
      Add("no E_bar' between forces and torques", [this_model = &model_](const LawAtStep& at) -> MatrixXd {
        VectorXd force(at.force.size());
        ActuationMap(*this_model).CalcForce(at.force, force);
        return force - at.force;
      });
  map.is_whole = true;
}

std::vector<LawEntry> ListLawEntries(const Setup& setup, JudgedLaw* law) {
  return LawEntryList(setup, law).Make();
}

}  // namespace dexcheck
