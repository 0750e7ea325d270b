#include "harness/diagnosis/formula_mutants.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "controller/contact/adjoint.h"
#include "controller/model/platform.h"
#include "controller/object/object_dynamics.h"
#include "harness/diagnosis/spoiled_views.h"

namespace dexcheck {
namespace {

class MutantTable {
 public:
  explicit MutantTable(const RobotModel& model) : model_(model) {}

  void AddDynamics() {
    using Terms = SpoiledView::Terms;
    AddView("Coriolis terms dropped", "C_bar_xi", Spoil([](Terms* t) { t->C.setZero(); }));
    AddView("Coriolis matrix transposed", "C_bar_xi", Spoil([](Terms* t) { t->C.transposeInPlace(); }));
    AddView("one joint's Coriolis row dropped", "C_bar_xi",
            Spoil([](Terms* t) { t->C.row(t->C.rows() / 2).setZero(); }));
    AddView("Coriolis matrix without coupling", "C_bar",
            Spoil([](Terms* t) { t->C = MatrixXd(t->C.diagonal().asDiagonal()); }));
    AddFactorisations();
    AddView("gravity with the wrong sign", "gravity", Spoil([](Terms* t) { t->gravity *= -1.0; }));
    AddView("friction dropped", "friction", Spoil([](Terms* t) { t->friction.setZero(); }));
    AddView("friction with the wrong sign", "friction", Spoil([](Terms* t) { t->friction *= -1.0; }));
    AddView("half of the mass matrix not mirrored", "M_bar",
            Spoil([](Terms* t) { t->M.triangularView<Eigen::StrictlyUpper>().setZero(); }));
    if (HasArmature()) {
      AddView("armature left out of M", "M_bar", Spoil([](Terms* t) {
                const Eigen::Index base = t->M.rows() - t->model.num_joints();
                for (int i = 0; i < t->model.num_joints(); ++i)
                  t->M(base + i, base + i) -= t->model.joints()[static_cast<size_t>(i)].armature;
              }));
    }
    if (model_.base().type != BaseType::kDifferentialDrive) return;
    AddView("S_v_dot = 0", "C_bar_xi", Spoil([](Terms* t) {
              if (t->M.rows() != t->model.num_velocities()) return;
              // C_bar = S^T C S + S^T M S_dot of (14), without the second term.
              ModelTerms unreduced(t->model, Coordinates::kUnreduced);
              const PlatformConstraint platform =
                  CalcPlatformConstraint(t->model.base(), t->q.head<3>(), t->velocity.head<2>());
              const Eigen::Index n = t->M.rows();
              MatrixXd S = MatrixXd::Zero(n + 1, n);
              MatrixXd S_dot = S;
              S.topLeftCorner<3, 2>() = platform.S_v;
              S.bottomRightCorner(n - 2, n - 2).setIdentity();
              S_dot.topLeftCorner<3, 2>() = platform.S_v_dot;
              unreduced.SetState(t->q, S * t->velocity);
              unreduced.CalcDynamics();
              t->C -= S.transpose() * unreduced.M() * S_dot;
            }));
    AddView("wheel spin left out of M", "M_bar", Spoil([](Terms* t) {
              if (t->M.rows() != t->model.num_velocities()) return;
              const WheelProperties& wheel = t->model.base().wheel;
              const Matrix2d W = CalcWheelRateMap(t->model.base());
              t->M.topLeftCorner<2, 2>() -= (wheel.spin_inertia + wheel.armature) * W.transpose() * W;
            }));
  }

  void AddKinematics() {
    const bool has_frames = !model_.frames().empty();
    AddView("link rotations transposed", "joint_axis", Use<TransposedLinks>());
    if (has_frames) {
      AddView("frame rotations transposed", "frame_pose", Use<TransposedFrames>());
      AddView("body Jacobian taken in world axes", "J", Use<SpoiledJacobian>(&TurnedToWorld, 1.0));
      AddView("linear and angular part exchanged", "J", Use<SpoiledJacobian>(&PartsExchanged, 1.0));
      AddView("moment arm of the adjoint with the wrong sign", "J", Use<SpoiledJacobian>(&WrongAdjoint, 1.0));
      AddView("J_dot = 0", "J_dot_xi", Use<SpoiledJacobian>(&Unchanged, 0.0));
      AddView("J_dot doubled", "J_dot_xi", Use<SpoiledJacobian>(&Unchanged, 2.0));
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
            Use<SpoiledEnergy>(+[](const ModelView&, EnergyAndMomentum* t) { t->kinetic *= 2.0; }));
    AddView("potential energy with the wrong sign", "potential_energy",
            Use<SpoiledEnergy>(+[](const ModelView&, EnergyAndMomentum* t) { t->potential *= -1.0; }));
    AddView("angular momentum about the origin", "angular_momentum",
            Use<SpoiledEnergy>(+[](const ModelView&, EnergyAndMomentum* t) {
              t->angular_momentum += t->com.cross(t->linear_momentum);
            }));
  }

  void AddObject() {
    using Terms = ObjectTerms;
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
    const auto spoil = [&](const std::string& name, const std::string& first, void (*change)(Terms*)) {
      AddObjectMutant(
          name, first,
          [change](const MassProperties& body, const Vector3d& gravity, const Vector6d& X_o,
                   const Vector6d& X_o_dot) {
            Terms terms = CalcObjectTerms(body, gravity, X_o, X_o_dot);
            change(&terms);
            return terms;
          },
          nullptr);
    };
    spoil("body velocity in world axes", "P_inv", [](Terms* t) {
      const Matrix3d R = t->P_inv.topLeftCorner<3, 3>().transpose();
      t->V_Bo.head<3>() = R * t->V_Bo.head<3>();
      t->V_Bo.tail<3>() = R * t->V_Bo.tail<3>();
    });
    spoil("M_o of the Lagrange form", "M_o", [](Terms* t) { t->M_o = t->P_inv.transpose() * t->M_o; });
    // A wrong P^-1 that M_o and C_o share.
    spoil("P^-1 of angles in reverse", "M_o", [](Terms* t) {
      t->P_inv.col(3).swap(t->P_inv.col(5));
      t->M_o = t->body.M_hat * t->P_inv;
    });
    spoil("rate of P^-1 with the wrong sign", "C_o_X_o_dot", [](Terms* t) {
      t->P_inv_dot *= -1.0;
      t->C_o = t->body.M_hat * t->P_inv_dot + t->body.C_hat * t->P_inv;
    });
    spoil("C_o without the rate of P^-1", "C_o_X_o_dot", [](Terms* t) { t->C_o = t->body.C_hat * t->P_inv; });
    spoil("C_o without gyroscopic terms", "C_o_X_o_dot",
          [](Terms* t) { t->C_o = t->body.M_hat * t->P_inv_dot; });
    spoil("N_o with the wrong sign", "N_o", [](Terms* t) { t->N_o *= -1.0; });
    spoil("N_o in world axes", "N_o",
          [](Terms* t) { t->N_o.head<3>() = t->P_inv.topLeftCorner<3, 3>().transpose() * t->N_o.head<3>(); });
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
    const auto map = [&](const std::string& name, Matrix6d (*transform)(const Pose&)) {
      AddContactMutant(name, "G").contact.grasp_map = [transform](const Contact& contact,
                                                                  Eigen::Ref<Matrix6Xd> G) {
        G = transform(contact.geometry.g_o_cf).leftCols<3>();
      };
    };
    map("G without moments", [](const Pose& g) {
      Matrix6d transform = CalcWrenchTransform(g);
      transform.bottomRows<3>().setZero();
      return transform;
    });
    map("G with Ad^T instead of Ad^-T", [](const Pose& g) { return Matrix6d(CalcAdjoint(g).transpose()); });
    map("G with Ad instead of Ad^-T", [](const Pose& g) { return CalcAdjoint(g); });
    map("G with the rotation transposed", [](const Pose& g) {
      Pose turned = g;
      turned.linear().transposeInPlace();
      return CalcWrenchTransform(turned);
    });
    AddContactMutant("J_B' with Ad instead of its inverse", "J_B").contact.jacobian =
        [](const Contact& contact, const Eigen::Ref<const Matrix6Xd>& J_f, Eigen::Ref<MatrixXd> rows) {
          rows = (CalcAdjoint(contact.geometry.g_f_cf) * J_f).topRows(3);
        };
    AddContactMutant("J_B' at the fingertip's centre", "J_B").contact.jacobian =
        [](const Contact& contact, const Eigen::Ref<const Matrix6Xd>& J_f, Eigen::Ref<MatrixXd> rows) {
          rows = contact.geometry.g_f_cf.linear().transpose() * J_f.topRows(3);
        };
    const auto roll = [&](const std::string& name,
                          Vector5d (*rate)(const ContactGeometry&, const Vector6d&)) {
      AddContactMutant(name, "kappa_dot").contact.kappa_dot = rate;
    };
    roll("spin term dropped in (40)", [](const ContactGeometry& contact, const Vector6d& V) {
      Vector6d without = V;
      without[5] = 0.0;
      return CalcKappaDot(contact, without);
    });
    roll("slip dropped in (40)", [](const ContactGeometry& contact, const Vector6d& V) {
      Vector6d without = V;
      without.head<2>().setZero();
      return CalcKappaDot(contact, without);
    });
    roll("rolling about the wrong axis in (40)", [](const ContactGeometry& contact, const Vector6d& V) {
      Vector6d turned = V;
      std::swap(turned[3], turned[4]);
      return CalcKappaDot(contact, turned);
    });
    roll("object's curvature not turned by psi in (40)",
         [](const ContactGeometry& contact, const Vector6d& V) {
           ContactGeometry wrong = contact;
           wrong.object.K = contact.R_psi * contact.object.K * contact.R_psi;
           return CalcKappaDot(wrong, V);
         });
    roll("fingertip's torsion dropped in (40)", [](const ContactGeometry& contact, const Vector6d& V) {
      ContactGeometry wrong = contact;
      wrong.fingertip.T.setZero();
      return CalcKappaDot(wrong, V);
    });
    roll("object's torsion dropped in (40)", [](const ContactGeometry& contact, const Vector6d& V) {
      ContactGeometry wrong = contact;
      wrong.object.T.setZero();
      return CalcKappaDot(wrong, V);
    });
    roll("object's metric dropped in (40)", [](const ContactGeometry& contact, const Vector6d& V) {
      ContactGeometry wrong = contact;
      wrong.object.M.setIdentity();
      return CalcKappaDot(wrong, V);
    });
  }

  std::vector<FormulaMutant> Take() { return std::move(mutants_); }

 private:
  /// Other matrices with the same force: C + S with S xi = 0.
  void AddFactorisations() {
    using Terms = SpoiledView::Terms;
    const int n = model_.num_velocities();
    if (n >= 2) {
      AddView("Coriolis matrix without Property 2", "C_bar", Spoil([](Terms* t) {
                const Eigen::Index last = t->C.rows() - 1;
                t->C(last, last - 1) += t->M(last, last) * t->velocity[last];
                t->C(last, last) -= t->M(last, last) * t->velocity[last - 1];
              }));
    }
    if (n >= 3) {
      AddView("Coriolis matrix plus an antisymmetric part", "C_bar", Spoil([](Terms* t) {
                const Eigen::Index last = t->C.rows() - 1;
                t->C.bottomRightCorner<3, 3>() += t->M(last, last) * Skew(t->velocity.tail<3>());
              }));
    }
  }
  [[nodiscard]] bool HasArmature() const {
    return std::any_of(model_.joints().begin(), model_.joints().end(),
                       [](const Joint& joint) { return joint.armature > 0.0; });
  }

  FormulaMutant& Add(const std::string& name, const std::string& first) {
    FormulaMutant& mutant = mutants_.emplace_back();
    mutant.name = name;
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

/// Everything that a view shows at one state, and its size.
VectorXd CollectTerms(const ModelView& view) {
  std::vector<double> all;
  const auto append = [&](const MatrixXd& terms) {
    all.insert(all.end(), terms.data(), terms.data() + terms.size());
  };
  append(view.M());
  append(view.C());
  append(view.gravity());
  append(view.friction());
  for (int link = -1; link < view.model().num_joints(); ++link) append(view.CalcLinkPose(link).matrix());
  Matrix6Xd J(6, view.size());
  Matrix6Xd J_dot(6, view.size());
  for (size_t frame = 0; frame < view.model().frames().size(); ++frame) {
    append(view.CalcFramePose(static_cast<int>(frame)).matrix());
    view.CalcFrameJacobian(static_cast<int>(frame), J, J_dot);
    append(J);
    append(J_dot);
  }
  const EnergyAndMomentum energies = view.CalcEnergyAndMomentum();
  append(Vector2d(energies.kinetic, energies.potential));
  append(energies.linear_momentum);
  append(energies.angular_momentum);
  return Eigen::Map<const VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
}

/// Whether the fault changes anything at the states by more than rounding.
bool HasEffect(const RobotModel& model, const ModelViewFactory& make_view, int samples, std::uint64_t seed) {
  constexpr double kRounding = 1e-14;
  StateSource source(model, {}, seed);
  const std::unique_ptr<ModelView> right = MakeModelView(model, Coordinates::kReduced);
  const std::unique_ptr<ModelView> wrong = make_view(model, Coordinates::kReduced);
  VectorXd q = VectorXd::Zero(model.num_positions());
  VectorXd xi = VectorXd::Zero(model.num_velocities());
  for (int sample = 0; sample < samples; ++sample) {
    source.DrawPositions(&q);
    source.DrawVelocity(&xi);
    right->SetState(q, xi);
    wrong->SetState(q, xi);
    const VectorXd terms = CollectTerms(*right);
    const double size = 1.0 + terms.cwiseAbs().maxCoeff();
    if ((CollectTerms(*wrong) - terms).cwiseAbs().maxCoeff() > kRounding * size) return true;
  }
  return false;
}

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
  for (const CheckRecord& record : records) {
    if (!record.failed) continue;
    mutant->failed_checks += (mutant->failed_checks.empty() ? "" : " ") + record.name;
    mutant->localised = mutant->localised || record.name == mutant->first;
  }
  mutant->outcome = mutant->failed_checks.empty() ? MutantOutcome::kSurvived : MutantOutcome::kKilled;
  if (mutant->outcome == MutantOutcome::kSurvived && mutant->of_model &&
      !HasEffect(adapter.model(), mutant->options.make_view, samples, mutant->options.seed))
    mutant->outcome = MutantOutcome::kNoEffect;
}

}  // namespace dexcheck
