// Faults of the laws of joints, and terms that any law takes at another state.

#include <memory>
#include <utility>

#include "controller/dynamics/model_terms.h"
#include "controller/dynamics/torque_regressor.h"
#include "harness/diagnosis/law_entry_list.h"

namespace dexcheck {
namespace {

/// Terms of the law's model that are taken at another state than the measured one.
struct OtherState {
  enum Terms : unsigned { kM = 1, kC = 2, kCoriolis = 4, kGravity = 8, kFriction = 16, kFeedback = 32 };
  enum State { kDesired, kBefore, kTwoBefore, kStart };
  const char* fault;
  State state;
  unsigned terms;
  bool is_of_any_law = false;  // and not of laws of joints alone
};
constexpr unsigned kAllTerms = OtherState::kM | OtherState::kCoriolis | OtherState::kGravity;
constexpr OtherState kOtherStates[] = {
    {"M_bar' at the desired position", OtherState::kDesired, OtherState::kM},
    {"gravity at the desired position", OtherState::kDesired, OtherState::kGravity},
    {"Coriolis forces at the desired state", OtherState::kDesired, OtherState::kCoriolis},
    {"M_bar', Coriolis forces and gravity at the desired state", OtherState::kDesired, kAllTerms},
    {"M_bar', Coriolis forces, gravity and friction at the desired state", OtherState::kDesired,
     kAllTerms | OtherState::kFriction},
    {"measured state of the step before", OtherState::kBefore,
     kAllTerms | OtherState::kFriction | OtherState::kFeedback},
    {"measured state of 2 steps before", OtherState::kTwoBefore,
     kAllTerms | OtherState::kFriction | OtherState::kFeedback},
    {"M_bar' of the step before", OtherState::kBefore, OtherState::kM, true},
    {"Coriolis forces of the step before", OtherState::kBefore, OtherState::kCoriolis},
    {"gravity of the step before", OtherState::kBefore, OtherState::kGravity, true},
    {"C_bar' of the step before", OtherState::kBefore, OtherState::kC},
    {"M_bar' at the start", OtherState::kStart, OtherState::kM, true},
    {"gravity at the start", OtherState::kStart, OtherState::kGravity, true},
};

}  // namespace

void LawEntryList::AddJointFaults() {
  LawEntry& velocity = Add("desired velocity in the feedback (K_v q_d_dot), factor",
                           [law = &law_](const LawSnapshot& step) -> MatrixXd {
                             LawInputs inputs = step.inputs;
                             inputs.velocity_error -= inputs.now.joints.q_dot;
                             return step.inputs.now.force - law->CalcForce(std::move(inputs));
                           });
  velocity.nominal = 1.0;
  AddEdit("Coriolis forces of the desired velocity (C_bar' q_d_dot)",
          [](const LawSnapshot& step, LawInputs* inputs) {
            inputs->terms.C_xi = step.inputs.C * step.inputs.now.joints.q_dot;
          });
  AddEdit("velocity of the step before in the Coriolis forces",
          [](const LawSnapshot& step, LawInputs* inputs) {
            if (!step.before.empty()) inputs->terms.C_xi = inputs->C * step.before.front().xi;
          });
  AddEdit("friction of the desired velocity",
          [this_model = &model_](const LawSnapshot& step, LawInputs* inputs) {
            for (int k = 0; k < this_model->num_dofs(); ++k)
              inputs->terms.friction[k + this_model->num_base_velocities()] =
                  this_model->joint(this_model->joint_of_dof(k)).damping *
                  step.inputs.now.joints.q_dot[k + this_model->num_base_velocities()];
          });
  for (Index i = 0; i < n_; ++i) {
    AddEdit(
        "measured velocity of " + NameEntry(model_, i) + " with the other sign in the feedback",
        [i](const LawSnapshot&, LawInputs* inputs) { inputs->velocity_error[i] += 2.0 * inputs->now.xi[i]; });
    if (model_.num_positions() == n_)
      AddEdit("measured position of " + NameEntry(model_, i) + " with the other sign in the feedback",
              [i](const LawSnapshot&, LawInputs* inputs) {
                inputs->now.position_error[i] += 2.0 * inputs->now.q[i];
              });
  }
  AddFriction();
  if (law_.demands_acceleration()) {
    AddEdit("feedback that M_bar' does not multiply, and gravity alone",
            [](const LawSnapshot&, LawInputs* inputs) {
              inputs->feeds_back_torques = true;
              inputs->now.joints.q_ddot.setZero();
              inputs->terms.C_xi.setZero();
              inputs->terms.friction.setZero();
            });
    AddEdit("feedback that M_bar' does not multiply",
            [](const LawSnapshot&, LawInputs* inputs) { inputs->feeds_back_torques = true; });
    AddEdit("feedback that the diagonal of M_bar' multiplies",
            [](const LawSnapshot&, LawInputs* inputs) { inputs->feeds_back_by_diagonal = true; });
  }
  AddIntegrals();
}

void LawEntryList::AddOtherStates() {
  const auto terms = std::make_shared<ModelTerms>(model_);
  const bool has_rates = model_.base().type == BaseType::kFixed && model_.num_positions() == n_;
  for (const OtherState& one : kOtherStates) {
    if (!one.is_of_any_law && !(is_of_joints_ && has_rates)) continue;
    AddEdit(one.fault, [terms, one, start = start_](const LawSnapshot& step, LawInputs* inputs) {
      const LawStep& now = step.inputs.now;
      const size_t age = one.state == OtherState::kTwoBefore ? 2 : one.state == OtherState::kBefore ? 1 : 0;
      const LawStep& then = age > 0 && step.before.size() >= age ? step.before[age - 1] : now;
      if (one.state == OtherState::kStart) {
        terms->SetState(start, VectorXd::Zero(now.xi.size()));
      } else if (one.state == OtherState::kDesired) {
        terms->SetState(now.joints.q, now.joints.q_dot);
      } else {
        terms->SetState(then.q, then.xi);
      }
      terms->CalcDynamics();
      if ((one.terms & OtherState::kM) != 0) inputs->M = terms->M();
      if ((one.terms & OtherState::kC) != 0) inputs->terms.C_xi = terms->C() * now.xi;
      if ((one.terms & OtherState::kCoriolis) != 0) inputs->terms.C_xi = terms->C() * terms->velocity();
      if ((one.terms & OtherState::kGravity) != 0) inputs->terms.gravity = terms->gravity();
      if ((one.terms & OtherState::kFriction) != 0) inputs->terms.friction = terms->friction();
      if ((one.terms & OtherState::kFeedback) == 0) return;
      inputs->C = terms->C();
      inputs->velocity_error = now.joints.q_dot - terms->velocity();
      inputs->now.position_error += now.q - then.q;
    });
  }
}

void LawEntryList::AddFriction() {
  struct Kind {
    const char* fault;
    const char* unit;
    VectorXd (*size)(const LawStep&);
  };
  constexpr Kind kKinds[] = {
      {"dry friction of all joints by the measured velocity", "N m",
       [](const LawStep& now) { return VectorXd(now.xi.cwiseSign()); }},
      {"dry friction of all joints by the desired velocity", "N m",
       [](const LawStep& now) { return VectorXd(now.joints.q_dot.cwiseSign()); }},
      {"viscous friction of all joints by the measured velocity", "N m s/rad",
       [](const LawStep& now) { return VectorXd(now.xi); }},
      {"viscous friction of all joints by the desired velocity", "N m s/rad",
       [](const LawStep& now) { return VectorXd(now.joints.q_dot); }},
  };
  for (const Kind& kind : kKinds) {
    LawEntry& entry = Add(kind.fault, [size = kind.size](const LawSnapshot& step) -> MatrixXd {
      return size(step.inputs.now);
    });
    entry.unit = kind.unit;
  }
}

void LawEntryList::AddIntegrals() {
  const double step_time = law_.control_step();
  for (const double now : {step_time, 0.0}) {
    const auto sum = [now](const LawSnapshot& step) {
      const Index n = step.difference.size();
      MatrixXd columns = MatrixXd::Identity(n, 1 + n);
      columns.col(0) = step.error_sum + now * step.inputs.now.position_error;
      columns.rightCols(n).setIdentity();
      return columns;
    };
    Add("integral of the position error, as a torque, gain", sum).unit = "N m/(rad s)";
    const auto each = [sum](const LawSnapshot& step) {
      const Index n = step.difference.size();
      const MatrixXd one = sum(step);
      MatrixXd columns = MatrixXd::Identity(n, 2 * n);
      columns.leftCols(n) = one.col(0).asDiagonal();
      columns.rightCols(n).setIdentity();
      return columns;
    };
    Add("integral of the position errors, as torques, a gain for each", each);
    if (law_.demands_acceleration())
      Add("integral of the position errors, a gain for each",
          [each](const LawSnapshot& step) -> MatrixXd { return step.inputs.M * each(step); });
    if (!law_.demands_acceleration()) continue;
    Add("integral of the position error, gain", [sum](const LawSnapshot& step) -> MatrixXd {
      return step.inputs.M * sum(step);
    }).unit = "1/s^3";
  }
}

void LawEntryList::AddModelFaults() {
  if (model_.base().type != BaseType::kFixed || model_.num_positions() != n_) return;
  const auto regressor = std::make_shared<TorqueRegressor>(model_);
  const auto move = [regressor, law = &law_](const LawSnapshot& step) {
    LawInputs inputs = step.inputs;
    inputs.M *= 2.0;
    VectorXd demand = step.inputs.M.ldlt().solve(law->CalcForce(std::move(inputs)) - step.inputs.now.force);
    regressor->SetMotion(step.inputs.now.q, step.inputs.now.xi, demand);
    return demand;
  };
  constexpr int kBody = TorqueRegressor::kBody;
  for (int link = 0; link < model_.num_joints(); ++link) {
    const MassProperties body = model_.joint(link).body;
    const auto columns = [regressor, move, link](const LawSnapshot& step) {
      move(step);
      MatrixXd all(step.difference.size(), kBody * regressor->size());
      regressor->CalcBodyColumns(all);
      return MatrixXd(all.middleCols<kBody>(kBody * link));
    };
    const std::string place = "link " + model_.joint(link).link + " of the law's model";
    MassProperties heavier = body;
    heavier.mass += 1.0;
    const auto one = TorqueRegressor::Pack(heavier) - TorqueRegressor::Pack(body);
    LawEntry& mass = Add(
        "mass", [columns, change = TorqueRegressor::BodyVector(one)](const LawSnapshot& step) -> MatrixXd {
          return columns(step) * change;
        });
    mass.place = place;
    mass.unit = "kg";
    mass.nominal = body.mass;
    Add("inertial (ten numbers)", [columns](const LawSnapshot& step) -> MatrixXd {
      return columns(step);
    }).place = place;
  }
  Add("gravity vector", [regressor, move](const LawSnapshot& step) -> MatrixXd {
    move(step);
    MatrixXd columns(step.difference.size(), 3);
    regressor->CalcGravityColumns(columns);
    return columns;
  }).place = "law's model";
  Add("armatures", [move](const LawSnapshot& step) -> MatrixXd {
    return MatrixXd(move(step).asDiagonal());
  }).place = "law's model";
  for (int joint = 0; joint < model_.num_joints(); ++joint) {
    LawEntry& armature = Add("armature", [move, joint](const LawSnapshot& step) -> MatrixXd {
      return VectorXd(move(step)[joint] * VectorXd::Unit(step.difference.size(), joint));
    });
    armature.place = "joint " + model_.joint(joint).name + " of the law's model";
    armature.unit = "kg m^2";
    armature.nominal = model_.joint(joint).armature;
  }
  LawEntry& same = Add("armature of all joints, more by",
                       [move](const LawSnapshot& step) -> MatrixXd { return move(step); });
  same.place = "law's model";
  same.unit = "kg m^2";
}

}  // namespace dexcheck
