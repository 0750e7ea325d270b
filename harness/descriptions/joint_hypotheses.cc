// Faults of joints: each is undone from the base outward, and axes and bodies are compared where they are
// then.

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <random>

#include "controller/common/text.h"
#include "controller/model/body_frame.h"
#include "harness/descriptions/body_faults.h"
#include "harness/descriptions/hypotheses.h"
#include "harness/descriptions/join_names.h"
#include "harness/descriptions/parameter_writer.h"

namespace dexcheck {
namespace {

constexpr const char* kZerosOffset = "zeros look offset";
constexpr const char* kZerosRounded = "zeros differ as rounded numbers do";

Matrix3d MakeRotation(const Vector3d& axis, double angle) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

/// What is undone at a joint, and in which words.
struct JointFault {
  std::string text;    ///< Of one joint: "origin looks as if in mm"
  std::string plural;  ///< Of several: "origins look as if in mm"
  std::function<OwnRow(const OwnRow&)> undo;
};

std::vector<JointFault> ListJointFaults() {
  std::vector<JointFault> faults;
  const auto add = [&](const std::string& noun, const std::string& plural, const std::string& text,
                       const std::function<OwnRow(const OwnRow&)>& undo) {
    faults.push_back({noun + " looks " + text, plural + " look " + text, undo});
  };
  const auto of_axis = [&](const std::string& text, const std::function<Vector3d(const Vector3d&)>& turn) {
    add("axis", "axes", text, [turn](OwnRow row) {
      row.axis = turn(row.axis);
      return row;
    });
  };
  of_axis("turned around (its sign)", [](const Vector3d& axis) { return Vector3d(-axis); });
  for (int k = 0; k < 3; ++k) {
    of_axis(std::string("wrong, ") + "xyz"[k] + " would be right",
            [k](const Vector3d&) { return Vector3d(Vector3d::Unit(k)); });
    of_axis(std::string("wrong, -") + "xyz"[k] + " would be right",
            [k](const Vector3d&) { return Vector3d(-Vector3d::Unit(k)); });
  }
  const auto of_origin = [&](const std::string& text, const std::function<Vector3d(const Pose&)>& move) {
    add("origin", "origins", text, [move](OwnRow row) {
      row.X_PL.translation() = move(row.X_PL);
      return row;
    });
  };
  for (const auto& [factor, text] : kLengthUnits) {
    of_origin(text, [factor = factor](const Pose& X) { return Vector3d(factor * X.translation()); });
  }
  of_origin("turned around (its sign)", [](const Pose& X) { return Vector3d(-X.translation()); });
  for (int k = 0; k < 3; ++k) {
    of_origin(std::string("turned around in ") + "xyz"[k], [k](const Pose& X) {
      Vector3d p = X.translation();
      p[k] = -p[k];
      return p;
    });
  }
  of_origin("as if given along the link's axes instead of the parent's",
            [](const Pose& X) { return Vector3d(X.linear() * X.translation()); });
  for (size_t order = 0; order < kAxisExchanges; ++order) {
    const auto& [axes, text] = kAxisOrders[order];
    of_origin("with " + std::string(text), [axes = axes](const Pose& X) {
      const Vector3d& p = X.translation();
      return Vector3d(p[axes[0]], p[axes[1]], p[axes[2]]);
    });
  }
  const auto of_rotation = [&](const std::string& text,
                               const std::function<Matrix3d(const Matrix3d&)>& turn) {
    add("rotation", "rotations", text, [turn](OwnRow row) {
      row.X_PL.linear() = turn(row.X_PL.linear());
      return row;
    });
  };
  of_rotation("turned the other way (transposed)", [](const Matrix3d& R) { return Matrix3d(R.transpose()); });
  of_rotation("as if its roll, pitch and yaw were taken in the other order", [](const Matrix3d& R) {
    const Vector3d rpy = CalcRollPitchYaw(R);
    return Matrix3d(MakeRotation(Vector3d::UnitX(), rpy[0]) * MakeRotation(Vector3d::UnitY(), rpy[1]) *
                    MakeRotation(Vector3d::UnitZ(), rpy[2]));
  });
  of_rotation("as if the file should have none",
              [](const Matrix3d&) { return Matrix3d(Matrix3d::Identity()); });
  return faults;
}

/// Compares rows at a few positions; what stands in the world is the same for both when they agree.
class RowComparison {
 public:
  RowComparison(const Pose& X_W0_a, const Pose& X_W0_b, const std::vector<OwnRow>& right, double length,
                double tolerance)
      : X_W0_(X_W0_a), right_(right), length_(length), tolerance_(tolerance) {
    std::mt19937 bits(1);
    constexpr int kStates = 2;
    const auto n = static_cast<Eigen::Index>(right.size());
    for (int state = 0; state < kStates; ++state) {
      VectorXd q(n);
      for (double& entry : q)
        entry = 2.0 * static_cast<double>(bits()) / static_cast<double>(std::mt19937::max()) - 1.0;
      positions_.push_back(q);
      right_poses_.push_back(CalcOwnPoses(X_W0_b, right, q));
    }
    children_.resize(right.size());
    for (size_t i = 0; i < right.size(); ++i) {
      if (right[i].parent >= 0) children_[static_cast<size_t>(right[i].parent)].push_back(i);
    }
  }

  /// Poses of the rows at each position.
  [[nodiscard]] std::vector<std::vector<Pose>> Place(const std::vector<OwnRow>& rows) const {
    std::vector<std::vector<Pose>> poses;
    for (const VectorXd& q : positions_) poses.push_back(CalcOwnPoses(X_W0_, rows, q));
    return poses;
  }

  [[nodiscard]] bool IsAxisRight(const std::vector<OwnRow>& rows, const std::vector<std::vector<Pose>>& poses,
                                 size_t i) const {
    for (size_t state = 0; state < poses.size(); ++state) {
      const Pose& X_a = poses[state][i + 1];
      const Pose& X_b = right_poses_[state][i + 1];
      const Vector3d axis = X_a.linear() * rows[i].axis;
      const Vector3d other = X_b.linear() * right_[i].axis;
      if ((axis - other).norm() > tolerance_) return false;
      if (!rows[i].is_revolute) continue;
      const Vector3d apart = X_b.translation() - X_a.translation();
      if ((apart - axis.dot(apart) * axis).norm() > tolerance_ * length_) return false;
    }
    return true;
  }

  [[nodiscard]] bool IsBodyRight(const std::vector<OwnRow>& rows, const std::vector<std::vector<Pose>>& poses,
                                 size_t i) const {
    if (!(rows[i].body.mass > 0.0) || !(right_[i].body.mass > 0.0)) return true;
    for (size_t state = 0; state < poses.size(); ++state) {
      const MassProperties a = ExpressIn(rows[i].body, poses[state][i + 1]);
      const MassProperties b = ExpressIn(right_[i].body, right_poses_[state][i + 1]);
      if ((a.com - b.com).norm() > tolerance_ * length_) return false;
      const double trace = std::max(a.inertia.trace(), b.inertia.trace());
      if ((a.inertia - b.inertia).cwiseAbs().maxCoeff() > tolerance_ * trace) return false;
    }
    return true;
  }

  /// How many of what joint i places are right: its axis, its body, the axes on its link.
  [[nodiscard]] int CountRight(const std::vector<OwnRow>& rows, size_t i) const {
    const std::vector<std::vector<Pose>> poses = Place(rows);
    if (!IsAxisRight(rows, poses, i)) return 0;
    int count = 1 + (IsBodyRight(rows, poses, i) ? 1 : 0);
    for (const size_t child : children_[i]) count += IsAxisRight(rows, poses, child) ? 1 : 0;
    return count;
  }
  [[nodiscard]] int CountAll(size_t i) const { return 2 + static_cast<int>(children_[i].size()); }

  /// Whether a fault of joint i's body alone explains that it is not right; its axis is.
  [[nodiscard]] bool IsBodysOwnFault(const std::vector<OwnRow>& rows, size_t i) const {
    ComparedBody body;
    body.given = rows[i].body;
    body.right = ExpressIn(right_[i].body, Place(rows)[0][i + 1].inverse() * right_poses_[0][i + 1]);
    body.X_PL = rows[i].X_PL;
    return IsExplainedAlone(body, length_, tolerance_);
  }
  /// Axes on joint i's link that are not right.
  [[nodiscard]] std::vector<size_t> ListWrongChildren(const std::vector<OwnRow>& rows, size_t i) const {
    const std::vector<std::vector<Pose>> poses = Place(rows);
    std::vector<size_t> wrong;
    for (const size_t child : children_[i]) {
      if (!IsAxisRight(rows, poses, child)) wrong.push_back(child);
    }
    return wrong;
  }
  [[nodiscard]] bool IsAxisRight(const std::vector<OwnRow>& rows, size_t i) const {
    return IsAxisRight(rows, Place(rows), i);
  }
  [[nodiscard]] bool IsBodyRight(const std::vector<OwnRow>& rows, size_t i) const {
    return IsBodyRight(rows, Place(rows), i);
  }

  /// Joints and bodies that are not where they should be.
  [[nodiscard]] size_t CountWrong(const std::vector<OwnRow>& rows) const {
    const std::vector<std::vector<Pose>> poses = Place(rows);
    size_t wrong = 0;
    for (size_t i = 0; i < rows.size(); ++i) {
      wrong += (IsAxisRight(rows, poses, i) ? 0 : 1) + (IsBodyRight(rows, poses, i) ? 0 : 1);
    }
    return wrong;
  }

  /// By how much joint i would have to be moved beforehand, rad or m, so that its body or what it carries is
  /// in place; both candidates.
  [[nodiscard]] std::vector<double> ListOffsets(const std::vector<OwnRow>& rows, size_t i) const {
    const std::vector<std::vector<Pose>> poses = Place(rows);
    const Pose& X_a = poses[0][i + 1];
    const Vector3d axis = X_a.linear() * rows[i].axis;
    std::vector<double> offsets;
    const auto add = [&](const Vector3d& own, const Vector3d& other) {
      const Vector3d a = own - X_a.translation();
      const Vector3d b = other - X_a.translation();
      offsets.push_back(rows[i].is_revolute
                            ? std::atan2(axis.dot(a.cross(b)), a.dot(b) - axis.dot(a) * axis.dot(b))
                            : axis.dot(b - a));
    };
    add(X_a * rows[i].body.com, right_poses_[0][i + 1] * right_[i].body.com);
    for (const size_t child : children_[i]) {
      const Vector3d a = poses[0][child + 1].linear() * rows[child].axis;
      const Vector3d b = right_poses_[0][child + 1].linear() * right_[child].axis;
      if (rows[i].is_revolute)
        offsets.push_back(std::atan2(axis.dot(a.cross(b)), a.dot(b) - axis.dot(a) * axis.dot(b)));
      add(poses[0][child + 1].translation(), right_poses_[0][child + 1].translation());
    }
    return offsets;
  }

 private:
  Pose X_W0_;
  const std::vector<OwnRow>& right_;
  double length_;
  double tolerance_;
  std::vector<VectorXd> positions_;
  std::vector<std::vector<Pose>> right_poses_;
  std::vector<std::vector<size_t>> children_;
};

/// Rows as if the table's rows were of another kind; only tables of modified parameters can be misread so.
std::vector<OwnRow> Reread(const RobotDescription& a, const std::function<MdhRow(const MdhRow&)>& change,
                           bool classic) {
  RobotDescription other = a;
  std::vector<OwnRow> rows = ListOwnRows(a);
  std::vector<Pose> behind(rows.size(), Pose::Identity());  // of a classic row: what stands behind the joint
  for (size_t i = 0; i < rows.size(); ++i) {
    const Joint& joint = a.spec.joints[i];
    MdhRow mdh = change(joint.mdh);
    if (classic) {
      behind[i] = Eigen::Translation3d(mdh.a, 0.0, 0.0) * Eigen::AngleAxisd(mdh.alpha, Vector3d::UnitX());
      mdh.a = mdh.alpha = 0.0;
    }
    const Pose before = joint.parent < 0 ? Pose::Identity() : behind[static_cast<size_t>(joint.parent)];
    rows[i].X_PL = before * joint.X_PB * CalcMdhTransform(mdh.alpha, mdh.a, mdh.q, mdh.d);
    if (classic) rows[i].body = ExpressIn(joint.body, behind[i]);
  }
  return rows;
}

class JointSearch {
 public:
  JointSearch(const RobotDescription& a, const RowComparison& comparison, std::vector<OwnRow>* rows)
      : a_(a), comparison_(comparison), rows_(*rows), wrong_(comparison.CountWrong(*rows)) {}

  std::vector<Hypothesis> Run() {
    if (wrong_ == 0) return {};
    if (FindMisreadTable() || FindExchange()) return std::move(found_);
    const std::vector<JointFault> faults = ListJointFaults();
    for (size_t i = 0; i < rows_.size(); ++i) JudgeJoint(i, faults);
    Report();
    return std::move(found_);
  }

 private:
  [[nodiscard]] const std::string& Name(size_t i) const { return a_.spec.joints[i].name; }

  [[nodiscard]] double Explain(size_t left) const {
    return 1.0 - static_cast<double>(left) / static_cast<double>(wrong_);
  }

  bool FindMisreadTable() {
    const bool has_rows = std::any_of(a_.spec.joints.begin(), a_.spec.joints.end(), [](const Joint& joint) {
      return joint.mdh.alpha != 0.0 || joint.mdh.a != 0.0;
    });
    if (!has_rows) return false;
    const auto same = [](const MdhRow& row) { return row; };
    const auto radians = [](MdhRow row) {
      row.alpha = DegToRad(row.alpha);
      row.q = DegToRad(row.q);
      return row;
    };
    const auto alpha_only = [](MdhRow row) {
      row.alpha = -row.alpha;
      return row;
    };
    const auto millimetres = [](MdhRow row) {
      row.a *= 1e-3;
      row.d *= 1e-3;
      return row;
    };
    const std::pair<const char*, std::vector<OwnRow>> readings[] = {
        {"the rows look like classic (standard) Denavit-Hartenberg parameters, and are read as modified ones",
         Reread(a_, same, true)},
        {"alpha and q of the rows look as if in degrees", Reread(a_, radians, false)},
        {"alpha of all rows looks turned around (its sign)", Reread(a_, alpha_only, false)},
        {"a and d of the rows look as if in mm", Reread(a_, millimetres, false)}};
    for (const auto& [text, reading] : readings) {
      const size_t left = comparison_.CountWrong(reading);
      if (left > 0) continue;
      found_.push_back({std::string(text) + ": " + std::to_string(rows_.size()) + " of " +
                            std::to_string(rows_.size()) + " joints",
                        {},
                        Explain(left)});
      rows_ = reading;
      return true;
    }
    return false;
  }

  /// Two joints with one parent that have each other's name.
  bool FindExchange() {
    for (size_t i = 0; i < rows_.size(); ++i) {
      for (size_t j = i + 1; j < rows_.size(); ++j) {
        if (rows_[i].parent != rows_[j].parent || rows_[i].is_revolute != rows_[j].is_revolute) continue;
        std::vector<OwnRow> exchanged = rows_;
        std::swap(exchanged[i], exchanged[j]);
        const size_t left = comparison_.CountWrong(exchanged);
        if (left > 0) continue;
        found_.push_back({"joints " + Name(i) + " and " + Name(j) + " look exchanged", {}, Explain(left)});
        rows_ = exchanged;
        return true;
      }
    }
    return false;
  }

  /// Whether what is wrong at a joint whose axis is right is a fault of its body, or of the joints on its
  /// link.
  bool IsOthersFault(size_t i, const std::vector<JointFault>& faults) {
    if (!comparison_.IsAxisRight(rows_, i)) return false;
    if (!comparison_.IsBodyRight(rows_, i) && !comparison_.IsBodysOwnFault(rows_, i)) return false;
    const std::vector<size_t> children = comparison_.ListWrongChildren(rows_, i);
    return std::all_of(children.begin(), children.end(), [&](size_t child) {
      const OwnRow given = rows_[child];
      const bool repairs = std::any_of(faults.begin(), faults.end(), [&](const JointFault& fault) {
        rows_[child] = fault.undo(given);
        return comparison_.CountRight(rows_, child) == comparison_.CountAll(child);
      });
      rows_[child] = given;
      return repairs;
    });
  }

  void JudgeJoint(size_t i, const std::vector<JointFault>& faults) {
    const int before = comparison_.CountRight(rows_, i);
    if (before == comparison_.CountAll(i) || IsOthersFault(i, faults)) return;
    const OwnRow given = rows_[i];
    int best = before;
    OwnRow best_row = given;
    std::string text;
    std::string plural;
    const auto judge = [&](const OwnRow& row, const std::string& of_one, const std::string& of_many) {
      rows_[i] = row;
      const int count = comparison_.CountRight(rows_, i);
      rows_[i] = given;
      if (count <= best) return;
      best = count;
      best_row = row;
      text = of_one;
      plural = of_many;
    };
    for (const double offset : comparison_.ListOffsets(rows_, i)) {
      OwnRow row = given;
      constexpr double kRounded = 1e-5;  // rad or m: numbers printed with six digits are off by as much
      const char* const many = std::abs(offset) < kRounded ? kZerosRounded : kZerosOffset;
      if (row.is_revolute) {
        row.X_PL = row.X_PL * Eigen::AngleAxisd(offset, row.axis);
        constexpr double kDigits = 1e6;
        judge(row,
              "zero looks offset by " + FormatNumber(std::round(RadToDeg(-offset) * kDigits) / kDigits) +
                  " deg",
              many);
      } else {
        row.X_PL = row.X_PL * Eigen::Translation3d(offset * row.axis);
        constexpr double kDigits = 1e9;
        judge(row, "zero looks offset by " + FormatNumber(std::round(-offset * kDigits) / kDigits) + " m",
              many);
      }
    }
    for (const JointFault& fault : faults) judge(fault.undo(given), fault.text, fault.plural);
    // Moving a joint's place with its body is what a wrong body looks like: one more right thing is not
    // enough when the axis was right.
    if (best <= before) return;
    rows_[i] = best_row;
    by_fault_[plural].push_back({i, text});
  }

  void Report() {
    std::vector<std::pair<std::string, std::vector<std::pair<size_t, std::string>>>> sorted(by_fault_.begin(),
                                                                                            by_fault_.end());
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const auto& x, const auto& y) { return x.second.size() > y.second.size(); });
    const double fraction = Explain(comparison_.CountWrong(rows_));
    size_t count = 0;
    for (const auto& [plural, joints] : sorted) count += joints.size();
    for (const auto& [plural, joints] : sorted) {
      Hypothesis hypothesis;
      hypothesis.explained = fraction * static_cast<double>(joints.size()) / static_cast<double>(count);
      if (joints.size() == 1) {
        hypothesis.text = "joint " + Name(joints[0].first) + ": its " + joints[0].second;
      } else {
        std::vector<std::string> names;
        for (const auto& [i, text] : joints) {
          names.push_back(Name(i));
          if (plural == kZerosOffset || plural == kZerosRounded)
            hypothesis.values.push_back("joint " + Name(i) + ": its " + text);
        }
        hypothesis.text = plural + ": " + std::to_string(joints.size()) + " of " +
                          std::to_string(rows_.size()) + " joints (" + JoinNames(names) + ")";
      }
      found_.push_back(std::move(hypothesis));
    }
  }

  const RobotDescription& a_;
  const RowComparison& comparison_;
  std::vector<OwnRow>& rows_;
  size_t wrong_;
  std::map<std::string, std::vector<std::pair<size_t, std::string>>> by_fault_;
  std::vector<Hypothesis> found_;
};

}  // namespace

std::vector<OwnRow> ListOwnRows(const RobotDescription& robot) {
  std::vector<OwnRow> rows;
  for (size_t i = 0; i < robot.spec.joints.size(); ++i) {
    const Joint& joint = robot.spec.joints[i];
    const Pose& X_iL = robot.joints[i].X_iL;
    const Pose X_PL0 =
        joint.parent < 0 ? Pose::Identity() : robot.joints[static_cast<size_t>(joint.parent)].X_iL;
    OwnRow row;
    row.parent = joint.parent;
    row.is_revolute = joint.type != JointType::kPrismatic;
    row.X_PL = X_PL0.inverse() * joint.X_PB *
               CalcMdhTransform(joint.mdh.alpha, joint.mdh.a, joint.mdh.q, joint.mdh.d) * X_iL;
    row.axis = X_iL.linear().row(2).transpose();  // one of those that a ball joint turns about
    row.body = ExpressIn(joint.body, X_iL.inverse());
    // The own frame may stand beside the axis, as an MJCF's does: then the row's place is on it.
    const Vector3d on_axis = X_iL.inverse().translation();
    row.X_PL = row.X_PL * Eigen::Translation3d(on_axis);
    row.body.com -= on_axis;
    rows.push_back(row);
  }
  // What hangs on a link was placed from its own frame's origin.
  for (OwnRow& row : rows) {
    if (row.parent < 0) continue;
    const Pose& X_iL = robot.joints[static_cast<size_t>(row.parent)].X_iL;
    row.X_PL = Eigen::Translation3d(-X_iL.inverse().translation()) * row.X_PL;
  }
  return rows;
}

std::vector<Pose> CalcOwnPoses(const Pose& X_W0, const std::vector<OwnRow>& rows, const VectorXd& q) {
  std::vector<Pose> poses = {X_W0};
  for (size_t i = 0; i < rows.size(); ++i) {
    const OwnRow& row = rows[i];
    const double position = q[static_cast<Eigen::Index>(i)];
    const Pose X = poses[static_cast<size_t>(row.parent + 1)] * row.X_PL;
    poses.push_back(row.is_revolute ? Pose(X * Eigen::AngleAxisd(position, row.axis))
                                    : Pose(X * Eigen::Translation3d(position * row.axis)));
  }
  return poses;
}

std::vector<Hypothesis> FindJointHypotheses(const RobotDescription& a, const Pose& X_W0_a, const Pose& X_W0_b,
                                            const std::vector<OwnRow>& right, double length, double tolerance,
                                            std::vector<OwnRow>* rows) {
  const RowComparison comparison(X_W0_a, X_W0_b, right, length, tolerance);
  return JointSearch(a, comparison, rows).Run();
}

}  // namespace dexcheck
