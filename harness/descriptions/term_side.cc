#include "harness/descriptions/term_side.h"

#include <utility>

namespace dexcheck {

AnalyticSide::AnalyticSide(const RobotDescription& robot, std::string name)
    : name_(std::move(name)), model_(robot.spec), terms_(model_) {}

SideTerms AnalyticSide::Evaluate(long, const VectorXd& q, const VectorXd& xi) {
  terms_.SetState(q, xi);
  terms_.CalcDynamics();
  const EnergyAndMomentum energy = terms_.CalcEnergyAndMomentum();
  SideTerms out;
  out.M = terms_.M();
  out.coriolis = terms_.C() * xi;
  out.gravity = terms_.gravity();
  out.bias = out.coriolis + out.gravity;
  out.friction = terms_.friction();
  out.kinetic = energy.kinetic;
  out.potential = energy.potential;
  return out;
}

EngineSide::EngineSide(const RobotDescription& robot, MjModelPtr engine, const std::string& source,
                       std::string name)
    : name_(std::move(name)),
      model_(robot.spec),
      engine_(std::move(engine)),
      adapter_(model_, *engine_, source),
      terms_(adapter_, Coordinates::kReduced) {}

SideTerms EngineSide::Evaluate(long, const VectorXd& q, const VectorXd& xi) {
  terms_.SetState(q, xi);
  SideTerms out;
  out.M = terms_.M();
  out.coriolis = terms_.coriolis();
  out.gravity = terms_.gravity();
  out.bias = out.coriolis + out.gravity;
  out.friction = terms_.friction();
  out.kinetic = terms_.energy_and_momentum().kinetic;
  out.potential = terms_.energy_and_momentum().potential;
  return out;
}

}  // namespace dexcheck
