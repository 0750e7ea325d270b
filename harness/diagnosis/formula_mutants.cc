#include "harness/diagnosis/formula_mutants.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "controller/object/object_dynamics.h"
#include "harness/checks/contact_check.h"
#include "harness/descriptions/analytic_provider.h"

namespace dexcheck {
namespace {

/// A view whose terms are changed before they are seen.
class FaultyView : public ModelView {
 public:
  FaultyView(const RobotModel& model, Coordinates coordinates, EquationChange change)
      : ModelView(model, coordinates), change_(change) {}

  void SetState(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& velocity) override {
    VectorXd at = q;
    VectorXd rates = velocity;
    if (change_.exchanged) {
      const auto& [a, b] = *change_.exchanged;
      const int base = size() - model().num_joints();
      const int first = model().num_base_positions();
      std::swap(at[first + a], at[first + b]);
      std::swap(rates[base + a], rates[base + b]);
    }
    ModelView::SetState(at, rates);
    M_ = ModelView::M();
    C_ = ModelView::C();
    gravity_ = ModelView::gravity();
    friction_ = ModelView::friction();
    if (change_.robot) change_.robot({model(), at, rates, M_, C_, gravity_, friction_});
  }
  [[nodiscard]] const MatrixXd& M() const override { return M_; }
  [[nodiscard]] const MatrixXd& C() const override { return C_; }
  [[nodiscard]] const VectorXd& gravity() const override { return gravity_; }
  [[nodiscard]] const VectorXd& friction() const override { return friction_; }
  [[nodiscard]] Pose CalcLinkPose(int joint) const override {
    return Transpose(ModelView::CalcLinkPose(joint), change_.transposes_links);
  }
  [[nodiscard]] Pose CalcFramePose(int frame) const override {
    return Transpose(ModelView::CalcFramePose(frame), change_.transposes_frames);
  }
  void CalcFrameJacobian(int frame, Eigen::Ref<Matrix6Xd> J, Eigen::Ref<Matrix6Xd> J_dot) const override {
    ModelView::CalcFrameJacobian(frame, J, J_dot);
    if (change_.jacobian) J = change_.jacobian(CalcFramePose(frame)) * J;
    if (change_.jacobian_rate) J_dot *= *change_.jacobian_rate;
  }
  [[nodiscard]] EnergyAndMomentum CalcEnergyAndMomentum() const override {
    EnergyAndMomentum terms = ModelView::CalcEnergyAndMomentum();
    if (change_.energy) change_.energy(&terms);
    return terms;
  }

 private:
  static Pose Transpose(Pose X, bool is_wrong) {
    if (is_wrong) X.linear().transposeInPlace();
    return X;
  }

  EquationChange change_;
  MatrixXd M_, C_;
  VectorXd gravity_, friction_;
};

ModelViewFactory UseView(const EquationChange& change) {
  return [change](const RobotModel& model, Coordinates coordinates) {
    return std::make_unique<FaultyView>(model, coordinates, change);
  };
}

ObjectFormulas UseObject(const EquationChange& change) {
  ObjectFormulas formulas;
  if (change.object) {
    formulas.terms = [make = change.object](const MassProperties& body, const Vector3d& gravity,
                                            const Vector6d& X_o, const Vector6d& X_o_dot) {
      ObjectTerms terms = CalcObjectTerms(body, gravity, X_o, X_o_dot);
      make(&terms);
      return terms;
    };
  }
  if (change.object_pose) {
    formulas.pose = [make = change.object_pose](const Vector6d& X_o) {
      Pose X = CalcObjectPose(X_o);
      make(X_o, &X);
      return X;
    };
  }
  return formulas;
}

ContactFormulas UseContact(const EquationChange& change) {
  ContactFormulas formulas;
  if (change.contact_frame) formulas.geometry = change.contact_frame;
  if (change.grasp_map)
    formulas.grasp_map = [make = change.grasp_map](const Contact& contact, Eigen::Ref<Matrix6Xd> G) {
      G = make(contact.geometry.g_o_cf).leftCols<3>();
    };
  if (change.contact_jacobian)
    formulas.jacobian = [make = change.contact_jacobian](
                            const Contact& contact, const Eigen::Ref<const Matrix6Xd>& J_f,
                            Eigen::Ref<MatrixXd> rows) { rows = make(contact.geometry, J_f); };
  if (change.rolling)
    formulas.kappa_dot = [make = change.rolling](ContactGeometry geometry, Vector6d V) {
      make(&geometry, &V);
      return CalcKappaDot(geometry, V);
    };
  return formulas;
}

/// The first failure of each check, at as many random contacts.
std::vector<CheckRecord> CheckContacts(const Adapter& adapter, const ContactFormulas& formulas, int samples) {
  std::vector<CheckRecord> records;
  const RobotModel& model = adapter.model();
  StateSource source(model, {}, ConsistencyOptions{}.seed);
  VectorXd q = VectorXd::Zero(model.num_positions());
  VectorXd xi = VectorXd::Zero(model.num_velocities());
  for (int sample = 0; sample < samples; ++sample) {
    source.DrawPositions(&q);
    source.DrawVelocity(&xi);
    const std::vector<int>& tips = model.fingertips();
    ContactCheck check(adapter, tips[static_cast<size_t>(sample) % tips.size()], formulas);
    check.Compare(q, xi, &source, sample);
    records.resize(check.records().size());
    for (size_t i = 0; i < records.size(); ++i) {
      if (!records[i].failed) records[i] = check.records()[i];
    }
  }
  return records;
}

}  // namespace

std::vector<FormulaMutant> ListFormulaMutants(const RobotModel& model) {
  std::vector<FormulaMutant> mutants;
  for (EquationFault& equation : ListEquationFaults(model)) {
    if (equation.term == nullptr) continue;
    FormulaMutant& mutant = mutants.emplace_back();
    mutant.name = equation.name;
    mutant.kind = "wrong equation";
    mutant.equation = std::move(equation);
  }
  return mutants;
}

void RunFormulaMutant(const Adapter& adapter, int samples, FormulaMutant* mutant) {
  const EquationFault& equation = mutant->equation;
  ConsistencyOptions options;
  options.samples = samples;
  options.make_view = UseView(equation.change);
  options.object = UseObject(equation.change);
  const std::vector<CheckRecord> records =
      equation.change.is_of_contact() ? CheckContacts(adapter, UseContact(equation.change), samples)
                                      : CheckConsistency(adapter, options, [](long) { return true; }).terms;
  AddFailed(records, &mutant->failed_checks);
  mutant->named_first = std::any_of(records.begin(), records.end(), [&](const CheckRecord& record) {
    return record.failed && record.name == equation.term;
  });
  mutant->outcome = mutant->failed_checks.empty() ? MutantOutcome::kSurvived : MutantOutcome::kKilled;
  const bool is_of_robot = !equation.change.is_of_contact() && !equation.change.is_of_object();
  if (mutant->outcome == MutantOutcome::kKilled || !is_of_robot) return;
  AnalyticProvider faulty(adapter.model(), "faulty", options.make_view);
  if (!HasEffect(adapter.model(), &faulty, samples, options.seed)) mutant->outcome = MutantOutcome::kNoEffect;
}

}  // namespace dexcheck
