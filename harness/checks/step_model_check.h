#pragma once

// The first of the harness's questions at every step of a run: are the controller's terms the engine's?

#include <span>
#include <string>
#include <vector>

#include "controller/control/grasp_controller.h"
#include "harness/checks/check_record.h"
#include "harness/checks/rounding_scales.h"
#include "harness/checks/step_term.h"
#include "harness/engine/engine_step.h"

namespace dexcheck {

/// Compares the terms that the controller has evaluated with the engine's at the projected state (no tilt,
/// rolling wheels), and remembers the worst of the run. What ModelCheck has beyond this (M unreduced, the
/// matrix C_bar', link inertias) needs no run.
class StepModelCheck {
 public:
  /// @param fingertips frames of the grasp. @param orientation kAngles when the grasp's state is set by X_o,
  /// whose terms are then compared besides.
  /// @throws InputError as EngineStep.
  StepModelCheck(const Adapter& adapter, std::span<const int> fingertips, OrientationFeedback orientation);

  /// Whether Compare includes the contacts' terms. Not for bonds, where the engine has no contact to compare
  /// with, nor while a fingertip is far from the object.
  void IncludeContacts(bool include) { with_contacts_ = include; }
  [[nodiscard]] bool includes_contacts() const { return with_contacts_; }
  /// Whether a record belongs to the contacts.
  [[nodiscard]] static bool IsOfContacts(size_t record) {
    return record >= kContactFrame && record <= kGDotV;
  }

  /// @param robot, grasp evaluated at `state`, reduced coordinates, CalcDynamics included.
  /// @param X_W0 pose of Sigma_0 in the plant, tilt and height included: kappa was found there. Without a
  /// plant, robot.CalcLinkPose(-1).
  void Compare(const ModelTerms& robot, const GraspTerms& grasp, const MeasuredState& state, const Pose& X_W0,
               long step);

  /// Worst over all steps, in a fixed order.
  [[nodiscard]] std::vector<CheckRecord> records() const;
  /// Largest relative error of each record at the last step.
  [[nodiscard]] std::span<const double> step_errors() const { return step_errors_; }
  [[nodiscard]] const std::string& name(size_t record) const { return terms_[record].record().name; }

 private:
  enum Term {
    kFramePose,
    kJ,
    kJDotXi,
    kMassMatrix,
    kCoriolisForce,
    kGravity,
    kFriction,
    kKineticEnergy,
    kPotentialEnergy,
    kLinearMomentum,
    kAngularMomentum,
    kContactFrame,
    kG,
    kJB,
    kJBDotXi,
    kGDotV,
    kMHat,
    kCHatV,
    kNo,
    kObjectKineticEnergy,
    kObjectPotentialEnergy,
    kObjectPose,  // from here on with kAngles alone: a pose that is measured and used as it is tells nothing
    kBodyVelocity,
    kMo,
    kCoXoDot,
    kTermCount
  };
  /// Sizes that a contact's rounding errors are relative to.
  struct ContactScales {
    double normal;    ///< Of directions.
    double position;  ///< m
  };

  /// Sigma_cf by the engine, in the plant's world and where the projected robot has it.
  struct ContactPlace {
    Matrix3d R;
    Vector3d p;
    Matrix3d R_projected;
    Vector3d p_projected;
    ContactScales scales;
  };

  StepTerm& term(Term term) { return terms_[term]; }
  void DefineRobotTerms();
  void DefineGraspTerms();
  [[nodiscard]] ContactScales CalcContactScales(const ContactGeometry& contact) const;

  void CompareFrames(const ModelTerms& robot);
  void CompareJacobians(const ModelTerms& robot, long step);
  void CompareMass(const ModelTerms& robot, long step);
  void CompareForces(const ModelTerms& robot, const MeasuredState& state);
  void CompareEnergies(const ModelTerms& robot);
  void CompareContacts(const GraspTerms& grasp, const MeasuredState& state, const Pose& X_W0, long step);
  void CompareContactRates(const Contact& contact, int finger, const ContactPlace& place);
  void CompareObject(const GraspTerms& grasp, const MeasuredState& state);

  const Adapter* adapter_;
  std::vector<int> fingertips_;
  bool has_coordinates_;
  bool with_contacts_ = true;
  EngineStep engine_;
  RoundingScales scales_;
  std::vector<StepTerm> terms_;
  std::vector<double> step_errors_;

  std::vector<Eigen::Index> mass_offsets_;  // in M_bar', of the engine's entries, then of their mirror images
  std::vector<ZeroPattern> J_zeros_;        // by fingertip
  std::vector<ZeroPattern> other_zeros_;    // of M_bar' and J_B'
  Eigen::ArrayXd velocity_weights_;         // 1 / CalcVelocityScale
  Matrix6Xd J_, J_dot_, J_engine_;
  VectorXd force_, J_B_dot_xi_;
};

}  // namespace dexcheck
