#include "harness/descriptions/hypotheses.h"

#include <algorithm>
#include <tuple>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/model/rigid_body.h"
#include "harness/descriptions/description_match.h"
#include "harness/descriptions/fault_search.h"

namespace dexcheck {
namespace {

std::string JoinAlternatives(const std::vector<std::string>& clauses) {
  std::string text;
  for (const std::string& clause : clauses) text += (text.empty() ? "" : ", or ") + clause;
  return text;
}

std::string Describe(const Finding& finding) {
  const std::string open = finding.ids.size() > 1 ? " (these two files cannot tell which)" : "";
  if (finding.what.empty()) return JoinAlternatives(finding.one) + open;
  if (finding.parts.size() == 1) {
    const bool is_base = finding.what == "joint" && finding.parts[0].empty();
    return (is_base ? "base" : finding.what + " " + finding.parts[0]) + ": " + JoinAlternatives(finding.one) +
           open;
  }
  return (finding.is_all ? "all " : "") + JoinAlternatives(finding.many) + open + ": " +
         std::to_string(finding.parts.size()) + " of " + std::to_string(finding.total) + " " + finding.what +
         "s" + (finding.is_all ? "" : " (" + JoinNames(finding.parts) + ")");
}

/// Farthest that axes and bodies can be from the base.
double CalcLength(const std::vector<OwnRow>& rows) {
  std::vector<double> reach;
  double length = 0.0;
  for (const OwnRow& row : rows) {
    const double before = row.parent < 0 ? 0.0 : reach[static_cast<size_t>(row.parent)];
    reach.push_back(before + row.X_PL.translation().norm());
    length = std::max(length, reach.back() + row.body.com.norm());
  }
  return length > 0.0 ? length : 1.0;
}

StatedPart StateJoint(const Joint& joint, const OwnRow& row) {
  StatedPart part;
  part.body = row.body;
  part.X_PL = row.X_PW.inverse() * row.X_PL;  // as the file has it
  part.axis = row.axis;
  part.lower = joint.lower;
  part.upper = joint.upper;
  part.damping = joint.damping;
  part.armature = joint.armature;
  return part;
}

/// Axes along which a body that is one part is given.
Matrix3d FindAxes(const std::vector<DescribedPart>& parts) {
  return parts.size() == 1 ? Matrix3d(parts[0].X_LC.linear()) : Matrix3d(Matrix3d::Identity());
}

/// @param b_of_a joint of `b` for each of `a`.
RowProblem MakeProblem(const RobotDescription& a, const RobotDescription& b, const std::vector<int>& b_of_a,
                       double tolerance) {
  RowProblem problem;
  problem.given = ListOwnRows(a);
  const std::vector<OwnRow> others = ListOwnRows(b);
  problem.base_is_fixed = a.spec.base.type != BaseType::kFloating;
  if (problem.base_is_fixed) {
    problem.X_W0_given = a.spec.base.X_B0;
    problem.X_W0_right = b.spec.base.X_B0;
  }
  const auto add = [&](int joint, int joint_b, const std::string& link, StatedPart given, StatedPart right) {
    const std::string name = joint < 0 ? "" : a.spec.joints[static_cast<size_t>(joint)].name;
    LinkBody body{link,
                  name,
                  std::move(given),
                  std::move(right),
                  ListParts(a, joint, Pose::Identity()),
                  ListParts(b, joint_b, Pose::Identity())};
    body.given.R_LC = FindAxes(body.given_parts);
    body.right.R_LC = FindAxes(body.right_parts);
    for (size_t k = 0; k < problem.given.size(); ++k) {
      if (problem.given[k].parent == joint) body.given.X_LD.push_back(problem.given[k].X_PL);
    }
    problem.bodies.push_back(std::move(body));
  };
  add(-1, -1, a.spec.base.link, StatedPart{a.spec.base.body}, StatedPart{b.spec.base.body});
  for (size_t i = 0; i < problem.given.size(); ++i) {
    const auto j = static_cast<size_t>(b_of_a[i]);
    problem.right.push_back(others[j]);
    problem.right.back().parent = problem.given[i].parent;
    const Joint& joint = a.spec.joints[i];
    add(static_cast<int>(i), b_of_a[i], joint.link, StateJoint(joint, problem.given[i]),
        StateJoint(b.spec.joints[j], others[j]));
    const auto silence = [&](bool DescribedJoint::*states, Quantity quantity) {
      LinkBody& body = problem.bodies.back();
      const bool is_turn = joint.type == JointType::kRevolute;
      if (!(a.joints[i].*states && b.joints[j].*states && is_turn))
        TakeFrom(body.right, quantity, &body.given);
    };
    silence(&DescribedJoint::states_range, Quantity::kRange);
    silence(&DescribedJoint::states_damping, Quantity::kDamping);
    silence(&DescribedJoint::states_armature, Quantity::kArmature);
  }
  problem.close = {CalcLength(problem.right), tolerance};
  return problem;
}

bool IsSameBody(const MassProperties& a, const MassProperties& b) {
  return a.mass == b.mass && a.com == b.com && a.inertia == b.inertia;
}

class Explaining {
 public:
  Explaining(const RobotDescription& a, const RobotDescription& b, double tolerance)
      : a_(a), b_(b), tolerance_(tolerance) {}

  /// Whether rows and bodies are the same: of joints of one name, no more is asked here.
  bool Agrees() {
    const RowProblem problem = MakeProblem(a_, b_, MatchJoints(a_.spec, b_.spec), tolerance_);
    std::vector<Pose> X_ab = {problem.X_W0_given.inverse() * problem.X_W0_right};
    for (size_t i = 0; i < problem.given.size(); ++i) {
      const Pose& X_ab_P = X_ab[static_cast<size_t>(problem.given[i].parent + 1)];
      const Pose X_ab_W = problem.given[i].X_PW.inverse() * X_ab_P;
      if (!IsAxisRight(problem, i, problem.bodies[i + 1].given, X_ab_W)) return false;
      X_ab.push_back(problem.given[i].X_PL.inverse() * X_ab_P * problem.right[i].X_PL);
      if (!IsRight(PlaceBody(problem, i + 1, X_ab.back()), problem.close)) return false;
    }
    return true;
  }

  std::vector<Hypothesis> Run() {
    RowProblem problem = MakeProblem(a_, b_, MatchJoints(a_.spec, b_.spec), tolerance_);
    std::vector<RowFinding> rows = SearchRows(problem);
    const bool is_misread = std::ranges::any_of(
        rows, [](const RowFinding& row) { return !row.is_placed || !row.readings.empty(); });
    if (!is_misread || !FindMisreadTable(&problem, &rows)) {
      for (const Finding& finding : ReportRows(a_, rows)) found_.push_back(finding);
    }
    FindGravity();
    std::vector<LinkBody> bodies = PlaceBodies(problem, rows);
    for (Finding finding : SearchBodies(problem.close, &bodies)) {
      for (size_t i = 0; i < a_.spec.joints.size() && finding.parts.size() == 1; ++i) {
        if (finding.what == "link" && finding.parts[0] == a_.spec.joints[i].link)
          AddElsewhere(a_, rows[i + 1], static_cast<int>(i), &finding);
      }
      found_.push_back(std::move(finding));
    }
    bodies_ = std::move(bodies);
    if (problem.base_is_fixed) bodies_.insert(bodies_.begin(), problem.bodies[0]);
    rows_ = std::move(rows);
    return Report();
  }

  /// A description as it was read with the conventions undone that were found; none where its rows cannot be
  /// written so.
  [[nodiscard]] std::optional<RobotDescription> Undo(RobotDescription robot) const {
    const auto is_misread = [](const RowFinding& row) {
      return !row.readings.empty() &&
             (!row.readings[0].conventions.empty() || row.readings[0].number == kZero);
    };
    for (const Finding& finding : found_) {
      if (finding.ids[0].starts_with("table.")) return std::nullopt;
      if (finding.ids[0].starts_with("gravity.")) robot.spec.gravity = b_.spec.gravity;
    }
    const std::vector<OwnRow> completed = ListOwnRows(a_);
    const std::vector<OwnRow> rows = ListOwnRows(robot);
    if (is_misread(rows_[0])) robot.spec.base.X_B0 = rows_[0].readings[0].part.X_PL;
    for (size_t i = 0; i < rows.size(); ++i) {
      const StatedPart& given = bodies_[i + 1].given;
      if (!rows[i].X_PL.isApprox(completed[i].X_PL)) return std::nullopt;  // from another base
      if (is_misread(rows_[i + 1])) {
        if (!robot.joints[i].is_plain) return std::nullopt;
        const StatedPart& read = rows_[i + 1].readings[0].part;
        TakeOwnRow(static_cast<int>(i), rows[i].X_PW * read.X_PL, read.axis, &robot);
      }
      Joint& joint = robot.spec.joints[i];
      if (!IsSameBody(given.body, rows[i].body)) joint.body = ExpressIn(given.body, robot.joints[i].X_iL);
      if (joint.type != JointType::kRevolute) continue;  // of others these are not asked for
      const DescribedJoint& stated = robot.joints[i];
      if (stated.states_range) std::tie(joint.lower, joint.upper) = std::tie(given.lower, given.upper);
      if (stated.states_damping) joint.damping = given.damping;
      if (stated.states_armature) joint.armature = given.armature;
    }
    robot.spec.base.body = bodies_[0].given.body;
    return robot;
  }

 private:
  static bool IsRightEverywhere(const std::vector<RowFinding>& rows) {
    return std::ranges::all_of(rows,
                               [](const RowFinding& row) { return row.is_placed && row.readings.empty(); });
  }

  /// Tables of Denavit-Hartenberg rows that were meant in another way.
  bool FindMisreadTable(RowProblem* problem, std::vector<RowFinding>* rows) {
    const std::vector<Joint>& joints = a_.spec.joints;
    if (std::ranges::none_of(joints,
                             [](const Joint& joint) { return joint.mdh.alpha != 0.0 || joint.mdh.a != 0.0; }))
      return false;
    const auto same = [](MdhRow row) { return row; };
    const auto radians = [](MdhRow row) {
      return MdhRow{DegToRad(row.alpha), row.a, DegToRad(row.q), row.d};
    };
    const auto sign = [](MdhRow row) { return MdhRow{-row.alpha, row.a, row.q, row.d}; };
    const auto metres = [](MdhRow row) { return MdhRow{row.alpha, 1e-3 * row.a, row.q, 1e-3 * row.d}; };
    const struct {
      const char* id;
      const char* words;
      std::vector<OwnRow> rows;
    } readings[] = {
        {"table.classic",
         "the rows look like classic (standard) Denavit-Hartenberg parameters, and are read as modified ones",
         ReadRowsAs(a_, same, true)},
        {"table.degrees", "alpha and q of the rows look as if in degrees", ReadRowsAs(a_, radians, false)},
        {"table.alpha_sign", "alpha of all rows looks turned around (its sign)", ReadRowsAs(a_, sign, false)},
        {"table.mm", "a and d of the rows look as if in mm", ReadRowsAs(a_, metres, false)}};
    for (const auto& reading : readings) {
      RowProblem other = *problem;
      other.given = reading.rows;
      for (size_t i = 0; i < other.given.size(); ++i) other.bodies[i + 1].given.body = other.given[i].body;
      const std::vector<RowFinding> found = SearchRows(other);
      if (!IsRightEverywhere(found)) continue;
      Finding& finding = found_.emplace_back();
      finding.ids = {reading.id};
      finding.one = {std::string(reading.words) + ": " + std::to_string(joints.size()) + " of " +
                     std::to_string(joints.size()) + " joints"};
      finding.cells = other.given.size();
      for (const Joint& joint : joints) finding.parts.push_back(joint.name);
      *problem = std::move(other);
      *rows = found;
      return true;
    }
    return false;
  }

  void FindGravity() {
    if (!a_.states_gravity || !b_.states_gravity) return;
    const Vector3d& own = a_.spec.gravity;
    const Vector3d& right = b_.spec.gravity;
    const double few = tolerance_ * std::max(own.norm(), right.norm());
    if ((own - right).norm() <= few) return;
    Finding finding;
    finding.cells = 1;
    finding.parts = {"gravity"};
    const bool is_along =
        own.normalized().cross(right.normalized()).norm() <= tolerance_ && own.dot(right) > 0.0;
    const std::tuple<bool, const char*, const char*> readings[] = {
        {(own + right).norm() <= few, "gravity.sign", "gravity looks turned around (its sign)"},
        {own.isZero(0.0), "gravity.missing", "gravity looks forgotten"},
        {(1e-3 * own - right).norm() <= few, "gravity.mm", "gravity looks as if in mm/s^2"},
        {is_along, "gravity.value", "gravity has the right direction and another value"},
        {std::abs(own.norm() - right.norm()) <= few, "gravity.axis", "gravity points along another axis"},
        {true, "gravity.other", "gravity differs"}};
    const auto first =
        std::ranges::find_if(readings, [](const auto& reading) { return std::get<0>(reading); });
    finding.ids = {std::get<1>(*first)};
    finding.one = {std::get<2>(*first)};
    finding.values.push_back("gravity: " + ShowNumbers(own) + "; right would be " + ShowNumbers(right));
    found_.push_back(std::move(finding));
  }

  /// Bodies in the own frames of `a`, where that is known by now.
  [[nodiscard]] std::vector<LinkBody> PlaceBodies(const RowProblem& problem,
                                                  const std::vector<RowFinding>& rows) const {
    std::vector<LinkBody> bodies;
    for (size_t link = problem.base_is_fixed ? 1 : 0; link < rows.size(); ++link) {
      LinkBody& body = bodies.emplace_back(PlaceBody(problem, link, rows[link].X_ab));
      if (!rows[link].readings.empty()) body.given.X_PL = rows[link].readings[0].part.X_PL;
      if (rows[link].is_placed) continue;
      for (const Quantity quantity : {Quantity::kCom, Quantity::kInertia})
        TakeFrom(body.right, quantity, &body.given);
      body.given_parts.clear();
    }
    return bodies;
  }

  [[nodiscard]] std::vector<Hypothesis> Report() const {
    size_t cells = 0;
    bool has_convention = false;
    for (const Finding& finding : found_) {
      cells += finding.cells;
      has_convention = has_convention || !finding.ids[0].starts_with("number.");
    }
    std::vector<Hypothesis> hypotheses;
    for (const Finding& finding : found_) {
      if (!has_convention) break;
      Hypothesis& hypothesis = hypotheses.emplace_back(finding);
      hypothesis.text = Describe(finding);
      hypothesis.explained = static_cast<double>(finding.cells) / static_cast<double>(cells);
    }
    return hypotheses;
  }

  const RobotDescription& a_;
  const RobotDescription& b_;
  double tolerance_;
  std::vector<Finding> found_;
  std::vector<RowFinding> rows_;
  std::vector<LinkBody> bodies_;  // of the base, then of each joint: with conventions undone
};

/// Whether joints of one name hang on joints of one name.
bool IsSameTree(const RobotSpec& a, const RobotSpec& b) {
  const std::vector<int> b_of_a = MatchJoints(a, b);
  for (size_t i = 0; i < b_of_a.size(); ++i) {
    if (b_of_a[i] < 0) return false;
    const Joint& other = b.joints[static_cast<size_t>(b_of_a[i])];
    const int parent = a.joints[i].parent;
    if (a.joints[i].type != other.type) return false;
    if (other.parent != (parent < 0 ? -1 : b_of_a[static_cast<size_t>(parent)])) return false;
  }
  return a.joints.size() == b.joints.size();
}

/// Two joints that have each other's name: with it exchanged again the two are one mechanism, and agree.
std::optional<Hypothesis> FindExchangedNames(const RobotDescription& a, const RobotDescription& b,
                                             double tolerance) {
  const size_t n = a.spec.joints.size();
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = i + 1; j < n; ++j) {
      RobotSpec tree = a.spec;
      std::swap(tree.joints[i].name, tree.joints[j].name);
      if (!IsSameTree(tree, b.spec)) continue;
      RobotDescription exchanged = a;
      exchanged.spec = std::move(tree);
      RobotDescription other = b;
      try {
        CompleteEachOther(&exchanged, &other);
      } catch (const InputError&) {
        continue;
      }
      if (!Explaining(exchanged, other, tolerance).Agrees()) continue;
      const std::vector<std::string> names = {a.spec.joints[i].name, a.spec.joints[j].name};
      return Hypothesis{
          "joints " + names[0] + " and " + names[1] + " look exchanged", {}, 1.0, {"exchange.joint"}, names};
    }
  }
  return std::nullopt;
}

}  // namespace

ExplainedDifference Explain(const RobotDescription& a, const RobotDescription& b, double tolerance) {
  ExplainedDifference explanation;
  RobotDescription own = a;
  RobotDescription other = b;
  bool is_one_mechanism = true;
  try {
    CompleteEachOther(&own, &other);
    Explaining search(own, other, tolerance);
    explanation.hypotheses = search.Run();
    if (!explanation.hypotheses.empty()) explanation.undone = search.Undo(a);
  } catch (const InputError&) {
    is_one_mechanism = false;
  }
  if (is_one_mechanism && explanation.hypotheses.size() <= 1) return explanation;
  if (const std::optional<Hypothesis> names = FindExchangedNames(a, b, tolerance)) return {{*names}, {}};
  return explanation;
}

}  // namespace dexcheck
