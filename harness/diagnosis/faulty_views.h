#pragma once

// Views of the model with a fault in them.

#include <memory>
#include <utility>

#include "controller/contact/adjoint.h"
#include "harness/checks/model_view.h"
#include "harness/diagnosis/equation_faults.h"

namespace dexcheck {

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

inline Matrix6d Unchanged(const Pose&) { return Matrix6d::Identity(); }

inline Matrix6d TurnedToWorld(const Pose& X) {
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = X.linear();
  turn.bottomRightCorner<3, 3>() = X.linear();
  return turn;
}

inline Matrix6d PartsExchanged(const Pose&) {
  Matrix6d exchange = Matrix6d::Zero();
  exchange.topRightCorner<3, 3>().setIdentity();
  exchange.bottomLeftCorner<3, 3>().setIdentity();
  return exchange;
}

/// The adjoint with the sign of its moment arm turned about.
inline Matrix6d WrongAdjoint(const Pose& X) {
  Pose arm = Pose::Identity();
  arm.translation() = X.linear().transpose() * X.translation();
  return CalcAdjoint(arm);
}

}  // namespace dexcheck
