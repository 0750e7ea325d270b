// Faults of the laws of joints, and terms that any law takes at another state.

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "controller/dynamics/model_terms.h"
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

constexpr double kLeastShare = 0.01;  // of the new value in a filter that is slower than any

}  // namespace

void LawEntryList::AddJointFaults() {
  AddFactor("desired velocity in the feedback (K_v q_d_dot), factor",
            [](const LawAtStep&, LawInputs* inputs) { inputs->velocity_error -= inputs->now.joints.q_dot; });
  AddEdit(
      "Coriolis forces of the desired velocity (C_bar' q_d_dot)",
      [](const LawAtStep&, LawInputs* inputs) { inputs->terms.C_xi = inputs->C * inputs->now.joints.q_dot; });
  AddEdit("Coriolis forces of the measured velocity (C_bar' q_dot)",
          [](const LawAtStep&, LawInputs* inputs) { inputs->C.setZero(); });
  AddEdit("velocity of the step before in the Coriolis forces", [](const LawAtStep& at, LawInputs* inputs) {
    if (!at.step.before.empty()) inputs->terms.C_xi = inputs->C * at.step.before.front().xi;
  });
  AddEdit("friction of the desired velocity", [this_model = &model_](const LawAtStep&, LawInputs* inputs) {
    for (int k = 0; k < this_model->num_dofs(); ++k)
      inputs->terms.friction[k + this_model->num_base_velocities()] =
          this_model->joint(this_model->joint_of_dof(k)).damping *
          inputs->now.joints.q_dot[k + this_model->num_base_velocities()];
  });
  for (Index i = 0; i < n_; ++i) {
    AddEdit(
        "measured velocity of " + NameEntry(model_, i) + " with the other sign in the feedback",
        [i](const LawAtStep&, LawInputs* inputs) { inputs->velocity_error[i] += 2.0 * inputs->now.xi[i]; });
    if (model_.num_positions() == n_)
      AddEdit("measured position of " + NameEntry(model_, i) + " with the other sign in the feedback",
              [i](const LawAtStep&, LawInputs* inputs) {
                inputs->now.position_error[i] += 2.0 * inputs->now.q[i];
              });
  }
  AddFriction();
  AddFilters();
  if (law_.demands_acceleration()) {
    AddEdit("feedback that M_bar' does not multiply, and gravity alone",
            [](const LawAtStep&, LawInputs* inputs) {
              inputs->feeds_back_torques = true;
              inputs->now.joints.q_ddot.setZero();
              inputs->terms.C_xi.setZero();
              inputs->terms.friction.setZero();
            });
    AddEdit("feedback that M_bar' does not multiply",
            [](const LawAtStep&, LawInputs* inputs) { inputs->feeds_back_torques = true; });
    AddEdit("feedback that the diagonal of M_bar' multiplies",
            [](const LawAtStep&, LawInputs* inputs) { inputs->feeds_back_by_diagonal = true; });
  }
  AddIntegrals();
}

void LawEntryList::AddOtherStates() {
  const auto terms = std::make_shared<ModelTerms>(model_);
  const bool has_rates = model_.base().type == BaseType::kFixed && model_.num_positions() == n_;
  for (const OtherState& one : kOtherStates) {
    if (!one.is_of_any_law && !(is_of_joints_ && has_rates)) continue;
    AddEdit(one.fault, [terms, one, start = start_](const LawAtStep& at, LawInputs* inputs) {
      const LawStep& now = at.inputs.now;
      const auto& before = at.step.before;
      const size_t age = one.state == OtherState::kTwoBefore ? 2 : one.state == OtherState::kBefore ? 1 : 0;
      const LawStep& then = age > 0 && before.size() >= age ? before[age - 1] : now;
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
    LawEntry& entry =
        Add(kind.fault, [size = kind.size](const LawAtStep& at) -> MatrixXd { return size(at.inputs.now); });
    entry.unit = kind.unit;
  }
  for (const bool is_desired : {false, true}) {
    LawEntry& entry = Add(fmt::format("friction of all joints as tanh of the {} velocity over",
                                      is_desired ? "desired" : "measured"),
                          nullptr);
    entry.unit = "N m";
    entry.shape_unit = "rad/s";
    for (const double width : {1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0})
      entry.starts.emplace_back(Eigen::Vector2d(1.0, width));
    entry.change = [is_desired](const LawAtStep& at, const VectorXd& sizes) {
      const VectorXd& v = is_desired ? at.inputs.now.joints.q_dot : at.inputs.now.xi;
      return VectorXd(sizes[0] * (v / std::clamp(sizes[1], 1e-4, 1.0)).array().tanh());
    };
  }
  if (law_.demands_acceleration()) return;
  Add("additional Coriolis forces (C_bar' q_dot), times",
      [](const LawAtStep& at) -> MatrixXd { return at.inputs.terms.C_xi; });
  Add("additional friction term, times",
      [](const LawAtStep& at) -> MatrixXd { return at.inputs.terms.friction; });
  Add("additional M_bar' q_d_ddot, times",
      [](const LawAtStep& at) -> MatrixXd { return at.inputs.M * at.inputs.now.joints.q_ddot; });
}

void LawEntryList::AddFilters() {
  // x_k = x_(k-1) + a (u_k - x_(k-1)) from the oldest step that is remembered on. @param first x of that.
  const auto filter = [](const LawAtStep& at, double a, VectorXd first, const auto& get) {
    const auto& before = at.step.before;
    a = std::clamp(a, kLeastShare, 1.0);
    for (size_t k = before.size() - 1; k-- > 0;) first += a * (get(before[k]) - first);
    first += a * (get(at.inputs.now) - first);
    return first;
  };
  const auto add = [&](const std::string& of, const auto& change) {
    LawEntry& entry = Add("filter of the " + of + ", share of the new one", nullptr);
    entry.is_positive = true;
    entry.plausible = 1.0;
    for (const double share : {0.03, 0.1, 0.3, 0.6, 0.9})
      entry.starts.emplace_back(VectorXd::Constant(1, share));
    entry.change = [change](const LawAtStep& at, const VectorXd& sizes) -> VectorXd {
      if (at.step.before.empty()) return VectorXd::Zero(at.force.size());
      return change(at, sizes[0]);
    };
  };
  add("torques", [filter](const LawAtStep& at, double a) {
    const LawStep* const now = &at.inputs.now;
    return VectorXd(
        filter(at, a, at.step.before.back().sent,
               [&](const LawStep& one) -> const VectorXd& { return &one == now ? at.force : one.force; }) -
        at.force);
  });
  struct Signal {
    const char* name;
    VectorXd (*get)(const LawStep&);
    VectorXd& (*open)(LawInputs*);
  };
  const auto velocity = [](LawInputs* inputs) -> VectorXd& { return inputs->velocity_error; };
  const auto position = [](LawInputs* inputs) -> VectorXd& { return inputs->now.position_error; };
  const auto acceleration = [](LawInputs* inputs) -> VectorXd& { return inputs->now.joints.q_ddot; };
  const Signal signals[] = {
      {"measured velocity in the feedback", [](const LawStep& now) { return VectorXd(-now.xi); }, velocity},
      {"desired velocity in the feedback", [](const LawStep& now) { return now.joints.q_dot; }, velocity},
      {"velocity error", [](const LawStep& now) { return VectorXd(now.joints.q_dot - now.xi); }, velocity},
      {"measured position in the feedback", [](const LawStep& now) { return VectorXd(-now.q); }, position},
      {"position error", [](const LawStep& now) { return now.position_error; }, position},
      {"desired acceleration", [](const LawStep& now) { return now.joints.q_ddot; }, acceleration}};
  if (model_.num_positions() != n_) return;
  const auto terms = std::make_shared<ModelTerms>(model_);
  for (const Signal& signal : signals) {
    add(signal.name, [filter, terms, signal](const LawAtStep& at, double a) {
      // The torques of the first step show what the filter was then.
      const LawStep& first = at.step.before.back();
      LawInputs then = at.inputs;
      terms->SetState(first.q, first.xi);
      terms->CalcDynamics();
      then.M = terms->M();
      const LawAtStep right(at.step, then, at.law);
      MatrixXd slopes(at.force.size(), at.force.size());
      for (Index i = 0; i < slopes.cols(); ++i) {
        LawInputs more = then;
        signal.open(&more)[i] += 1.0;
        slopes.col(i) = right.CalcChange(more);
      }
      const VectorXd lag = slopes.colPivHouseholderQr().solve(first.sent - first.force);
      LawInputs changed = at.inputs;
      signal.open(&changed) += filter(at, a, signal.get(first) + lag, signal.get) - signal.get(at.inputs.now);
      return at.CalcChange(changed);
    });
  }
}

void LawEntryList::AddSignalExchanges(const std::string& both, Index i, Index j) {
  struct Kind {
    const char* signals;
    bool is_position, is_velocity;
  };
  for (const Kind& kind : {Kind{"errors", true, true}, Kind{"position errors", true, false},
                           Kind{"velocity errors", false, true}})
    AddEdit(fmt::format("{} of {} exchanged", kind.signals, both),
            [kind, i, j](const LawAtStep&, LawInputs* inputs) {
              if (kind.is_position) std::swap(inputs->now.position_error[i], inputs->now.position_error[j]);
              if (kind.is_velocity) std::swap(inputs->velocity_error[i], inputs->velocity_error[j]);
            });
  // Exchanged torques would look so, too, where the law demands an acceleration at rest.
  if (!law_.demands_acceleration())
    AddEdit("gravity of " + both + " exchanged", [i, j](const LawAtStep&, LawInputs* inputs) {
      std::swap(inputs->terms.gravity[i], inputs->terms.gravity[j]);
    });
}

void LawEntryList::AddIntegrals() {
  const double step_time = law_.control_step();
  for (const double now : {step_time, 0.0}) {
    const auto sum = [now](const LawAtStep& at) {
      const Index n = at.force.size();
      MatrixXd columns = MatrixXd::Identity(n, 1 + n);
      columns.col(0) = at.step.error_sum + now * at.inputs.now.position_error;
      columns.rightCols(n).setIdentity();
      return columns;
    };
    Add("integral of the position error, as a torque, gain", sum).unit = "N m/(rad s)";
    const auto each = [sum](const LawAtStep& at) {
      const Index n = at.force.size();
      const MatrixXd one = sum(at);
      MatrixXd columns = MatrixXd::Identity(n, 2 * n);
      columns.leftCols(n) = one.col(0).asDiagonal();
      columns.rightCols(n).setIdentity();
      return columns;
    };
    Add("integral of the position errors, as torques, a gain for each", each);
    if (!law_.demands_acceleration()) continue;
    Add("integral of the position errors, a gain for each",
        [each](const LawAtStep& at) -> MatrixXd { return at.inputs.M * each(at); });
    Add("integral of the position error, gain", [sum](const LawAtStep& at) -> MatrixXd {
      return at.inputs.M * sum(at);
    }).unit = "1/s^3";
  }
}

}  // namespace dexcheck
