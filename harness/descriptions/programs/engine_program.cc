#include "harness/descriptions/programs/engine_program.h"

#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>

namespace dexcheck::engines {
namespace {

using Json = nlohmann::json;

Json ToJson(const Eigen::VectorXd& values) { return std::vector<double>(values.begin(), values.end()); }

Json ToJson(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    rows.push_back(ToJson(Eigen::VectorXd(matrix.row(row).transpose())));
  }
  return rows;
}

Eigen::VectorXd ReadVector(const Json& json) {
  const auto values = json.get<std::vector<double>>();
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// The first joint behind which no link has a mass; empty when there is none.
std::string FindJointWithoutMass(const std::vector<UrdfBody>& bodies) {
  std::vector<double> carried(bodies.size(), 0.0);
  for (size_t i = bodies.size(); i-- > 0;) {  // children stand behind their parents
    carried[i] += bodies[i].mass;
    if (bodies[i].parent >= 0) carried[static_cast<size_t>(bodies[i].parent)] += carried[i];
  }
  for (size_t i = 1; i < bodies.size(); ++i) {
    if (carried[i] == 0.0) return bodies[i].joint;
  }
  return {};
}

/// The robot that the first request describes, and the first result.
class Session {
 public:
  Session(const std::string& path, std::string name, MakeRobot make)
      : bodies_(ReadUrdfTree(path)), name_(std::move(name)), make_(std::move(make)) {}

  Json Reply(const Json& request) {
    return request.at("request") == "hello" ? Greet(request) : Evaluate(request);
  }

 private:
  Json Greet(const Json& request) {
    const Json& robot = request.at("robot");
    RobotFacts facts;
    facts.floats = robot.at("base") == "floating";
    facts.gravity = ReadVector(robot.at("gravity"));
    robot_ = make_(bodies_, facts);
    Json result = {{"dexcheck_protocol", 1}, {"name", name_}, {"joints", Json::array()}};
    for (size_t i = 1; i < bodies_.size(); ++i) result["joints"].push_back(bodies_[i].joint);
    if (facts.floats) {
      result["base"] = {{"position", "wxyz_xyz"},
                        {"velocity", "angular_linear"},
                        {"linear_axes", "world"},
                        {"angular_axes", "world"}};
    }
    return result;
  }

  Json Evaluate(const Json& request) {
    if (!robot_) throw std::runtime_error("no hello came before");
    const EngineTerms terms = robot_->Evaluate(ReadVector(request.at("q")), ReadVector(request.at("v")));
    if (!terms.M.allFinite() || !terms.c.allFinite() || !terms.g.allFinite()) {
      const std::string joint = FindJointWithoutMass(bodies_);
      throw std::runtime_error(
          name_ + ": its terms are no numbers" +
          (joint.empty() ? "; a joint may move no inertia" : "; joint " + joint + " moves no mass") +
          " (dexcheck audit ROBOT lists such joints)");
    }
    Json result = {{"id", request.at("id")}};
    if (terms.M.size() > 0) result["M"] = ToJson(terms.M);
    if (terms.c.size() > 0) result["c"] = ToJson(terms.c);
    if (terms.g.size() > 0) result["g"] = ToJson(terms.g);
    if (terms.kinetic) result["kinetic_energy"] = *terms.kinetic;
    if (terms.potential) result["potential_energy"] = *terms.potential;
    return result;
  }

  std::vector<UrdfBody> bodies_;
  std::string name_;
  MakeRobot make_;
  std::unique_ptr<EngineRobot> robot_;
};

}  // namespace

int RunEngine(int argc, char** argv, const std::string& name, const MakeRobot& make) {
  if (argc != 2) {
    std::cerr << "usage: " << argv[0] << " ROBOT.urdf, as a program of dexcheck's protocol\n";
    return 2;
  }
  std::unique_ptr<Session> session;
  std::string line;
  while (std::getline(std::cin, line)) {
    Json result;
    try {
      if (!session) session = std::make_unique<Session>(argv[1], name, make);
      result = session->Reply(Json::parse(line));
    } catch (const std::exception& error) {
      result = {{"error", error.what()}};
    }
    std::cout << result.dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
  }
  return 0;
}

}  // namespace dexcheck::engines
