#pragma once

// The first of the harness's questions: at one state, are the model's terms the engine's?

#include <memory>
#include <vector>

#include "harness/checks/check_record.h"
#include "harness/checks/model_view.h"
#include "harness/checks/rounding_scales.h"
#include "harness/engine/engine_terms.h"

namespace dexcheck {

/// Compares all robot terms at a state, and remembers the worst. Nothing allocates after construction but
/// when a new worst case is stored.
class ModelCheck {
 public:
  /// @param make_view what stands for the model; a test may put a wrong one there.
  explicit ModelCheck(const Adapter& adapter, const ModelViewFactory& make_view = MakeModelView);

  /// @param q q'. @param xi reduced velocity.
  /// @param w a second velocity, which probes the matrix C_bar' beyond its product with xi: C_bar(xi) w.
  void Compare(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& xi,
               const Eigen::Ref<const VectorXd>& w, long sample);

  [[nodiscard]] const std::vector<CheckRecord>& records() const { return records_; }
  [[nodiscard]] int base_velocities() const { return terms_->model().num_base_velocities(); }

 private:
  enum Term {
    kJointAxis,
    kLinkCom,
    kLinkInertia,
    kFramePose,
    kJ,
    kJDotXi,
    kMassMatrix,
    kReducedMassMatrix,
    kCoriolisForce,
    kCoriolisMatrix,
    kGravity,
    kFriction,
    kKineticEnergy,
    kPotentialEnergy,
    kLinearMomentum,
    kAngularMomentum,
    kTermCount
  };
  CheckRecord& record(Term term) { return records_[term]; }

  void CompareGeometry();
  void CompareFrames(const Eigen::Ref<const VectorXd>& xi);
  void CompareMassMatrices();
  void CompareForces(const Eigen::Ref<const VectorXd>& xi, const Eigen::Ref<const VectorXd>& w,
                     const Eigen::Ref<const VectorXd>& q);
  void CompareEnergies();

  std::unique_ptr<ModelView> terms_;
  std::unique_ptr<ModelView> unreduced_;
  EngineTerms engine_;
  EngineTerms engine_unreduced_;
  std::vector<CheckRecord> records_;
  RoundingScales scales_;
  ModelTerms terms_at_w_;  // for scales only
  RoundingScales scales_at_w_;
  double sample_ = -1.0;

  VectorXd unreduced_velocity_;
  Matrix6Xd J_, J_dot_, J_engine_;
  VectorXd force_, force_engine_;
};

}  // namespace dexcheck
