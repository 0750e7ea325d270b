#pragma once

#include <functional>
#include <memory>

#include "controller/contact/contact_geometry.h"
#include "controller/contact/grasp_map.h"
#include "controller/contact/shapes.h"
#include "harness/comparison/term_comparison.h"
#include "harness/comparison/term_table.h"
#include "harness/descriptions/engine_provider.h"
#include "harness/descriptions/random_states.h"

namespace dexcheck {

/// Evaluates the contact of one of the compared frames by the engine: its narrow phase, the motion of the two
/// bodies that touch, and the model's values that follow from the contact alone. @param contact by the model.
/// @param shift carries the projected robot to its place in the plant.
void EvaluateContact(const Contact& contact, const Pose& shift, size_t index, EngineProvider* engine,
                     ContactValues* model, ScaleContext* scales);

// The contact equations (22)-(40) against the engine's motion of the two bodies that touch.

/// The model's contact equations. Tests of the checks replace them by wrong ones.
struct ContactFormulas {
  std::function<ContactGeometry(const Surface&, const Surface&, const ContactCoordinates&)> geometry =
      [](const Surface& fingertip, const Surface& object, const ContactCoordinates& kappa) {
        return CalcContactGeometry(fingertip, object, kappa);
      };
  std::function<void(const Contact&, Eigen::Ref<Matrix6Xd>)> grasp_map = [](const Contact& contact,
                                                                            Eigen::Ref<Matrix6Xd> G) {
    CalcGraspMap({&contact, 1}, G);
  };
  std::function<void(const Contact&, const Eigen::Ref<const Matrix6Xd>&, Eigen::Ref<MatrixXd>)> jacobian =
      [](const Contact& contact, const Eigen::Ref<const Matrix6Xd>& J_f, Eigen::Ref<MatrixXd> rows) {
        CalcContactJacobian(contact, J_f, rows);
      };
  std::function<Vector5d(const ContactGeometry&, const Vector6d&)> kappa_dot = CalcKappaDot;
};

/// Puts the object against a fingertip at random contact coordinates. Compares g_o_cf, G and J_B' with the
/// engine's narrow phase and the motion of its two bodies, and whether Sigma_cf, moved by (40), stays one
/// frame.
class ContactCheck {
 public:
  /// @param fingertip a frame that carries a sphere.
  /// @throws InputError unless the fingertip can touch and the object is a free torus or another smooth one.
  ContactCheck(const Adapter& adapter, int fingertip, ContactFormulas formulas = {});

  /// One contact at q', xi.
  void Compare(const VectorXd& q, const VectorXd& xi, StateSource* source, long sample);

  [[nodiscard]] std::span<const CheckRecord> records() const { return comparison_.records(); }

 private:
  /// The model's values at the contact.
  class ModelProvider : public MechanismProvider {
   public:
    explicit ModelProvider(int size) : MechanismProvider("model") {
      contacts_.resize(1);
      contacts_[0].J_B.setZero(3, size);
    }
    void SetState(const DynamicsState&) override {}
    [[nodiscard]] bool Has(Term term) const override { return HasValue(term); }
    void Read(Term term, Eigen::Ref<MatrixXd> out) override { ReadValues(term, out); }
  };

  /// Pose of the object in the engine's world at these contact coordinates.
  [[nodiscard]] Pose CalcObjectPose(const ContactCoordinates& kappa, const Pose& X_cf) const;

  int fingertip_;
  ContactFormulas formulas_;
  EngineProvider engine_;
  ModelProvider model_;
  TermComparison comparison_;
  ModelTerms robot_;
  Sphere tip_;
  std::unique_ptr<Surface> object_;
  Matrix6Xd J_f_, J_f_dot_, G_;
};

}  // namespace dexcheck
