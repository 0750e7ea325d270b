#include "harness/python/judge.h"

#include <fmt/format.h>
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/recordings/judgement_verdict.h"

namespace py = pybind11;

namespace dexcheck {
namespace {

using Columns = std::optional<RowMatrixXd>;

/// A judgement with the names of its joints, as Python sees it.
struct JudgementResult {
  RecordingJudgement judgement;
  JudgementVerdict verdict;
  std::vector<std::string> names;  // of all joints

  /// {"elbow": {"torque": ..., "residual": ..., "left": ..., "noise": ..., ...}, ...}
  [[nodiscard]] py::dict Joints() const {
    py::dict joints;
    for (const JointJudgement& one : judgement.balances) {
      py::dict entry;
      entry["torque"] = one.torque;
      entry["residual"] = one.residual;
      entry["left"] = one.left;
      entry["noise"] = one.noise;
      entry["held_residual"] = one.held_residual;
      entry["held_left"] = one.held_left;
      entry["samples"] = one.samples;
      if (one.drive_gain != 0.0) entry["drive_gain"] = one.drive_gain;
      joints[py::str(names[static_cast<size_t>(one.joint)])] = entry;
    }
    return joints;
  }

  [[nodiscard]] std::string Print() const {
    std::string text = verdict.word;
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::toupper(c); });
    text += ": " + verdict.sentence;
    for (const Explanation& one : judgement.causes) text += "\n  " + one.Tell();
    return text;
  }
};

/// NumPy arrays as a recording's columns.
class ArrayRecording {
 public:
  ArrayRecording(const RobotModel& model, const std::optional<std::vector<std::string>>& joints,
                 const VectorXd& t)
      : rows_(t.size()) {
    for (int i = 0; i < model.num_joints(); ++i) joints_.push_back(i);
    if (joints) {
      joints_.clear();
      for (const std::string& name : *joints) {
        joints_.push_back(model.FindJoint(name));
        if (joints_.back() < 0)
          throw InputError("joints: " + Quote(name) + " must be a joint of " + model.name());
      }
    }
    if (rows_ == 0) throw InputError("t: must not be empty");
    AddColumn(RecordedQuantity::kTime, -1, t);
  }

  void Add(RecordedQuantity quantity, const Columns& values) {
    if (!values) return;
    const auto width = static_cast<Eigen::Index>(joints_.size());
    if (values->rows() != rows_ || values->cols() != width)
      throw InputError(fmt::format("{}: must have {} x {} entries, got {} x {}", NameOf(quantity), rows_,
                                   width, values->rows(), values->cols()));
    for (Eigen::Index i = 0; i < width; ++i)
      AddColumn(quantity, joints_[static_cast<size_t>(i)], values->col(i));
  }

  /// @param arrays are kept, to be read again.
  static Recording Make(const std::shared_ptr<const ArrayRecording>& arrays) {
    Recording recording;
    recording.name = "the recording";
    recording.channels = arrays->channels_;
    recording.reader =
        std::make_unique<TableReader>(recording.name, "arrays", arrays->names_, arrays->columns_);
    recording.reopen = [arrays] { return Make(arrays); };
    return recording;
  }

 private:
  void AddColumn(RecordedQuantity quantity, int joint, const VectorXd& values) {
    channels_.push_back({quantity, joint, columns_.size()});
    names_.push_back(fmt::format("{}.{}", NameOf(quantity), joint));
    columns_.emplace_back(values.begin(), values.end());
  }

  Eigen::Index rows_;
  std::vector<int> joints_;  // by column of each array
  std::vector<Channel> channels_;
  std::vector<std::string> names_;
  std::vector<std::vector<double>> columns_;
};

}  // namespace

void AddJudge(py::module_* module, const ModelFinder& with_model) {
  py::module_& m = *module;
  py::class_<Explanation>(m, "Cause",
                          "What explains a part of what a model does not; of a class the likeliest.")
      .def_property_readonly("fault", [](const Explanation& one) { return one.faults.front().fault; })
      .def_property_readonly("place", [](const Explanation& one) { return one.faults.front().place; })
      .def_property_readonly("value", [](const Explanation& one) { return one.faults.front().value; })
      .def_property_readonly(
          "error", [](const Explanation& one) { return one.faults.front().error; },
          "Standard error of the value; infinite where the motion does not tell it.")
      .def_property_readonly("unit", [](const Explanation& one) { return one.faults.front().unit; })
      .def_property_readonly("detail", [](const Explanation& one) { return one.faults.front().detail; })
      .def_property_readonly("text", &Explanation::Tell)
      .def_property_readonly(
          "outcome", [](const Explanation& one) { return NameOf(one.outcome); },
          "\"named\", \"class\" (others do as well) or \"not explained\".")
      .def_property_readonly(
          "others",
          [](const Explanation& one) {
            std::vector<std::string> others;
            for (size_t i = 1; i < one.faults.size(); ++i) others.push_back(one.faults[i].Tell());
            return others;
          },
          "That this motion does not tell apart from it.")
      .def_readonly("rival", &Explanation::rival)
      .def_property_readonly(
          "time",
          [](const Explanation& one) -> std::optional<std::pair<double, double>> {
            if (!std::isfinite(one.from)) return std::nullopt;
            return std::pair(one.from, one.to);
          },
          "From when to when, s; None for always.")
      .def("__repr__", &Explanation::Tell);

  py::class_<JudgementResult>(m, "Judgement", "Whether a model explains a recording; true when it does.")
      .def_property_readonly("explained", [](const JudgementResult& r) { return r.judgement.Agrees(); })
      .def("__bool__", [](const JudgementResult& r) { return r.judgement.Agrees(); })
      .def_property_readonly(
          "verdict", [](const JudgementResult& r) { return r.verdict.word; },
          "\"explained\", \"partly explained\" (not all joints that move are judged), \"not explained\" or "
          "\"differs\".")
      .def_property_readonly(
          "causes", [](const JudgementResult& r) { return r.judgement.causes; },
          "The one that explains most first.")
      .def_property_readonly("joints", &JudgementResult::Joints,
                             "By joint, root mean squares: torque, residual (beyond the model), left (beyond "
                             "the causes), noise, held_residual, held_left, samples, of currents drive_gain.")
      .def_property_readonly(
          "fraction", [](const JudgementResult& r) { return r.judgement.explained; },
          "Of the squared residual that the causes explain.")
      .def_property_readonly("rows", [](const JudgementResult& r) { return r.judgement.rows; })
      .def_property_readonly("notes", [](const JudgementResult& r) { return r.judgement.notes; })
      .def("__repr__", &JudgementResult::Print);

  m.def(
      "judge",
      [with_model](const py::object& model, const VectorXd& t, const RowMatrixXd& q, const Columns& qd,
                   const Columns& tau, const Columns& qdd,
                   const std::optional<std::vector<std::string>>& joints, const Columns& current) {
        JudgementResult result;
        with_model(model, [&](const RobotModel& robot, const RobotDescription& description) {
          const auto kept = std::make_shared<ArrayRecording>(robot, joints, t);
          ArrayRecording& arrays = *kept;
          arrays.Add(RecordedQuantity::kPosition, q);
          arrays.Add(RecordedQuantity::kVelocity, qd);
          arrays.Add(RecordedQuantity::kAcceleration, qdd);
          arrays.Add(RecordedQuantity::kTorque, tau);
          arrays.Add(RecordedQuantity::kCurrent, current);
          if (!tau == !current) throw InputError("judge: must have one of tau and current");
          std::vector<Recording> recordings;
          recordings.push_back(ArrayRecording::Make(kept));
          for (const Joint& joint : robot.joints()) result.names.push_back(joint.name);
          const py::gil_scoped_release release;
          JudgeOptions options;
          options.frames = ListLinkFrames(description);
          result.judgement = JudgeRecordings(robot, &recordings, options);
          result.verdict = MakeVerdict(result.judgement, robot, "the recording");
        });
        return result;
      },
      py::arg("model"), py::arg("t"), py::arg("q"), py::arg("qd") = py::none(), py::arg("tau") = py::none(),
      py::arg("qdd") = py::none(), py::arg("joints") = py::none(), py::arg("current") = py::none(),
      "Whether a model (a Robot or a file) explains a recording: times t (n), positions q, torques tau or "
      "currents, and, where known, velocities and accelerations, n x joints each, in SI units; columns are "
      "the "
      "model's joints, or those named in joints.");
}

}  // namespace dexcheck
