#include "tests/controller/grasp/random_grasp.h"

#include <algorithm>
#include <cmath>

namespace dexcheck::testing {
namespace {

double DrawUniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

Vector3d DrawDirection(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random);
  const double y = normal(random);
  const double z = normal(random);
  return Vector3d(x, y, z).normalized();
}

}  // namespace

Eigen::Matrix<double, 6, 3> CalcContactColumns(const Pose& X_OC) {
  Eigen::Matrix<double, 6, 3> columns;
  columns << X_OC.linear(), Skew(X_OC.translation()) * X_OC.linear();
  return columns;
}

Pose CalcTorusContact(double around, double tube, double spin) {
  const Vector3d radial(std::cos(around), std::sin(around), 0.0);
  const Vector3d outward = std::cos(tube) * radial + std::sin(tube) * Vector3d::UnitZ();
  const Vector3d along(-std::sin(around), std::cos(around), 0.0);
  Pose X_OC;
  X_OC.linear().col(0) = along;
  X_OC.linear().col(1) = -outward.cross(along);
  X_OC.linear().col(2) = -outward;
  X_OC.translation() = kTorusRadius * radial + kTubeRadius * outward;
  X_OC.rotate(Eigen::AngleAxisd(spin, Vector3d::UnitZ()));
  return X_OC;
}

GraspForceProblem MakeRandomGraspForceProblem(std::mt19937_64& random, int num_contacts) {
  GraspForceProblem problem(num_contacts);
  problem.mu.setConstant(DrawUniform(random, 0.2, 1.0));
  problem.f_min.setConstant(0.2);
  for (Eigen::Index i = 0; i < num_contacts; ++i) {
    const double around = DrawUniform(random, 0.0, 2.0 * kPi);
    const double tube = DrawUniform(random, 0.0, 2.0 * kPi);
    const double spin = DrawUniform(random, 0.0, 2.0 * kPi);
    problem.G.middleCols<3>(3 * i) = CalcContactColumns(CalcTorusContact(around, tube, spin));
  }
  problem.F_o.head<3>() = DrawUniform(random, 0.0, 20.0) * DrawDirection(random);
  problem.F_o.tail<3>() = DrawUniform(random, 0.0, 1.0) * DrawDirection(random);
  return problem;
}

GraspForceProblem MakeEquatorGraspForceProblem(int num_contacts, double mu) {
  GraspForceProblem problem(num_contacts);
  problem.mu.setConstant(mu);
  for (Eigen::Index i = 0; i < num_contacts; ++i) {
    const double around = 2.0 * kPi * static_cast<double>(i) / num_contacts;
    problem.G.middleCols<3>(3 * i) = CalcContactColumns(CalcTorusContact(around, 0.0, 0.0));
  }
  return problem;
}

LineGrasp MakeRandomLineGrasp(std::mt19937_64& random, int num_contacts, double offset, double unit) {
  LineGrasp grasp{GraspForceProblem(num_contacts), Vector6d::Zero()};
  const Vector3d along = DrawDirection(random);
  const Vector3d middle = unit * offset * DrawDirection(random);
  for (Eigen::Index i = 0; i < num_contacts; ++i) {
    const double place = (static_cast<double>(i) + DrawUniform(random, -0.3, 0.3)) / (num_contacts - 1) - 0.5;
    Pose X_OC = Pose::Identity();
    X_OC.translation() = middle + 0.1 * unit * place * along;
    X_OC.rotate(Eigen::AngleAxisd(DrawUniform(random, -kPi, kPi), DrawDirection(random)));
    grasp.problem.G.middleCols<3>(3 * i) = CalcContactColumns(X_OC);
    grasp.problem.mu[i] = DrawUniform(random, 0.2, 1.0);
  }
  grasp.n << middle.cross(along), along;
  return grasp;
}

double CalcSeparation(const GraspForceProblem& problem, const Vector6d& y) {
  double most = 0.0;
  for (Eigen::Index i = 0; i < problem.num_contacts(); ++i) {
    const Vector3d g = problem.G.middleCols<3>(3 * i).transpose() * y;
    const double h = g.z() + problem.mu[i] * g.head<2>().norm();
    most += std::max(problem.f_min[i] * h, problem.f_max[i] * h);
  }
  return y.dot(problem.F_o) - most;
}

void MoveGrasp(std::mt19937_64& random, GraspForceProblem& problem) {
  problem.F_o.head<3>() += 5e-3 * DrawDirection(random);
  problem.F_o.tail<3>() += 2e-4 * DrawDirection(random);
  for (Eigen::Index i = 0; i < problem.num_contacts(); ++i) {
    const Matrix3d R = Eigen::AngleAxisd(5e-4, DrawDirection(random)).toRotationMatrix();
    problem.G.block<3, 3>(0, 3 * i) = R * problem.G.block<3, 3>(0, 3 * i);
    problem.G.block<3, 3>(3, 3 * i) = R * problem.G.block<3, 3>(3, 3 * i);
  }
}

}  // namespace dexcheck::testing
