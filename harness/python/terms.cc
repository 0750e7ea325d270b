#include "harness/python/terms.h"

#include <algorithm>
#include <exception>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/dynamics/model_terms.h"
#include "harness/base/bounded_json.h"
#include "harness/base/version.h"
#include "harness/descriptions/audit.h"
#include "harness/descriptions/read_description.h"
#include "harness/log/log_reader.h"

namespace dexcheck {

/// A robot or a log that Python holds, with the text that it got last.
struct PythonObject {
  std::filesystem::path file;
  UrdfOptions urdf;
  RobotDescription description;
  std::unique_ptr<RobotModel> model;
  std::unique_ptr<ModelTerms> terms;
  VectorXd still;  // velocities of zero
  std::unique_ptr<LogReader> log;
  std::string text;
};

namespace {

using Json = nlohmann::ordered_json;
using Input = Eigen::Map<const VectorXd>;
using OutputVector = Eigen::Map<VectorXd>;
using OutputMatrix = Eigen::Map<RowMatrixXd>;

thread_local std::string last_error;

/// Returns what the function returns; null or false, with the message kept, when it throws.
template <typename Function>
auto Guard(const Function& function) -> decltype(function()) {
  try {
    return function();
  } catch (const InputError& error) {
    last_error = std::string("i") + error.what();
  } catch (const std::exception& error) {
    last_error = std::string("v") + error.what();
  } catch (...) {
    last_error = "vno standard exception";
  }
  return {};
}

template <typename Named>
Json ListNames(const Named& all) {
  Json names = Json::array();
  for (const auto& one : all) names.push_back(one.name);
  return names;
}

Json DescribeRobot(const PythonObject& robot) {
  return {{"name", robot.model->name()},
          {"joints", ListNames(robot.model->joints())},
          {"frames", ListNames(robot.model->frames())},
          {"nq", robot.model->num_positions()},
          {"nv", robot.model->num_velocities()},
          {"notes", robot.description.notes}};
}

Json DescribeLog(const LogReader& log) {
  Json signals = Json::object();
  for (const SignalInfo& signal : log.signals())
    signals[signal.name] = {{"unit", signal.unit}, {"width", signal.width}, {"columns", signal.columns}};
  return {{"rows", log.rows()}, {"signals", signals}};
}

const char* Keep(PythonObject* object, const Json& json) {
  object->text = FormatJson(json, /*indent=*/-1);
  return object->text.c_str();
}

/// The joint whose link it is; -1 for the base.
int FindLink(const PythonObject& robot, const std::string& name) {
  if (name == robot.description.spec.base.link) return -1;
  const std::vector<Joint>& joints = robot.description.spec.joints;
  const auto found = std::ranges::find(joints, name, &Joint::link);
  if (found != joints.end()) return static_cast<int>(found - joints.begin());
  throw std::invalid_argument(robot.file.string() + ": must have a frame or link " + Quote(name));
}

Pose CalcPose(const PythonObject& robot, const std::string& name) {
  const RobotModel& model = *robot.model;
  if (std::ranges::find(model.frames(), name, &Frame::name) != model.frames().end())
    return robot.terms->CalcFramePose(model.FindFrame(name));
  const int link = FindLink(robot, name);
  const Pose X_iL = link < 0 ? Pose::Identity() : robot.description.joints[static_cast<size_t>(link)].X_iL;
  return robot.terms->CalcLinkPose(link) * X_iL;
}

void SetState(PythonObject* robot, const double* q, const double* v) {
  robot->terms->SetState(Input(q, robot->model->num_positions()), Input(v, robot->model->num_velocities()));
}

}  // namespace

extern "C" {

const char* dexcheck_error() { return last_error.c_str(); }

const char* dexcheck_version() {
  static const std::string version = Version();
  return version.c_str();
}

PythonObject* dexcheck_load(const char* file, bool floating, const char* packages) {
  return Guard([&] {
    auto robot = std::make_unique<PythonObject>();
    robot->file = file;
    robot->urdf.floating = floating;
    std::istringstream lines(packages);
    for (std::string line; std::getline(lines, line);) robot->urdf.packages.emplace_back(line);
    robot->description = ReadDescription(robot->file, robot->urdf);
    robot->model = std::make_unique<RobotModel>(robot->description.spec);
    robot->terms = std::make_unique<ModelTerms>(*robot->model);
    robot->still = VectorXd::Zero(robot->model->num_velocities());
    return robot.release();
  });
}

PythonObject* dexcheck_open_log(const char* file) {
  return Guard([&] {
    auto log = std::make_unique<PythonObject>();
    log->log = std::make_unique<LogReader>(file);
    return log.release();
  });
}

void dexcheck_free(PythonObject* object) { delete object; }

const char* dexcheck_describe(PythonObject* object) {
  return Guard(
      [&] { return Keep(object, object->log ? DescribeLog(*object->log) : DescribeRobot(*object)); });
}

const char* dexcheck_audit(PythonObject* robot) {
  return Guard([&] {
    UrdfOptions options = robot->urdf;
    options.keep_impossible = true;
    Json lines = Json::array();
    for (const AuditFinding& finding : AuditRobot(ReadDescription(robot->file, options)).findings)
      lines.push_back(std::string(NameOf(finding.level)) + ": " + finding.where + " " + finding.text);
    return Keep(robot, lines);
  });
}

bool dexcheck_term(PythonObject* robot, char term, const double* q, const double* v, double* value) {
  return Guard([&] {
    const Eigen::Index n = robot->model->num_velocities();
    if (v == nullptr) v = robot->still.data();
    SetState(robot, q, v);
    ModelTerms& terms = *robot->terms;
    terms.CalcDynamics();
    OutputVector vector(value, n);
    switch (term) {
      case 'M':
        OutputMatrix(value, n, n) = terms.M();
        break;
      case 'C':
        OutputMatrix(value, n, n) = terms.C();
        break;
      case 'c':
        vector = terms.C() * Input(v, n);
        break;
      case 'g':
        vector = terms.gravity();
        break;
      case 'h':
        vector = terms.C() * Input(v, n) + terms.gravity();
        break;
      case 'f':
        vector = terms.friction();
        break;
      case 'e': {
        const EnergyAndMomentum energy = terms.CalcEnergyAndMomentum();
        value[0] = energy.kinetic;
        value[1] = energy.potential;
        break;
      }
      default:
        throw std::invalid_argument(std::string("term: must be one of MCcghfe, got ") + term);
    }
    return true;
  });
}

bool dexcheck_pose(PythonObject* robot, const char* name, const double* q, double* pose) {
  return Guard([&] {
    SetState(robot, q, robot->still.data());
    OutputMatrix(pose, 4, 4) = CalcPose(*robot, name).matrix();
    return true;
  });
}

bool dexcheck_jacobian(PythonObject* robot, const char* frame, const double* q, double* jacobian) {
  return Guard([&] {
    SetState(robot, q, robot->still.data());
    Matrix6Xd J = Matrix6Xd::Zero(6, robot->model->num_velocities());
    Matrix6Xd J_dot = J;
    robot->terms->CalcFrameJacobian(robot->model->FindFrame(frame), J, J_dot);
    OutputMatrix(jacobian, J.rows(), J.cols()) = J;
    return true;
  });
}

bool dexcheck_signal(PythonObject* log, const char* name, double* values) {
  return Guard([&] {
    const RowMatrixXd signal = log->log->ReadSignal(name);
    OutputMatrix(values, signal.rows(), signal.cols()) = signal;
    return true;
  });
}

}  // extern "C"

}  // namespace dexcheck
