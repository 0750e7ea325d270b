#pragma once

// The engine's terms.

#include <memory>
#include <span>

#include "controller/common/types.h"
#include "harness/descriptions/dynamics_provider.h"
#include "harness/engine/engine_terms.h"

namespace dexcheck {

// Pose and velocity of the object by its coordinates X_o, from the engine's quaternion algebra: P^-1 and its
// rate as the checks have them, which share no formula with the model's.

/// V_Bo = P_inv X_o_dot, and what V_Bo_dot is at constant X_o_dot.
struct ObjectRates {
  Pose X_Bo = Pose::Identity();
  Vector6d V_Bo = Vector6d::Zero();
  Matrix6d P_inv = Matrix6d::Zero();
  Vector6d bias = Vector6d::Zero();  ///< d/dt (P^-1) X_o_dot, m/s^2 and rad/s^2.
};

/// @param X_o, X_o_dot position and ZYZ angles in the world, and their rates: m, rad, m/s, rad/s.
ObjectRates CalcObjectRates(const Vector6d& X_o, const Vector6d& X_o_dot);

/// X_o and its rate, which the checks lead to the body velocity by themselves.
struct ObjectCoordinates {
  Vector6d X_o;
  Vector6d X_o_dot;
};

/// The engine that is linked into this program as a provider, in the coordinates of its adapter's model.
class EngineProvider : public MechanismProvider {
 public:
  /// All frames, and the object if the model has one. The adapter must outlive the provider.
  EngineProvider(const Adapter& adapter, std::string name);
  /// With an engine's model of its own. @throws InputError as Adapter does.
  EngineProvider(const RobotSpec& robot, MjModelPtr engine, const std::string& source, std::string name);
  /// Evaluates terms of a run: a grasp with its contacts, or without fingertips a robot that holds nothing.
  /// @param has_coordinates whether the object's state is known by X_o.
  /// @throws InputError as EngineTerms.
  EngineProvider(const Adapter& adapter, std::span<const int> fingertips, bool has_coordinates);

  /// The object's state in the engine is built by its own quaternion algebra.
  void SetState(const DynamicsState& state) override;
  /// Sets the state of a run. @param coordinates of the object; null when it is not known by them.
  /// @param evaluated as EngineTerms::SetState.
  void SetState(const VectorXd& q, const VectorXd& xi, const Pose& X_Bo, const Vector6d& V_Bo,
                const ObjectCoordinates* coordinates, const EvaluatedPositions& evaluated = {});
  [[nodiscard]] bool Has(Term term) const override;
  void Read(Term term, Eigen::Ref<MatrixXd> out) override;
  [[nodiscard]] bool HasMass(int link) const override;

  [[nodiscard]] EngineTerms& terms() { return terms_; }
  [[nodiscard]] const EngineTerms& terms() const { return terms_; }
  /// M_bar' at the last state.
  [[nodiscard]] const MatrixXd& M() const { return terms_.M(); }
  /// EngineTerms::CalcFrameColumns of a compared frame at the state set.
  [[nodiscard]] const Matrix6Xd& columns(size_t frame) const { return columns_[frame]; }

 private:
  void PrepareFrames(std::span<const int> frames, bool contacts);
  void ReadObject(const ObjectCoordinates* coordinates);
  void ReadJacobians(Eigen::Ref<MatrixXd> out) const;

  struct OwnModel;
  std::shared_ptr<const OwnModel> own_;  // only of a description
  const Adapter* adapter_;
  EngineTerms terms_;
  std::unique_ptr<EngineTerms> unreduced_;
  std::vector<int> frames_;  // compared
  std::vector<Matrix6Xd> columns_;
  std::vector<MassProperties> links_;
  VectorXd xi_, w_, unreduced_velocity_;
};

}  // namespace dexcheck
