// Simbody: the mass matrix and forces of its matter subsystem.

#include <Simbody.h>

#include "harness/descriptions/programs/engine_program.h"

namespace dexcheck::engines {
namespace {

SimTK::Vec3 ToVec3(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

SimTK::Transform ToTransform(const Eigen::Isometry3d& X) {
  const Eigen::Matrix3d R = X.linear();
  const SimTK::Mat33 m(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2));
  // "true": it is a rotation already, to rounding.
  return {SimTK::Rotation(m, true), ToVec3(X.translation())};
}

/// A body of Simbody has its inertia about its origin.
SimTK::Body::Rigid MakeBody(const UrdfBody& body) {
  const Eigen::Matrix3d& I = body.inertia;
  const SimTK::Vec3 com = ToVec3(body.com);
  const SimTK::Inertia central(SimTK::Vec3(I(0, 0), I(1, 1), I(2, 2)),
                               SimTK::Vec3(I(0, 1), I(0, 2), I(1, 2)));
  return SimTK::Body::Rigid(
      SimTK::MassProperties(body.mass, com, central.shiftFromMassCenter(com, body.mass)));
}

/// Turns the axis to z (of a pin) or x (of a slider).
SimTK::Transform MakeJointFrame(const Eigen::Vector3d& axis, SimTK::CoordinateAxis along) {
  return {SimTK::Rotation(SimTK::UnitVec3(axis.x(), axis.y(), axis.z()), along), SimTK::Vec3(0)};
}

class SimbodyRobot : public EngineRobot {
 public:
  SimbodyRobot(const std::vector<UrdfBody>& bodies, const RobotFacts& facts)
      : matter_(system_), forces_(system_), gravity_(forces_, matter_, ToVec3(facts.gravity)) {
    for (const UrdfBody& body : bodies) Add(body, facts.floats);
    state_ = system_.realizeTopology();
  }

  EngineTerms Evaluate(const Eigen::VectorXd& q, const Eigen::VectorXd& v) override {
    EngineTerms terms;
    SetState(q, v);
    system_.realize(state_, SimTK::Stage::Dynamics);
    SimTK::Matrix M;
    matter_.calcM(state_, M);
    terms.M.resize(M.nrow(), M.ncol());
    for (int row = 0; row < M.nrow(); ++row) {
      for (int col = 0; col < M.ncol(); ++col) terms.M(row, col) = M(row, col);
    }
    const SimTK::Vector no_forces(state_.getNU(), 0.0);
    const SimTK::Vector_<SimTK::SpatialVec> no_wrenches(matter_.getNumBodies(),
                                                        SimTK::SpatialVec(SimTK::Vec3(0)));
    terms.c = CalcResidual(no_forces, no_wrenches);
    terms.kinetic = system_.calcKineticEnergy(state_);
    terms.potential = system_.calcPotentialEnergy(state_);

    SetState(q, Eigen::VectorXd::Zero(v.size()));
    system_.realize(state_, SimTK::Stage::Dynamics);
    terms.g = CalcResidual(system_.getMobilityForces(state_, SimTK::Stage::Dynamics),
                           system_.getRigidBodyForces(state_, SimTK::Stage::Dynamics));
    return terms;
  }

 private:
  void Add(const UrdfBody& body, bool floats) {
    if (body.motion == Motion::kRoot) {
      // A body that stands still needs no mass.
      SimTK::MobilizedBody& ground = matter_.updGround();
      mobilized_.push_back(
          floats ? SimTK::MobilizedBody(SimTK::MobilizedBody::Free(ground, MakeBody(body)))
                 : SimTK::MobilizedBody(SimTK::MobilizedBody::Weld(ground, SimTK::Body::Massless())));
      return;
    }
    const SimTK::Body::Rigid own = MakeBody(body);
    SimTK::MobilizedBody& parent = mobilized_[static_cast<size_t>(body.parent)];
    const SimTK::Transform X_PL = ToTransform(body.X_PL);
    const bool turns = body.motion == Motion::kTurns;
    const SimTK::Transform X_LM =
        turns ? MakeJointFrame(body.axis, SimTK::ZAxis) : MakeJointFrame(body.axis, SimTK::XAxis);
    if (turns) {
      mobilized_.push_back(SimTK::MobilizedBody::Pin(parent, X_PL * X_LM, own, X_LM));
    } else {
      mobilized_.push_back(SimTK::MobilizedBody::Slider(parent, X_PL * X_LM, own, X_LM));
    }
  }

  /// Bodies were added in the order of the joints, and so are Simbody's coordinates.
  void SetState(const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
    for (int i = 0; i < state_.getNQ(); ++i) state_.updQ()[i] = q[i];
    for (int i = 0; i < state_.getNU(); ++i) state_.updU()[i] = v[i];
  }

  /// Forces that are wanting for no acceleration, with these applied.
  [[nodiscard]] Eigen::VectorXd CalcResidual(const SimTK::Vector& forces,
                                             const SimTK::Vector_<SimTK::SpatialVec>& wrenches) const {
    SimTK::Vector residual;
    matter_.calcResidualForceIgnoringConstraints(state_, forces, wrenches, SimTK::Vector(), residual);
    Eigen::VectorXd out(residual.size());
    for (int i = 0; i < residual.size(); ++i) out[i] = residual[i];
    return out;
  }

  SimTK::MultibodySystem system_;
  SimTK::SimbodyMatterSubsystem matter_;
  SimTK::GeneralForceSubsystem forces_;
  SimTK::Force::Gravity gravity_;
  SimTK::State state_;
  std::vector<SimTK::MobilizedBody> mobilized_;
};

}  // namespace
}  // namespace dexcheck::engines

int main(int argc, char** argv) {
  using namespace dexcheck::engines;
  int major = 0;
  int minor = 0;
  int patch = 0;
  SimTK_version_simbody(&major, &minor, &patch);
  const std::string name = "Simbody " + std::to_string(major) + "." + std::to_string(minor);
  return RunEngine(argc, argv, name, [](const auto& bodies, const RobotFacts& facts) {
    return std::make_unique<SimbodyRobot>(bodies, facts);
  });
}
