#pragma once

// Whatever answers the terms of a robot's dynamics at a state.

#include <mujoco/mujoco.h>

#include <memory>
#include <optional>
#include <string>

#include "harness/descriptions/robot_description.h"
#include "harness/engine/engine_terms.h"

namespace dexcheck {

/// Terms at one state, in the analytic model's coordinates q', xi of size n. What a side does not have is
/// empty.
struct SideTerms {
  MatrixXd M;                       ///< M_bar', n x n.
  VectorXd coriolis;                ///< C_bar' xi
  VectorXd gravity;                 ///< Part of F_bar' due to gravity.
  VectorXd bias;                    ///< Their sum, the forces at xi_dot = 0.
  VectorXd friction;                ///< Part of F_bar' due to viscous damping.
  std::optional<double> kinetic;    ///< J
  std::optional<double> potential;  ///< J, above any level that stays the same.
};

/// One side of a comparison.
class TermSide {
 public:
  TermSide() = default;
  virtual ~TermSide() = default;
  TermSide(const TermSide&) = delete;
  TermSide& operator=(const TermSide&) = delete;

  /// What it is called in a report.
  [[nodiscard]] virtual const std::string& name() const = 0;
  /// @param sample number of the state, counted from 0.
  /// @param q q', num_positions entries. @param xi n entries.
  virtual SideTerms Evaluate(long sample, const VectorXd& q, const VectorXd& xi) = 0;
  /// Whether its terms are those of the robot whose coupled joints follow (T of CalcCouplingMap): entries of
  /// the base, then of the joints that are free.
  [[nodiscard]] virtual bool is_reduced() const { return false; }
};

/// The analytic model of a description.
class AnalyticSide : public TermSide {
 public:
  AnalyticSide(const RobotDescription& robot, std::string name);
  [[nodiscard]] const std::string& name() const override { return name_; }
  SideTerms Evaluate(long sample, const VectorXd& q, const VectorXd& xi) override;

 private:
  std::string name_;
  RobotModel model_;
  ModelTerms terms_;
};

/// The engine that is linked into this program, with a model that has the description's joints.
class EngineSide : public TermSide {
 public:
  /// @throws InputError as Adapter does.
  EngineSide(const RobotDescription& robot, MjModelPtr engine, const std::string& source, std::string name);
  [[nodiscard]] const std::string& name() const override { return name_; }
  SideTerms Evaluate(long sample, const VectorXd& q, const VectorXd& xi) override;

 private:
  std::string name_;
  RobotModel model_;
  MjModelPtr engine_;
  Adapter adapter_;
  EngineTerms terms_;
};

}  // namespace dexcheck
