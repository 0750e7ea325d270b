#pragma once

// The first of the harness's questions at random states: are the model's terms the engine's?

#include <functional>
#include <memory>
#include <vector>

#include "controller/object/euler_zyz.h"
#include "controller/object/object_dynamics.h"
#include "harness/checks/term_comparison.h"

namespace dexcheck {

/// The model's equations of the object. Checks of checks put wrong ones in their place.
struct ObjectFormulas {
  std::function<ObjectTerms(const MassProperties&, const Vector3d&, const Vector6d&, const Vector6d&)> terms =
      CalcObjectTerms;
  std::function<Pose(const Vector6d&)> pose = CalcObjectPose;
};

/// Compares all terms of robot and object at a state, and remembers the worst. The object's state in the
/// engine is built by its own quaternion algebra.
class ModelCheck : public TermComparison {
 public:
  /// @param make_view what stands for the model; a test may put a wrong one there.
  /// @throws InputError when the model's object does not move by a free joint alone.
  explicit ModelCheck(const Adapter& adapter, const ModelViewFactory& make_view = MakeModelView,
                      ObjectFormulas object = {});

  /// @param q q'. @param xi reduced velocity.
  /// @param w a second velocity, which probes the matrix C_bar' beyond its product with xi: C_bar(xi) w.
  /// @param X_o, X_o_dot of the object, if the model has one.
  void Compare(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& xi,
               const Eigen::Ref<const VectorXd>& w, const Vector6d& X_o, const Vector6d& X_o_dot,
               long sample);

 private:
  void ReadObject(const Vector6d& X_o, const Vector6d& X_o_dot);

  ObjectFormulas object_;
  EngineTerms engine_, engine_unreduced_;
  std::unique_ptr<ModelView> robot_, unreduced_;
  ModelTerms terms_at_w_;  // for scales only
  RoundingScales scales_at_w_;
  VectorXd unreduced_velocity_;
  std::vector<Matrix6Xd> J_, J_dot_;
};

}  // namespace dexcheck
