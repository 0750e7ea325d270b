#pragma once

// What a check sees of the analytic model. Checks of checks put a view with a fault in its place.

#include <functional>
#include <memory>

#include "controller/dynamics/model_terms.h"

namespace dexcheck {

/// The model's terms at one state, as they are. A derived view may spoil any of them.
class ModelView {
 public:
  /// The model must outlive the view.
  ModelView(const RobotModel& model, Coordinates coordinates)
      : own_(std::make_unique<ModelTerms>(model, coordinates)), terms_(own_.get()) {}
  /// A view of terms that somebody else evaluates.
  explicit ModelView(const ModelTerms& terms) : terms_(&terms) {}
  virtual ~ModelView() = default;
  ModelView(const ModelView&) = delete;
  ModelView& operator=(const ModelView&) = delete;

  /// Everything at q' and velocity; not of somebody else's terms.
  virtual void SetState(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& velocity) {
    own_->SetState(q, velocity);
    own_->CalcDynamics();
  }

  [[nodiscard]] const RobotModel& model() const { return terms_->model(); }
  [[nodiscard]] int size() const { return terms_->size(); }
  [[nodiscard]] virtual const MatrixXd& M() const { return terms_->M(); }
  [[nodiscard]] virtual const MatrixXd& C() const { return terms_->C(); }
  [[nodiscard]] virtual const VectorXd& gravity() const { return terms_->gravity(); }
  [[nodiscard]] virtual const VectorXd& friction() const { return terms_->friction(); }
  [[nodiscard]] virtual Pose CalcLinkPose(int joint) const { return terms_->CalcLinkPose(joint); }
  [[nodiscard]] virtual Pose CalcFramePose(int frame) const { return terms_->CalcFramePose(frame); }
  virtual void CalcFrameJacobian(int frame, Eigen::Ref<Matrix6Xd> J, Eigen::Ref<Matrix6Xd> J_dot) const {
    terms_->CalcFrameJacobian(frame, J, J_dot);
  }
  [[nodiscard]] virtual EnergyAndMomentum CalcEnergyAndMomentum() const {
    return terms_->CalcEnergyAndMomentum();
  }
  /// The model's own terms, for scales only.
  [[nodiscard]] const ModelTerms& terms() const { return *terms_; }

 private:
  std::unique_ptr<ModelTerms> own_;
  const ModelTerms* terms_;
};

using ModelViewFactory = std::function<std::unique_ptr<ModelView>(const RobotModel&, Coordinates)>;

/// The model as it is.
inline std::unique_ptr<ModelView> MakeModelView(const RobotModel& model, Coordinates coordinates) {
  return std::make_unique<ModelView>(model, coordinates);
}

}  // namespace dexcheck
