// q', then M_bar' and C_bar' of a robot, equation (18), in the middle of its joint ranges with all rates 1:
// print_terms ROBOT.toml

#include <exception>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>

#include "controller/dynamics/model_terms.h"
#include "controller/model/parameter_reader.h"

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::cerr << "usage: print_terms ROBOT.toml\n";
    return 2;
  }
  std::ifstream file(argv[1]);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const dexcheck::RobotModel model = dexcheck::ParseRobotModel(text, argv[1]);

  // q' holds the base's coordinates before the joints', xi its velocities.
  Eigen::VectorXd q = Eigen::VectorXd::Zero(model.num_positions());
  const auto num_joints = static_cast<Eigen::Index>(model.joints().size());
  for (Eigen::Index i = 0; i < num_joints; ++i) {
    const dexcheck::Joint& joint = model.joints()[static_cast<size_t>(i)];
    q[q.size() - num_joints + i] = 0.5 * (joint.lower + joint.upper);
  }
  const Eigen::VectorXd xi = Eigen::VectorXd::Ones(model.num_velocities());

  dexcheck::ModelTerms terms(model);
  terms.SetState(q, xi);
  terms.CalcDynamics();
  std::cout.precision(17);
  std::cout << q.transpose() << "\n\n" << terms.M() << "\n\n" << terms.C() << "\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << "\n";
  return 2;
}
