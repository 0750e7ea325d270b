#include "harness/diagnosis/formula_mutants.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "controller/contact/adjoint.h"
#include "controller/object/object_dynamics.h"
#include "harness/descriptions/model_view.h"
#include "harness/diagnosis/equation_faults.h"

namespace dexcheck {
namespace {

/// A view whose terms pass through a function before they are seen.
class FaultyView : public ModelView {
 public:
  using Change = void (*)(const RobotEquations&);

  FaultyView(const RobotModel& model, Coordinates coordinates, Change change)
      : ModelView(model, coordinates), change_(change) {}

  void SetState(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& velocity) override {
    ModelView::SetState(q, velocity);
    const VectorXd at = q;
    const VectorXd rates = velocity;
    M_ = ModelView::M();
    C_ = ModelView::C();
    gravity_ = ModelView::gravity();
    friction_ = ModelView::friction();
    change_({model(), at, rates, M_, C_, gravity_, friction_});
  }
  [[nodiscard]] const MatrixXd& M() const override { return M_; }
  [[nodiscard]] const MatrixXd& C() const override { return C_; }
  [[nodiscard]] const VectorXd& gravity() const override { return gravity_; }
  [[nodiscard]] const VectorXd& friction() const override { return friction_; }

 private:
  Change change_;
  MatrixXd M_, C_;
  VectorXd gravity_, friction_;
};

template <typename View, typename... Arguments>
ModelViewFactory Use(Arguments... arguments) {
  return [=](const RobotModel& model, Coordinates coordinates) {
    return std::make_unique<View>(model, coordinates, arguments...);
  };
}

/// Two joints' positions and rates exchanged on their way into the model.
class ExchangedJoints : public ModelView {
 public:
  ExchangedJoints(const RobotModel& model, Coordinates coordinates, int a, int b)
      : ModelView(model, coordinates), a_(a), b_(b) {}
  void SetState(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& velocity) override {
    VectorXd positions = q;
    VectorXd rates = velocity;
    const int base = size() - model().num_joints();
    std::swap(positions[model().num_base_positions() + a_], positions[model().num_base_positions() + b_]);
    std::swap(rates[base + a_], rates[base + b_]);
    ModelView::SetState(positions, rates);
  }

 private:
  int a_, b_;
};

class TransposedLinks : public ModelView {
 public:
  using ModelView::ModelView;
  [[nodiscard]] Pose CalcLinkPose(int joint) const override {
    Pose X = ModelView::CalcLinkPose(joint);
    X.linear().transposeInPlace();
    return X;
  }
};

class TransposedFrames : public ModelView {
 public:
  using ModelView::ModelView;
  [[nodiscard]] Pose CalcFramePose(int frame) const override {
    Pose X = ModelView::CalcFramePose(frame);
    X.linear().transposeInPlace();
    return X;
  }
};

/// Jacobians through a 6x6 matrix that depends on the frame's pose; J_dot scaled.
class FaultyJacobian : public ModelView {
 public:
  using Change = Matrix6d (*)(const Pose&);
  FaultyJacobian(const RobotModel& model, Coordinates coordinates, Change change, double rate)
      : ModelView(model, coordinates), change_(change), rate_(rate) {}
  void CalcFrameJacobian(int frame, Eigen::Ref<Matrix6Xd> J, Eigen::Ref<Matrix6Xd> J_dot) const override {
    ModelView::CalcFrameJacobian(frame, J, J_dot);
    J = change_(CalcFramePose(frame)) * J;
    J_dot *= rate_;
  }

 private:
  Change change_;
  double rate_;
};

class FaultyEnergy : public ModelView {
 public:
  using Change = void (*)(const ModelView&, EnergyAndMomentum*);
  FaultyEnergy(const RobotModel& model, Coordinates coordinates, Change change)
      : ModelView(model, coordinates), change_(change) {}
  [[nodiscard]] EnergyAndMomentum CalcEnergyAndMomentum() const override {
    EnergyAndMomentum terms = ModelView::CalcEnergyAndMomentum();
    change_(*this, &terms);
    return terms;
  }

 private:
  Change change_;
};

Matrix6d Unchanged(const Pose&) { return Matrix6d::Identity(); }

Matrix6d TurnedToWorld(const Pose& X) {
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = X.linear();
  turn.bottomRightCorner<3, 3>() = X.linear();
  return turn;
}

Matrix6d PartsExchanged(const Pose&) {
  Matrix6d exchange = Matrix6d::Zero();
  exchange.topRightCorner<3, 3>().setIdentity();
  exchange.bottomLeftCorner<3, 3>().setIdentity();
  return exchange;
}

/// The adjoint with the sign of its moment arm turned about.
Matrix6d WrongAdjoint(const Pose& X) {
  Pose arm = Pose::Identity();
  arm.translation() = X.linear().transpose() * X.translation();
  return CalcAdjoint(arm);
}

class MutantTable {
 public:
  explicit MutantTable(const RobotModel& model) : model_(model) {}

  void AddDynamics() {
    for (const auto& equation : ListRobotEquations(model_)) {
      if (equation.term != nullptr) AddView(equation.name, equation.term, Use<FaultyView>(equation.change));
    }
  }

  void AddKinematics() {
    const bool has_frames = !model_.frames().empty();
    AddView("link rotations transposed", "joint_axis", Use<TransposedLinks>());
    if (has_frames) {
      AddView("frame rotations transposed", "frame_pose", Use<TransposedFrames>());
      AddView("body Jacobian taken in world axes", "J", Use<FaultyJacobian>(&TurnedToWorld, 1.0));
      AddView("linear and angular part exchanged", "J", Use<FaultyJacobian>(&PartsExchanged, 1.0));
      AddView("moment arm of the adjoint with the wrong sign", "J", Use<FaultyJacobian>(&WrongAdjoint, 1.0));
      AddView("J_dot = 0", "J_dot_xi", Use<FaultyJacobian>(&Unchanged, 0.0));
      AddView("J_dot doubled", "J_dot_xi", Use<FaultyJacobian>(&Unchanged, 2.0));
    }
    for (int b = 0; b < model_.num_joints(); ++b) {
      const int a = model_.joints()[static_cast<size_t>(b)].parent;
      if (a < 0) continue;
      AddView("joints " + model_.joints()[static_cast<size_t>(a)].name + " and " +
                  model_.joints()[static_cast<size_t>(b)].name + " exchanged in q and xi",
              "joint_axis", Use<ExchangedJoints>(a, b));
    }
  }

  void AddEnergies() {
    AddView("kinetic energy doubled", "kinetic_energy",
            Use<FaultyEnergy>(+[](const ModelView&, EnergyAndMomentum* t) { t->kinetic *= 2.0; }));
    AddView("potential energy with the wrong sign", "potential_energy",
            Use<FaultyEnergy>(+[](const ModelView&, EnergyAndMomentum* t) { t->potential *= -1.0; }));
    AddView("angular momentum about the origin", "angular_momentum",
            Use<FaultyEnergy>(+[](const ModelView&, EnergyAndMomentum* t) {
              t->angular_momentum += t->com.cross(t->linear_momentum);
            }));
  }

  void AddObject() {
    AddObjectMutant("rotation of the object transposed", "object_pose", nullptr, [](const Vector6d& X_o) {
      Pose X = CalcObjectPose(X_o);
      X.linear().transposeInPlace();
      return X;
    });
    AddObjectMutant("X_o read as roll, pitch, yaw", "object_pose", nullptr, [](const Vector6d& X_o) {
      Pose X = CalcObjectPose(X_o);
      X.linear() =
          (Eigen::AngleAxisd(X_o[5], Vector3d::UnitZ()) * Eigen::AngleAxisd(X_o[4], Vector3d::UnitY()) *
           Eigen::AngleAxisd(X_o[3], Vector3d::UnitX()))
              .toRotationMatrix();
      return X;
    });
    for (const auto& equation : ListObjectEquations()) {
      AddObjectMutant(
          equation.name, equation.term,
          [change = equation.change](const MassProperties& body, const Vector3d& gravity, const Vector6d& X_o,
                                     const Vector6d& X_o_dot) {
            ObjectTerms terms = CalcObjectTerms(body, gravity, X_o, X_o_dot);
            change(&terms);
            return terms;
          },
          nullptr);
    }
  }

  void AddContact() {
    AddContactMutant("psi with the wrong sign", "contact_frame").contact.geometry =
        [](const Surface& tip, const Surface& object, ContactCoordinates kappa) {
          kappa.psi = -kappa.psi;
          return CalcContactGeometry(tip, object, kappa);
        };
    AddContactMutant("psi about the object's normal", "contact_frame").contact.geometry =
        [](const Surface& tip, const Surface& object, const ContactCoordinates& kappa) {
          ContactGeometry geometry = CalcContactGeometry(tip, object, kappa);
          geometry.g_o_cf.linear() = geometry.object.R * Vector3d(1.0, -1.0, -1.0).asDiagonal() *
                                     Eigen::AngleAxisd(-kappa.psi, Vector3d::UnitZ()).toRotationMatrix();
          return geometry;
        };
    for (const auto& equation : ListGraspMapEquations()) {
      AddContactMutant(equation.name, equation.term).contact.grasp_map =
          [change = equation.change](const Contact& contact, Eigen::Ref<Matrix6Xd> G) {
            G = change(contact.geometry.g_o_cf).leftCols<3>();
          };
    }
    for (const auto& equation : ListContactJacobianEquations()) {
      AddContactMutant(equation.name, equation.term).contact.jacobian =
          [change = equation.change](const Contact& contact, const Eigen::Ref<const Matrix6Xd>& J_f,
                                     Eigen::Ref<MatrixXd> rows) { rows = change(contact.geometry, J_f); };
    }
    for (const auto& equation : ListRollingEquations())
      AddContactMutant(equation.name, equation.term).contact.kappa_dot = equation.change;
  }

  std::vector<FormulaMutant> Take() { return std::move(mutants_); }

 private:
  FormulaMutant& Add(const std::string& name, const std::string& first) {
    FormulaMutant& mutant = mutants_.emplace_back();
    mutant.name = name;
    mutant.kind = "wrong equation";
    mutant.first = first;
    return mutant;
  }
  void AddView(const std::string& name, const std::string& first, ModelViewFactory view) {
    FormulaMutant& mutant = Add(name, first);
    mutant.options.make_view = std::move(view);
    mutant.of_model = true;
  }
  void AddObjectMutant(const std::string& name, const std::string& first,
                       decltype(ObjectFormulas::terms) terms, decltype(ObjectFormulas::pose) pose) {
    FormulaMutant& mutant = Add(name, first);
    if (terms) mutant.options.object.terms = std::move(terms);
    if (pose) mutant.options.object.pose = std::move(pose);
  }
  FormulaMutant& AddContactMutant(const std::string& name, const std::string& first) {
    FormulaMutant& mutant = Add(name, first);
    mutant.of_contact = true;
    return mutant;
  }

  const RobotModel& model_;
  std::vector<FormulaMutant> mutants_;
};

}  // namespace

std::vector<FormulaMutant> ListFormulaMutants(const RobotModel& model) {
  MutantTable table(model);
  table.AddDynamics();
  table.AddKinematics();
  table.AddEnergies();
  if (model.object()) table.AddObject();
  if (model.object() && !model.fingertips().empty()) table.AddContact();
  return table.Take();
}

void RunFormulaMutant(const Adapter& adapter, int samples, FormulaMutant* mutant) {
  std::vector<CheckRecord> records;
  if (mutant->of_contact) {
    const RobotModel& model = adapter.model();
    StateSource source(model, {}, mutant->options.seed);
    VectorXd q = VectorXd::Zero(model.num_positions());
    VectorXd xi = VectorXd::Zero(model.num_velocities());
    for (int sample = 0; sample < samples; ++sample) {
      source.DrawPositions(&q);
      source.DrawVelocity(&xi);
      const std::vector<int>& tips = model.fingertips();
      ContactCheck check(adapter, tips[static_cast<size_t>(sample) % tips.size()], mutant->contact);
      check.Compare(q, xi, &source, sample);
      records.resize(check.records().size());
      for (size_t i = 0; i < records.size(); ++i) {
        if (!records[i].failed) records[i] = check.records()[i];
      }
    }
  } else {
    mutant->options.samples = samples;
    records = CheckConsistency(adapter, mutant->options, [](long) { return true; }).terms;
  }
  mutant->AddFailed(records);
  mutant->named_first = std::any_of(records.begin(), records.end(), [&](const CheckRecord& record) {
    return record.failed && record.name == mutant->first;
  });
  mutant->outcome = mutant->failed_checks.empty() ? MutantOutcome::kSurvived : MutantOutcome::kKilled;
  if (mutant->outcome == MutantOutcome::kSurvived && mutant->of_model &&
      !HasEffect(adapter.model(), mutant->options.make_view(adapter.model(), Coordinates::kReduced).get(),
                 samples, mutant->options.seed))
    mutant->outcome = MutantOutcome::kNoEffect;
}

}  // namespace dexcheck
