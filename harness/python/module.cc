// The Python module `dexcheck`: a robot's terms as NumPy arrays, and comparisons. README.md has examples.

#include <fmt/format.h>
#include <pybind11/eigen.h>
#include <pybind11/functional.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/dynamics/model_terms.h"
#include "harness/base/version.h"
#include "harness/checks/consistency.h"
#include "harness/checks/file_comparison.h"
#include "harness/descriptions/audit.h"
#include "harness/descriptions/read_description.h"
#include "harness/log/log_reader.h"
#include "harness/python/judge.h"

namespace py = pybind11;

namespace dexcheck {
namespace {

using Input = Eigen::Ref<const VectorXd>;

/// A comparison's verdict with what belongs to it, as Python sees it.
struct ComparisonResult {
  Comparison comparison;

  [[nodiscard]] bool Agrees() const { return comparison.Agrees(); }

  /// {"M_bar": {"max": ..., "bound": ..., "digits": ..., "pass": ..., "where": ...}, ...}
  [[nodiscard]] py::dict Terms() const {
    const RobotModel& model = *comparison.model;
    py::dict terms;
    for (const std::vector<CheckRecord>* records :
         {&comparison.result.constants.records, &comparison.result.terms}) {
      for (const CheckRecord& record : *records) {
        py::dict entry;
        entry["max"] = record.worst;
        entry["bound"] = record.bound;
        entry["digits"] = CountDigits(record.worst);
        entry["pass"] = !record.failed;
        entry["compared"] = record.comparisons;
        entry["where"] = Describe(record.where, model, model.num_base_velocities());
        entry["values"] = py::make_tuple(record.model_value, record.engine_value);
        terms[py::str(record.name)] = entry;
      }
    }
    return terms;
  }

  /// Causes of what differs as dictionaries, those that explain most first.
  [[nodiscard]] py::list Causes() const {
    py::list causes;
    if (!comparison.causes) return causes;
    for (const FileCause& cause : comparison.causes->causes) {
      py::dict entry;
      entry["text"] = cause.text;
      entry["id"] = cause.id;
      entry["places"] = cause.places;
      entry["explained"] = cause.explained;
      causes.append(entry);
    }
    return causes;
  }

  [[nodiscard]] std::string Print() const {
    const std::string both =
        comparison.first.filename().string() + " and " + comparison.second.filename().string();
    if (Agrees())
      return fmt::format("AGREE: {} in {} terms at {} states", both, comparison.result.terms.size(),
                         comparison.result.samples);
    std::string text = "DISAGREE: " + both;
    for (const std::string& line : ListDifferences(comparison)) text += "\n  " + line;
    return text;
  }
};

/// A description with its analytic model. Terms are those of NOTATION.md in the order of `joints`.
class Robot {
 public:
  Robot(std::filesystem::path file, bool floating, const std::vector<std::filesystem::path>& packages)
      : file_(std::move(file)) {
    urdf_.floating = floating;
    urdf_.packages = packages;
    description_ = ReadDescription(file_, urdf_);
    model_ = std::make_unique<RobotModel>(description_.spec);
    terms_ = std::make_unique<ModelTerms>(*model_);
    still_ = VectorXd::Zero(model_->num_velocities());
  }

  [[nodiscard]] const RobotDescription& description() const { return description_; }
  [[nodiscard]] const RobotModel& model() const { return *model_; }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }

  MatrixXd M(const Input& q) { return Evaluate(q, still_).M(); }
  MatrixXd C(const Input& q, const Input& v) { return Evaluate(q, v).C(); }
  VectorXd c(const Input& q, const Input& v) { return Evaluate(q, v).C() * v; }
  VectorXd g(const Input& q) { return Evaluate(q, still_).gravity(); }
  VectorXd h(const Input& q, const Input& v) {
    Evaluate(q, v);
    return terms_->C() * v + terms_->gravity();
  }
  VectorXd Friction(const Input& q, const Input& v) { return Evaluate(q, v).friction(); }
  std::pair<double, double> Energy(const Input& q, const Input& v) {
    const EnergyAndMomentum energy = Evaluate(q, v).CalcEnergyAndMomentum();
    return {energy.kinetic, energy.potential};
  }
  MatrixXd PoseOf(const std::string& name, const Input& q) {
    const bool is_frame = std::ranges::find(model_->frames(), name, &Frame::name) != model_->frames().end();
    const int link = is_frame ? -1 : FindLink(name);
    terms_->SetState(q, still_);
    if (is_frame) return terms_->CalcFramePose(model_->FindFrame(name)).matrix();
    const Pose X_iL = link < 0 ? Pose::Identity() : description_.joints[static_cast<size_t>(link)].X_iL;
    return (terms_->CalcLinkPose(link) * X_iL).matrix();
  }
  MatrixXd Jacobian(const std::string& frame, const Input& q) {
    terms_->SetState(q, still_);
    Matrix6Xd J = Matrix6Xd::Zero(6, model_->num_velocities());
    Matrix6Xd J_dot = J;
    terms_->CalcFrameJacobian(model_->FindFrame(frame), J, J_dot);
    return J;
  }

  ComparisonResult Compare(const py::object& other, long samples, std::uint64_t seed, int digits,
                           const std::vector<std::string>& ignore) const {
    ConsistencyOptions options;
    options.ignore = ignore;
    options.samples = samples;
    options.seed = seed;
    ComparisonResult result;
    if (py::isinstance<Robot>(other)) {
      result.comparison = CompareFiles(file_, other.cast<const Robot&>().file_, urdf_, options);
    } else if (py::isinstance<py::str>(other) || py::hasattr(other, "__fspath__")) {
      result.comparison = CompareFiles(file_, other.cast<std::filesystem::path>(), urdf_, options);
    } else {
      result.comparison = CompareFunctions(file_, TakeFunctions(other), urdf_, options);
    }
    if (digits > 0) result.comparison.JudgeByTolerance(std::pow(10.0, -digits));
    return result;
  }

  [[nodiscard]] std::vector<std::string> Audit() const {
    UrdfOptions options = urdf_;
    options.keep_impossible = true;
    std::vector<std::string> lines;
    for (const AuditFinding& finding : AuditRobot(ReadDescription(file_, options)).findings)
      lines.push_back(std::string(NameOf(finding.level)) + ": " + finding.where + " " + finding.text);
    return lines;
  }

 private:
  const ModelTerms& Evaluate(const Input& q, const Input& v) {
    terms_->SetState(q, v);
    terms_->CalcDynamics();
    return *terms_;
  }

  /// The joint whose link it is; -1 for the base.
  [[nodiscard]] int FindLink(const std::string& name) const {
    if (name == description_.spec.base.link) return -1;
    const std::vector<Joint>& joints = description_.spec.joints;
    const auto found = std::ranges::find(joints, name, &Joint::link);
    if (found != joints.end()) return static_cast<int>(found - joints.begin());
    throw std::invalid_argument(file_.string() + ": must have a frame or link " + Quote(name));
  }

  /// The functions M(q), c(q, v), g(q), h(q, v), friction(q, v) of an object or a dictionary.
  static TermFunctions TakeFunctions(const py::object& other) {
    TermFunctions functions;
    functions.name =
        py::isinstance<py::dict>(other) ? "functions" : py::str(py::type::of(other).attr("__name__"));
    const auto find = [&](const char* name) -> py::object {
      if (py::isinstance<py::dict>(other)) return other.attr("get")(name);
      return py::getattr(other, name, py::none());
    };
    const auto of_q = [&](const char* name, auto* function) {
      using Function = std::remove_pointer_t<decltype(function)>;
      if (const py::object found = find(name); !found.is_none()) *function = found.cast<Function>();
    };
    of_q("M", &functions.M);
    of_q("c", &functions.c);
    of_q("g", &functions.g);
    of_q("h", &functions.h);
    of_q("friction", &functions.friction);
    return functions;
  }

  std::filesystem::path file_;
  UrdfOptions urdf_;
  RobotDescription description_;
  std::unique_ptr<RobotModel> model_;
  std::unique_ptr<ModelTerms> terms_;
  VectorXd still_;
};

template <typename Named>
std::vector<std::string> ListNames(const Named& all) {
  std::vector<std::string> names;
  names.reserve(std::size(all));
  for (const auto& one : all) names.push_back(one.name);
  return names;
}

const SignalInfo& FindSignal(const LogReader& log, const std::string& name) {
  const SignalInfo* const signal = log.Find(name);
  if (signal == nullptr) throw py::key_error(name);
  return *signal;
}

}  // namespace

PYBIND11_MODULE(_dexcheck, m) {
  m.doc() =
      "Robots from parameter files, URDFs and MJCFs: their terms as NumPy arrays, and whether two of them "
      "agree.";
  m.attr("__version__") = Version();
  py::register_exception<InputError>(m, "InputError", PyExc_ValueError);

  py::class_<ComparisonResult>(m, "Comparison", "What a comparison found; true when the two agree.")
      .def_property_readonly("agrees", &ComparisonResult::Agrees)
      .def("__bool__", &ComparisonResult::Agrees)
      .def_property_readonly("terms", &ComparisonResult::Terms,
                             "By constant and term: max, bound, digits, pass, compared, where, values.")
      .def_property_readonly(
          "differences", [](const ComparisonResult& r) { return ListDifferences(r.comparison); },
          "One line for each cause; without causes, for each constant and term that differs.")
      .def_property_readonly("causes", &ComparisonResult::Causes,
                             "Why two files differ: text, id, places, explained (a fraction).")
      .def_property_readonly("notes", [](const ComparisonResult& r) { return r.comparison.notes; })
      .def("__repr__", &ComparisonResult::Print);

  py::class_<Robot>(m, "Robot", "A description with its analytic model.")
      .def_property_readonly("name", [](const Robot& robot) { return robot.model().name(); })
      .def_property_readonly("file", [](const Robot& robot) { return robot.file().string(); })
      .def_property_readonly("joints", [](const Robot& robot) { return ListNames(robot.model().joints()); })
      .def_property_readonly("frames", [](const Robot& robot) { return ListNames(robot.model().frames()); })
      .def_property_readonly("nq", [](const Robot& robot) { return robot.model().num_positions(); })
      .def_property_readonly("nv", [](const Robot& robot) { return robot.model().num_velocities(); })
      .def_property_readonly("notes", [](const Robot& robot) { return robot.description().notes; })
      .def("M", &Robot::M, py::arg("q"), "Mass matrix, nv x nv, armature included.")
      .def("C", &Robot::C, py::arg("q"), py::arg("v"), "Coriolis matrix, nv x nv; M_dot - 2 C is skew.")
      .def("c", &Robot::c, py::arg("q"), py::arg("v"), "C v, nv.")
      .def("g", &Robot::g, py::arg("q"), "Forces that hold the robot still, nv.")
      .def("h", &Robot::h, py::arg("q"), py::arg("v"), "C v + g, nv.")
      .def("friction", &Robot::Friction, py::arg("q"), py::arg("v"), "Viscous forces, nv.")
      .def("energy", &Robot::Energy, py::arg("q"), py::arg("v"), "(kinetic, potential), J.")
      .def("pose", &Robot::PoseOf, py::arg("name"), py::arg("q"), "Of a frame or link in the world, 4 x 4.")
      .def("jacobian", &Robot::Jacobian, py::arg("frame"), py::arg("q"),
           "Body Jacobian of a frame, 6 x nv: [linear; angular] along the frame's axes.")
      .def("audit", &Robot::Audit, "What is impossible or suspicious, one line each.")
      .def("compare", &Robot::Compare, py::arg("other"), py::arg("samples") = 1000, py::arg("seed") = 1,
           py::arg("digits") = 0, py::arg("ignore") = std::vector<std::string>(),
           "Compares with another robot or file (TOML, URDF, MJCF), or with functions M(q), c(q, v), g(q), "
           "h(q, v), friction(q, v) of an object or a dictionary; to rounding, or to a number of digits; "
           "without what of joints stands in ignore (armature, damping, friction, effort).")
      .def("__repr__", [](const Robot& robot) {
        return fmt::format("<dexcheck.Robot {} of {}: {} joints>", robot.model().name(),
                           robot.file().string(), robot.model().joints().size());
      });

  m.def(
      "load",
      [](const std::filesystem::path& file, bool floating,
         const std::vector<std::filesystem::path>& packages) {
        return std::make_unique<Robot>(file, floating, packages);
      },
      py::arg("file"), py::arg("floating") = false,
      py::arg("packages") = std::vector<std::filesystem::path>(),
      "Reads a parameter file (TOML), a URDF or an MJCF.");

  py::class_<LogReader>(m, "Log", "The signals of a run's log.h5, by name.")
      .def(py::init<std::filesystem::path>(), py::arg("file"))
      .def("keys", [](const LogReader& log) { return ListNames(log.signals()); })
      .def("__len__", [](const LogReader& log) { return log.signals().size(); })
      .def("__contains__",
           [](const LogReader& log, const std::string& name) { return log.Find(name) != nullptr; })
      .def(
          "__getitem__",
          [](const LogReader& log, const std::string& name) -> py::object {
            const SignalInfo& signal = FindSignal(log, name);
            py::object values = py::cast(log.ReadSignal(name));
            return signal.width == 1 ? py::object(values.attr("ravel")()) : values;
          },
          py::arg("name"), "Of one number a step (steps), of several (steps, numbers), in the signal's unit.")
      .def(
          "unit", [](const LogReader& log, const std::string& name) { return FindSignal(log, name).unit; },
          py::arg("name"))
      .def(
          "columns",
          [](const LogReader& log, const std::string& name) { return FindSignal(log, name).columns; },
          py::arg("name"), "Names of its numbers; none when it is a single one.")
      .def("__repr__", [](const LogReader& log) {
        return fmt::format("<dexcheck.Log {}: {} signals of {} steps>", log.path().string(),
                           log.signals().size(), log.rows());
      });

  AddJudge(&m, [](const py::object& model, const auto& use) {
    if (py::isinstance<Robot>(model)) {
      const auto& robot = model.cast<const Robot&>();
      return use(robot.model(), robot.description());
    }
    const RobotDescription description = ReadDescription(model.cast<std::filesystem::path>());
    use(RobotModel(AddSpheres(description)), description);
  });
}

}  // namespace dexcheck
