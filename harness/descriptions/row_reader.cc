#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "controller/common/text.h"
#include "controller/model/rigid_body.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/fault_search.h"

namespace dexcheck {

namespace {

std::string DescribeOrigin(const StatedPart& part) {
  return "another one, " + ShowNumbers(part.X_PL.translation()) + " would be right";
}

}  // namespace

RowReader::RowReader(const RowProblem& problem) : problem_(problem), children_(problem.bodies.size()) {
  for (size_t i = 0; i < problem_.given.size(); ++i)
    children_[static_cast<size_t>(problem_.given[i].parent + 1)].push_back(i);
}

bool RowReader::IsSame(const StatedPart& a, const StatedPart& b) const {
  constexpr double kSame = 1e-9;
  return (a.X_PL.matrix() - b.X_PL.matrix()).cwiseAbs().maxCoeff() <=
             kSame * std::max(1.0, problem_.close.length) &&
         (a.axis - b.axis).norm() <= kSame;
}

void RowReader::Offer(size_t i, const Pose& X_ab_P, RowReading reading, Readings* readings) const {
  if (IsAxisRight(problem_, i, reading.part, X_ab_P)) readings->push_back(std::move(reading));
}

std::vector<RowReading> RowReader::ListReadings(size_t i, const Pose& X_ab_P, bool in_pairs) const {
  const StatedPart given = StateRow(i);
  const StatedPart right = StateRight(i, X_ab_P);
  // Of frames that differ the right row is not known, and what is missing in one is not either.
  const StatedPart weld{{}, Matrix3d::Identity(), problem_.given[i].X_PW};
  const StatedPart right_weld{{}, Matrix3d::Identity(), problem_.right[i].X_PW};
  const bool is_known = X_ab_P.isApprox(weld.X_PL.inverse(), problem_.close.tolerance);
  const StatedPart& known = is_known && IsSame(weld, right_weld) ? right : given;
  std::vector<RowReading> readings;
  const auto offer = [&](RowReading reading) { Offer(i, X_ab_P, std::move(reading), &readings); };
  offer({given, 0.0, {}, "", ""});
  for (const Convention& first : ListConventions()) {
    if (!IsOfRow(first.of)) continue;
    const std::optional<StatedPart> one = first.undo(given, known);
    if (!one || IsSame(*one, given)) continue;
    offer({*one, kConvention, {&first}, "", ""});
    for (const Convention& second : ListConventions()) {
      if (!in_pairs || !IsOfRow(second.of) || second.of <= first.of) continue;
      const std::optional<StatedPart> two = second.undo(*one, known);
      if (!two || IsSame(*two, *one) || IsSame(*two, given)) continue;
      offer({*two, 2.0 * kConvention + 0.1, {&first, &second}, "", ""});
    }
  }
  // What is welded to the parent may be placed by another convention.
  for (const Convention& convention : ListConventions()) {
    if (!IsOfRow(convention.of) || convention.of == Quantity::kAxis) continue;
    const std::optional<StatedPart> undone = convention.undo(weld, is_known ? right_weld : weld);
    if (!undone || IsSame(*undone, weld)) continue;
    StatedPart moved = given;
    moved.X_PL = weld.X_PL.inverse() * undone->X_PL * given.X_PL;
    offer({moved, kConvention, {&convention}, "", ""});
  }
  AddNumbers(i, X_ab_P, given, right, &readings);
  return readings;
}

void RowReader::AddNumbers(size_t i, const Pose& X_ab_P, const StatedPart& given, const StatedPart& right,
                           Readings* readings) const {
  const auto offer = [&](RowReading reading) { Offer(i, X_ab_P, std::move(reading), readings); };
  if (IsAxisRight(problem_, i, given, X_ab_P)) AddOffsets(i, X_ab_P, given, readings);
  StatedPart turned = given;
  turned.axis = given.X_PL.linear().transpose() * right.X_PL.linear() * right.axis;
  offer({turned,
         kNumber + 0.2,
         {},
         "number.axis",
         "another one, " + ShowNumbers(turned.axis) + " would be right"});
  for (int k = 0; k < 3; ++k) {
    StatedPart moved = given;
    moved.X_PL.translation()[k] = right.X_PL.translation()[k];
    offer({moved, kNumber, {}, "number.origin", DescribeOrigin(moved)});
  }
  const Matrix3d apart = given.X_PL.linear() - right.X_PL.linear();
  const Vector3d angles = CalcRollPitchYaw(given.X_PL.linear()) - CalcRollPitchYaw(right.X_PL.linear());
  const Vector3d places = given.X_PL.translation() - right.X_PL.translation();
  const double few = problem_.close.tolerance;
  auto numbers = static_cast<double>((places.array().abs() > few * problem_.close.length).count());
  if (apart.cwiseAbs().maxCoeff() > few) numbers += static_cast<double>((angles.array().abs() > few).count());
  StatedPart placed = given;
  placed.X_PL = right.X_PL;
  offer({placed,
         std::min(kNumber * numbers, kUnexplained - 0.5),
         {},
         "number.place",
         "another one, " + ShowNumbers(right.X_PL.translation()) + " with roll, pitch, yaw " +
             ShowNumbers(CalcRollPitchYaw(right.X_PL.linear())) + " would be right"});
  placed.axis = right.axis;
  offer({placed,
         std::min(kNumber * (numbers + 1.0), kUnexplained - 0.4),
         {},
         "number.place",
         "another one, with its axis"});
}

/// Another zero, or another place along the axis, by what of the link would then be in place.
void RowReader::AddOffsets(size_t i, const Pose& X_ab_P, const StatedPart& given, Readings* readings) const {
  const Pose X_ab = given.X_PL.inverse() * X_ab_P * problem_.right[i].X_PL;
  const bool turns = problem_.given[i].is_revolute;
  const auto add = [&](const Vector3d& a, const Vector3d& b) {
    const double along = given.axis.dot(b - a);
    const double angle =
        std::atan2(given.axis.dot(a.cross(b)), a.dot(b) - given.axis.dot(a) * given.axis.dot(b));
    OfferOffset(i, X_ab_P, given, turns ? angle : along, readings);
    if (!turns || std::abs(along) <= problem_.close.tolerance * problem_.close.length) return;
    StatedPart moved = given;
    moved.X_PL = given.X_PL * Eigen::Translation3d(along * given.axis);
    Offer(i, X_ab_P, {moved, kNumber, {}, "number.origin", DescribeOrigin(moved)}, readings);
  };
  add(problem_.given[i].body.com, X_ab * problem_.right[i].body.com);
  for (const size_t child : ListChildren(static_cast<int>(i))) {
    const Pose& X_a = problem_.given[child].X_PL;
    const Pose X_b = X_ab * problem_.right[child].X_PL;
    add(X_a.translation(), X_b.translation());
    if (turns) add(X_a.linear() * problem_.given[child].axis, X_b.linear() * problem_.right[child].axis);
  }
}

void RowReader::OfferOffset(size_t i, const Pose& X_ab_P, const StatedPart& given, double offset,
                            Readings* readings) const {
  const bool turns = problem_.given[i].is_revolute;
  const auto offer = [&](RowReading reading) { Offer(i, X_ab_P, std::move(reading), readings); };
  constexpr double kNone = 1e-12;
  if (std::abs(offset) < kNone) return;
  StatedPart part = given;
  constexpr double kMetreDigits = 1e9;
  if (!turns) {
    part.X_PL = given.X_PL * Eigen::Translation3d(offset * given.axis);
    const std::string metres = FormatNumber(std::round(-offset * kMetreDigits) / kMetreDigits);
    offer({part, kConvention, {}, kZero, "offset by " + metres + " m"});
    return;
  }
  // What lies near the axis shows an angle to few digits, and people write few.
  for (const double digits : {1e6, 1e2}) {
    const double degrees = std::round(RadToDeg(-offset) * digits) / digits;
    part.X_PL = given.X_PL * Eigen::AngleAxisd(digits == 1e6 ? offset : -DegToRad(degrees), given.axis);
    const std::string words = "offset by " + FormatNumber(degrees == -180.0 ? 180.0 : degrees) + " deg";
    const double angle = digits == 1e6 ? offset : -DegToRad(degrees);
    offer({part, kConvention, {}, kZero, words, angle});
  }
}

bool IsAxisRight(const RowProblem& problem, size_t joint, const StatedPart& part, const Pose& X_ab_P) {
  const OwnRow& right = problem.right[joint];
  const Pose X_PR = X_ab_P * right.X_PL;
  const Vector3d axis = part.X_PL.linear() * part.axis;
  if ((axis - X_PR.linear() * right.axis).norm() > problem.close.tolerance) return false;
  if (!right.is_revolute) return true;
  const Vector3d apart = X_PR.translation() - part.X_PL.translation();
  return (apart - axis.dot(apart) * axis).norm() <= problem.close.tolerance * problem.close.length;
}

LinkBody PlaceBody(const RowProblem& problem, size_t link, const Pose& X_ab) {
  LinkBody body = problem.bodies[link];
  body.right.body = ExpressIn(body.right.body, X_ab);
  // Where the file says nothing of axes, none can be missing.
  if (!body.right.R_LC.isIdentity()) body.right.R_LC = X_ab.linear() * body.right.R_LC;
  for (DescribedPart& part : body.right_parts) {
    part.body = ExpressIn(part.body, X_ab);
    part.X_iL = X_ab * part.X_iL;
    part.X_LC = X_ab * part.X_LC;
  }
  return body;
}

namespace {

/// Of one convention, or of one number, in each reading that is left.
std::set<std::string> ListIds(const RowFinding& finding) {
  std::set<std::string> ids;
  for (const RowReading& reading : finding.readings) {
    for (const Convention* const convention : reading.conventions) ids.insert(convention->id);
    if (!reading.number.empty()) ids.insert(reading.number);
  }
  return ids;
}

std::string Say(const std::string& noun, bool many, const std::string& words) {
  return noun + (many ? " look " : " looks ") + words;
}

std::string Describe(const std::string& id, const RowFinding& finding, bool many) {
  for (const RowReading& reading : finding.readings) {
    for (const Convention* const convention : reading.conventions) {
      if (convention->id == id) return Say(NameOf(convention->of, many), many, convention->words);
    }
    if (reading.number != id) continue;
    const std::string noun = id.substr(id.find('.') + 1);
    if (id == "zero.offset") return many ? "zeros look offset" : "zero looks " + reading.words;
    return many ? noun + (noun == "axis" ? " numbers differ" : "s differ") : noun + " looks " + reading.words;
  }
  return id;
}

/// What is to be said of rows that share a convention, or a number.
class RowReport {
 public:
  RowReport(const RobotDescription& a, const std::vector<RowFinding>& findings) : a_(a), open_(findings) {}

  std::vector<Finding> Run() {
    while (true) {
      std::map<std::string, std::vector<size_t>> rows_of;
      for (size_t i = 0; i < open_.size(); ++i) {
        for (const std::string& id : ListIds(open_[i])) rows_of[id].push_back(i);
      }
      if (rows_of.empty()) return std::move(found_);
      const auto most = std::ranges::max_element(
          rows_of, [](const auto& x, const auto& y) { return x.second.size() < y.second.size(); });
      Take(rows_of, most->second);
    }
  }

 private:
  static bool Has(const RowReading& reading, const std::string& id) {
    return reading.number == id ||
           std::ranges::any_of(reading.conventions,
                               [&](const Convention* convention) { return convention->id == id; });
  }

  /// One finding of these rows: all ids that explain each of them.
  void Take(const std::map<std::string, std::vector<size_t>>& rows_of, const std::vector<size_t>& rows) {
    Finding finding;
    finding.what = "joint";
    finding.total = a_.spec.joints.size();
    std::string taken;
    for (const auto& entry : rows_of) {
      const std::string& id = entry.first;
      if (entry.second != rows) continue;
      const std::vector<RowReading>& readings = open_[rows[0]].readings;
      const bool is_beside = !taken.empty() && std::ranges::any_of(readings, [&](const RowReading& reading) {
        return Has(reading, id) && Has(reading, taken);
      });
      if (is_beside) continue;  // both at once are two faults
      if (taken.empty()) taken = id;
      finding.ids.push_back(id);
      finding.one.push_back("its " + Describe(id, open_[rows[0]], false));
      finding.many.push_back(Describe(id, open_[rows[0]], true));
    }
    if (rows.size() == 1 && rows[0] > 0) {
      const int parent = a_.spec.joints[rows[0] - 1].parent;
      AddElsewhere(a_, open_[static_cast<size_t>(parent + 1)], parent, &finding);
    }
    for (const size_t i : rows) {
      finding.parts.push_back(i == 0 ? "" : a_.spec.joints[i - 1].name);
      AddValue(taken, i, rows.size(), &finding);
      for (RowReading& reading : open_[i].readings) {
        if (!Has(reading, taken)) reading = RowReading{};
        std::erase_if(reading.conventions,
                      [&](const Convention* convention) { return convention->id == taken; });
        if (reading.number == taken) reading.number.clear();
      }
    }
    finding.cells = rows.size();
    found_.push_back(std::move(finding));
  }

  void AddValue(const std::string& id, size_t row, size_t rows, Finding* finding) const {
    if (rows < 2 || id.find('.') == std::string::npos) return;
    for (const RowReading& reading : open_[row].readings) {
      if (reading.number != id) continue;
      finding->values.push_back("joint " + finding->parts.back() + ": its " +
                                (id == "zero.offset" ? "zero" : id.substr(id.find('.') + 1)) + " looks " +
                                reading.words);
      return;
    }
  }

  const RobotDescription& a_;
  std::vector<RowFinding> open_;
  std::vector<Finding> found_;
};

}  // namespace

void AddElsewhere(const RobotDescription& robot, const RowFinding& row, int joint, Finding* finding) {
  if (finding->ids[0].starts_with("number.")) return;
  RowFinding one;
  one.readings = row.elsewhere;
  const std::string name =
      joint < 0 ? "the base" : "joint " + robot.spec.joints[static_cast<size_t>(joint)].name;
  for (const std::string& id : ListIds(one)) {
    finding->ids.push_back(id);
    finding->one.push_back("that of " + name + ": its " + Describe(id, one, false));
  }
}

std::vector<Finding> ReportRows(const RobotDescription& robot, const std::vector<RowFinding>& rows) {
  return RowReport(robot, rows).Run();
}

}  // namespace dexcheck
