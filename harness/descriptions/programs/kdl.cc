// The Orocos Kinematics and Dynamics Library: forces by the recursive Newton-Euler algorithm, M column by
// column.

#include <kdl/config.h>

#include <kdl/tree.hpp>
#include <kdl/treeidsolver_recursive_newton_euler.hpp>

#include "harness/descriptions/programs/engine_program.h"

namespace dexcheck::engines {
namespace {

KDL::Vector ToVector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

KDL::Frame ToFrame(const Eigen::Isometry3d& X) {
  const Eigen::Matrix3d R = X.linear();
  return {KDL::Rotation(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)),
          ToVector(X.translation())};
}

KDL::Segment MakeSegment(const UrdfBody& body) {
  const Eigen::Matrix3d& I = body.inertia;
  const KDL::RigidBodyInertia inertia(
      body.mass, ToVector(body.com),
      KDL::RotationalInertia(I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)));
  const KDL::Frame tip = ToFrame(body.X_PL);
  // The joint's line is given in the parent's frame.
  const KDL::Joint joint(body.joint, tip.p, tip.M * ToVector(body.axis),
                         body.motion == Motion::kTurns ? KDL::Joint::RotAxis : KDL::Joint::TransAxis);
  return KDL::Segment(body.name, joint, tip, inertia);
}

class KdlRobot : public EngineRobot {
 public:
  KdlRobot(const std::vector<UrdfBody>& bodies, const RobotFacts& facts)
      : tree_(bodies[0].name), gravity_(ToVector(facts.gravity)) {
    if (facts.floats) throw std::runtime_error("KDL has no base that floats");
    for (size_t i = 1; i < bodies.size(); ++i) {
      const std::string& parent = bodies[static_cast<size_t>(bodies[i].parent)].name;
      if (!tree_.addSegment(MakeSegment(bodies[i]), parent)) {
        throw std::runtime_error("KDL does not take link " + bodies[i].name);
      }
    }
    // Places of the joints in KDL's order.
    for (size_t i = 1; i < bodies.size(); ++i)
      places_.push_back(
          static_cast<Eigen::Index>(GetTreeElementQNr(tree_.getSegment(bodies[i].name)->second)));
  }

  EngineTerms Evaluate(const Eigen::VectorXd& q, const Eigen::VectorXd& v) override {
    const Eigen::Index n = v.size();
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(n);
    EngineTerms terms;
    terms.M.resize(n, n);
    for (Eigen::Index col = 0; col < n; ++col) {
      terms.M.col(col) = CalcForces(q, zero, Eigen::VectorXd::Unit(n, col), KDL::Vector::Zero());
    }
    terms.c = CalcForces(q, v, zero, KDL::Vector::Zero());
    terms.g = CalcForces(q, zero, zero, gravity_);
    return terms;
  }

 private:
  [[nodiscard]] KDL::JntArray Sort(const Eigen::VectorXd& values) const {
    KDL::JntArray sorted(static_cast<unsigned>(values.size()));
    for (Eigen::Index i = 0; i < values.size(); ++i) sorted.data[places_[static_cast<size_t>(i)]] = values[i];
    return sorted;
  }

  /// M v_dot + C v + gravity.
  [[nodiscard]] Eigen::VectorXd CalcForces(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                           const Eigen::VectorXd& v_dot, const KDL::Vector& gravity) const {
    KDL::TreeIdSolver_RNE solver(tree_, gravity);
    KDL::JntArray torques(static_cast<unsigned>(v.size()));
    if (solver.CartToJnt(Sort(q), Sort(v), Sort(v_dot), KDL::WrenchMap(), torques) < 0) {
      throw std::runtime_error(std::string("KDL: ") + solver.strError(solver.getError()));
    }
    Eigen::VectorXd forces(v.size());
    for (Eigen::Index i = 0; i < v.size(); ++i) forces[i] = torques.data[places_[static_cast<size_t>(i)]];
    return forces;
  }

  KDL::Tree tree_;
  KDL::Vector gravity_;
  std::vector<Eigen::Index> places_;
};

}  // namespace
}  // namespace dexcheck::engines

int main(int argc, char** argv) {
  using namespace dexcheck::engines;
  return RunEngine(argc, argv, "KDL " KDL_VERSION_STRING, [](const auto& bodies, const RobotFacts& facts) {
    return std::make_unique<KdlRobot>(bodies, facts);
  });
}
