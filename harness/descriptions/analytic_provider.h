#pragma once

// A view of the analytic model, as checks see it. Checks of checks put a view with a fault in its place.

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "controller/dynamics/model_terms.h"
#include "controller/object/object_dynamics.h"
#include "controller/object/so3.h"
#include "harness/descriptions/dynamics_provider.h"

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

// The analytic model's terms (controller/).

/// The model's equations of the object. Checks of checks put wrong ones in their place.
struct ObjectFormulas {
  std::function<ObjectTerms(const MassProperties&, const Vector3d&, const Vector6d&, const Vector6d&)> terms =
      CalcObjectTerms;
  std::function<Pose(const Vector6d&)> pose = CalcObjectPose;
};

/// Maps entries of one model to those of another: joints and frames are matched by name.
struct CoordinateMap {
  /// The model's own. @param frames whose Jacobians are compared.
  CoordinateMap(const RobotModel& model, std::vector<int> frames);
  /// Finds the entry of `model` for each of `coordinates`. @throws InputError when a joint has no
  /// counterpart.
  CoordinateMap(const RobotModel& model, const RobotModel& coordinates);

  bool is_identity = true;
  std::vector<int> positions, velocities, joints, frames;
  std::vector<int> compared_frames;  ///< Whose Jacobians are compared, in the order of the comparison.
};

/// The analytic model as a provider.
class AnalyticProvider : public MechanismProvider {
 public:
  /// All frames. The model must outlive the provider.
  /// @param make_view what stands for the model; a test may put a wrong one there.
  AnalyticProvider(const RobotModel& model, std::string name,
                   const ModelViewFactory& make_view = MakeModelView, ObjectFormulas object = {});
  /// A model of its own.
  AnalyticProvider(const RobotSpec& robot, std::string name);
  /// Another model of the robot, in the coordinates of the first.
  AnalyticProvider(const RobotModel& model, std::string name, const RobotModel& coordinates);

  void SetState(const DynamicsState& state) override;
  [[nodiscard]] bool Has(Term term) const override;
  void Read(Term term, Eigen::Ref<MatrixXd> out) override;
  [[nodiscard]] bool HasMass(int link) const override;

 protected:
  /// Terms that somebody else evaluates; the derived class sets view and Jacobians at each state.
  AnalyticProvider(const RobotModel& model, std::string name, std::vector<int> frames);
  void ReadEnergy() { energy_ = view_->CalcEnergyAndMomentum(); }

  const RobotModel* model_;
  CoordinateMap map_;
  const ModelView* view_ = nullptr;
  std::vector<std::pair<const Matrix6Xd*, const Matrix6Xd*>>
      jacobians_;  ///< J, J_dot of the frames compared.
  VectorXd xi_;    ///< In this model's order.

 private:
  AnalyticProvider(std::shared_ptr<const RobotModel> model, std::string name);
  AnalyticProvider(const RobotModel& model, std::string name, CoordinateMap map,
                   const ModelViewFactory& make_view, ObjectFormulas object);
  void ReadObject(const DynamicsState& state);
  void CalcJacobians();
  void ReadJacobians(Eigen::Ref<MatrixXd> out) const;
  void ReadAccelerations(Eigen::Ref<MatrixXd> out) const;
  void ReadVelocities(const Eigen::Ref<const VectorXd>& own, Eigen::Ref<MatrixXd> out) const;
  void ReadMatrix(const MatrixXd& own, Eigen::Ref<MatrixXd> out) const;

  std::shared_ptr<const RobotModel> own_model_;
  std::unique_ptr<ModelView> own_view_, unreduced_;
  bool has_jacobians_ = false;  // at the state set
  ObjectFormulas formulas_;
  VectorXd q_, w_, unreduced_velocity_;
  std::vector<std::pair<Matrix6Xd, Matrix6Xd>> own_jacobians_;
  std::vector<std::vector<int>> chains_;  // of the frames compared
};

}  // namespace dexcheck
