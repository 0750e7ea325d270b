#include "harness/descriptions/row_search.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "controller/common/text.h"
#include "controller/model/body_frame.h"
#include "harness/descriptions/parameter_writer.h"

namespace dexcheck {
namespace {

// A convention costs 1; one that many joints have explains more of them at once. A number that can take any
// value explains by chance what a convention does not.
constexpr double kConvention = 1.0;
constexpr double kCommonConvention = 0.6;
constexpr double kNumber = 1.3;
constexpr double kUnexplained = 4.0;
constexpr double kSameCost = 1e-9;
constexpr const char* kZero = "zero.offset";

bool IsOfRow(Quantity of) {
  return of == Quantity::kOrigin || of == Quantity::kRotation || of == Quantity::kPlace ||
         of == Quantity::kAxis;
}

class RowSearch {
 public:
  explicit RowSearch(const RowProblem& problem) : problem_(problem), children_(problem.given.size() + 1) {
    for (size_t i = 0; i < problem_.given.size(); ++i)
      children_[static_cast<size_t>(problem_.given[i].parent + 1)].push_back(i);
  }

  std::vector<RowFinding> Run() {
    // What is common is known after a first look at all.
    std::vector<RowFinding> findings = Read();
    if (IsExplainedByOne(findings)) return findings;
    std::vector<RowFinding> alike = ReadAlike(findings);
    if (!alike.empty()) return alike;
    CountCommon(findings);
    return common_.empty() ? findings : Read();
  }

 private:
  static bool IsExplainedByOne(const std::vector<RowFinding>& findings) {
    return std::count_if(findings.begin(), findings.end(), [](const RowFinding& finding) {
             return !finding.is_placed || !finding.readings.empty();
           }) <= 1;
  }

  /// One reading of all rows.
  using Change = std::function<std::optional<RowReading>(const StatedPart& given, const StatedPart& right)>;

  [[nodiscard]] std::vector<Change> ListChanges(const std::vector<RowFinding>& findings) const {
    std::vector<Change> changes;
    for (const Convention& convention : ListConventions()) {
      if (!IsOfRow(convention.of)) continue;
      changes.push_back([&](const StatedPart& given, const StatedPart& right) -> std::optional<RowReading> {
        const std::optional<StatedPart> undone = convention.undo(given, right);
        if (!undone) return std::nullopt;
        return RowReading{*undone, kConvention, {&convention}, "", ""};
      });
    }
    std::map<std::string, double> offsets;
    for (const RowFinding& finding : findings) {
      for (const RowReading& reading : finding.readings) {
        if (reading.number == kZero) offsets[reading.words] = reading.offset;
      }
    }
    for (const auto& offset : offsets) {
      changes.push_back([offset](StatedPart given, const StatedPart&) -> std::optional<RowReading> {
        given.X_PL = given.X_PL * Eigen::AngleAxisd(offset.second, given.axis);
        return RowReading{given, kConvention, {}, kZero, offset.first, offset.second};
      });
    }
    return changes;
  }

  /// Changes of all rows after which all axes are right and least of the bodies is wrong; none when there is
  /// no such change, or when more is wrong than by row.
  [[nodiscard]] std::vector<RowFinding> ReadAlike(const std::vector<RowFinding>& by_row) const {
    double least = CostBodies(by_row);
    for (const RowFinding& finding : by_row) least += finding.is_placed ? 0.0 : kUnexplained;
    least += 1e-9;
    std::vector<RowFinding> best;
    for (const Change& change : ListChanges(by_row)) {
      std::vector<RowFinding> findings = Apply(change);
      if (findings.empty()) continue;
      const double cost = CostBodies(findings);
      if (cost > least) continue;
      if (best.empty() || cost < least - kSameCost) {
        best = std::move(findings);
        least = cost;
        continue;
      }
      for (size_t i = 0; i < best.size(); ++i) {
        best[i].readings.insert(best[i].readings.end(), findings[i].readings.begin(),
                                findings[i].readings.end());
      }
    }
    return best;
  }

  [[nodiscard]] double CostBodies(const std::vector<RowFinding>& findings) const {
    double cost = 0.0;
    for (size_t link = 0; link < findings.size(); ++link) {
      if (findings[link].is_placed) cost += CostBody(link, findings[link].X_ab);
    }
    return cost;
  }

  [[nodiscard]] std::vector<RowFinding> Apply(const Change& change) const {
    std::vector<RowFinding> findings(children_.size());
    findings[0].X_ab = problem_.X_W0_given.inverse() * problem_.X_W0_right;
    findings[0].is_placed = true;
    for (size_t i = 0; i < problem_.given.size(); ++i) {
      const Pose X_ab_P = ToCarrier(i, findings[static_cast<size_t>(problem_.given[i].parent + 1)].X_ab);
      RowReading reading{StateRow(i), 0.0, {}, "", ""};
      std::optional<RowReading> changed = change(reading.part, StateRight(i, X_ab_P));
      const bool changes = changed && !IsSame(changed->part, reading.part);
      if (changes) reading = std::move(*changed);
      if (!IsAxisRight(reading.part, i, X_ab_P)) return {};
      findings[i + 1].X_ab = Follow(reading, i, X_ab_P);
      findings[i + 1].is_placed = true;
      if (changes) findings[i + 1].readings.push_back(std::move(reading));
    }
    return findings;
  }

  std::vector<RowFinding> Read() {
    std::vector<RowFinding> findings(children_.size());
    ReadBase(&findings[0]);
    for (size_t i = 0; i < problem_.given.size(); ++i) {
      const RowFinding& parent = findings[static_cast<size_t>(problem_.given[i].parent + 1)];
      if (parent.is_placed) ReadRow(i, ToCarrier(i, parent.X_ab), &findings[i + 1]);
    }
    return findings;
  }

  /// What a reading is called by: conventions by their ids, offsets of zeros by their size.
  static std::vector<std::string> ListKeys(const RowReading& reading) {
    std::vector<std::string> keys;
    for (const Convention* const convention : reading.conventions) keys.push_back(convention->id);
    if (reading.number == kZero) keys.push_back(reading.words);
    return keys;
  }

  /// What most rows share is common, then what most of the others do.
  void CountCommon(const std::vector<RowFinding>& findings) {
    std::map<std::string, std::set<size_t>> rows_of;
    for (size_t i = 0; i < findings.size(); ++i) {
      for (const RowReading& reading : findings[i].readings) {
        for (const std::string& key : ListKeys(reading)) rows_of[key].insert(i);
      }
    }
    constexpr size_t kCommon = 3;
    const auto by_size = [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); };
    while (!rows_of.empty()) {
      const std::set<size_t> most = std::max_element(rows_of.begin(), rows_of.end(), by_size)->second;
      if (most.size() < std::min(kCommon, problem_.given.size())) return;
      for (auto& [key, rows] : rows_of) {
        if (rows == most) common_.insert(key);
      }
      for (auto& [key, rows] : rows_of) {
        for (const size_t i : most) rows.erase(i);
      }
    }
  }

  /// A convention that says no more than that the right number is zero costs what a number does.
  [[nodiscard]] double CostOf(const Convention& convention) const {
    if (convention.id == "rotation.unneeded") return kConvention;
    return common_.contains(convention.id) ? kCommonConvention : kConvention;
  }

  [[nodiscard]] bool IsSame(const StatedPart& a, const StatedPart& b) const {
    constexpr double kSame = 1e-9;
    return (a.X_PL.matrix() - b.X_PL.matrix()).cwiseAbs().maxCoeff() <=
               kSame * std::max(1.0, problem_.close.length) &&
           (a.axis - b.axis).norm() <= kSame;
  }

  // The base, of which no axis tells where it stands.

  void ReadBase(RowFinding* finding) {
    StatedPart given;
    given.X_PL = problem_.X_W0_given;
    StatedPart right;
    right.X_PL = problem_.X_W0_right;
    std::vector<RowReading> readings = {{given, 0.0, {}, "", ""}};
    if (problem_.base_is_fixed) {
      for (const Convention& convention : ListMountings()) {
        const std::optional<StatedPart> undone = convention.undo(given, right);
        if (undone && !IsSame(*undone, given))
          readings.push_back({*undone, kConvention, {&convention}, "", ""});
      }
      const Vector3d p = given.X_PL.translation() - right.X_PL.translation();
      const int numbers =
          static_cast<int>((p.array().abs() > problem_.close.tolerance * problem_.close.length).count());
      readings.push_back(
          {right, kNumber * std::max(1, numbers) + 0.5, {}, "number.base", "placed elsewhere"});
    }
    constexpr int kDepth = 3;
    for (RowReading& reading : readings)
      reading.cost += CostBehind(-1, reading.part.X_PL.inverse() * problem_.X_W0_right, kDepth);
    Keep(std::move(readings), problem_.X_W0_right, finding);
  }

  void ReadRow(size_t i, const Pose& X_ab_P, RowFinding* finding) {
    constexpr int kDepth = 2;
    std::vector<RowReading> readings = ListReadings(i, X_ab_P, false);
    bool is_explained = false;
    const auto look_behind = [&] {
      for (RowReading& reading : readings) {
        const double behind = CostBehind(static_cast<int>(i), Follow(reading, i, X_ab_P), kDepth);
        is_explained = is_explained || behind == 0.0;
        reading.cost += behind;
      }
    };
    look_behind();
    if (!is_explained) {
      readings = ListReadings(i, X_ab_P, true);
      look_behind();
    }
    if (readings.empty()) {
      finding->readings = {RowReading{}};
      return;
    }
    Keep(std::move(readings), X_ab_P * problem_.right[i].X_PL, finding);
  }

  /// The cheapest; the row as it is stands alone, since what is wrong is then another's.
  static void Keep(std::vector<RowReading> readings, const Pose& X_PR, RowFinding* finding) {
    const auto cheaper = [](const RowReading& a, const RowReading& b) { return a.cost < b.cost; };
    const double least = std::min_element(readings.begin(), readings.end(), cheaper)->cost;
    std::erase_if(readings, [&](const RowReading& reading) { return reading.cost > least + kSameCost; });
    // Another place is what any of the others is.
    const auto is_place = [](const RowReading& reading) { return reading.number == "number.place"; };
    if (!std::all_of(readings.begin(), readings.end(), is_place)) std::erase_if(readings, is_place);
    finding->X_ab = readings[0].part.X_PL.inverse() * X_PR;
    finding->is_placed = true;
    const bool is_right = readings[0].conventions.empty() && readings[0].number.empty();
    (is_right ? finding->elsewhere : finding->readings) = std::move(readings);
  }

  [[nodiscard]] Pose Follow(const RowReading& reading, size_t i, const Pose& X_ab_P) const {
    return reading.part.X_PL.inverse() * X_ab_P * problem_.right[i].X_PL;
  }

  [[nodiscard]] bool IsAxisRight(const StatedPart& part, size_t i, const Pose& X_ab_P) const {
    return dexcheck::IsAxisRight(problem_, i, part, X_ab_P);
  }

  /// From here on a row's parent frame is that in which the file places it.
  [[nodiscard]] Pose ToCarrier(size_t i, const Pose& X_ab) const {
    return problem_.given[i].X_PW.inverse() * X_ab;
  }

  [[nodiscard]] StatedPart StateRow(size_t i) const {
    StatedPart part = problem_.bodies[i + 1].given;
    part.X_PL = problem_.given[i].X_PW.inverse() * problem_.given[i].X_PL;
    part.axis = problem_.given[i].axis;
    return part;
  }

  /// What would be right if the two files had the same frame on the link.
  [[nodiscard]] StatedPart StateRight(size_t i, const Pose& X_ab_P) const {
    StatedPart part;
    part.X_PL = X_ab_P * problem_.right[i].X_PL;
    part.axis = problem_.right[i].axis;
    return part;
  }

  /// Readings under which the axis is right.
  /// @param in_pairs also two conventions at once.
  [[nodiscard]] std::vector<RowReading> ListReadings(size_t i, const Pose& X_ab_P, bool in_pairs) const {
    const StatedPart given = StateRow(i);
    const StatedPart right = StateRight(i, X_ab_P);
    // Of frames that differ the right row is not known, and what is missing in one is not either.
    const StatedPart& known =
        X_ab_P.isApprox(problem_.given[i].X_PW.inverse(), problem_.close.tolerance) ? right : given;
    std::vector<RowReading> readings;
    const auto offer = [&](RowReading reading) {
      if (IsAxisRight(reading.part, i, X_ab_P)) readings.push_back(std::move(reading));
    };
    offer({given, 0.0, {}, "", ""});
    for (const Convention& first : ListConventions()) {
      if (!IsOfRow(first.of)) continue;
      const std::optional<StatedPart> one = first.undo(given, known);
      if (!one || IsSame(*one, given)) continue;
      offer({*one, CostOf(first), {&first}, "", ""});
      for (const Convention& second : ListConventions()) {
        if (!in_pairs || !IsOfRow(second.of) || second.of <= first.of) continue;
        const std::optional<StatedPart> two = second.undo(*one, known);
        if (!two || IsSame(*two, *one) || IsSame(*two, given)) continue;
        offer({*two, CostOf(first) + CostOf(second) + 0.1, {&first, &second}, "", ""});
      }
    }
    AddNumbers(i, X_ab_P, given, right, offer);
    return readings;
  }

  template <typename Offer>
  void AddNumbers(size_t i, const Pose& X_ab_P, const StatedPart& given, const StatedPart& right,
                  const Offer& offer) const {
    if (IsAxisRight(given, i, X_ab_P)) AddOffsets(i, X_ab_P, given, offer);
    StatedPart turned = given;
    turned.axis = given.X_PL.linear().transpose() * right.X_PL.linear() * right.axis;
    offer({turned,
           kNumber + 0.2,
           {},
           "number.axis",
           "another one, " + Format(turned.axis) + " would be right"});
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
    if (apart.cwiseAbs().maxCoeff() > few)
      numbers += static_cast<double>((angles.array().abs() > few).count());
    StatedPart placed = given;
    placed.X_PL = right.X_PL;
    offer({placed,
           std::min(kNumber * numbers, kUnexplained - 0.5),
           {},
           "number.place",
           "another one, [" + Format(right.X_PL.translation()) + "] with roll, pitch, yaw " +
               Format(CalcRollPitchYaw(right.X_PL.linear())) + " would be right"});
    placed.axis = right.axis;
    offer({placed,
           std::min(kNumber * (numbers + 1.0), kUnexplained - 0.4),
           {},
           "number.place",
           "another one, with its axis"});
  }

  [[nodiscard]] static std::string Format(const Vector3d& v) { return FormatNumbers(v + Vector3d::Zero()); }
  [[nodiscard]] static std::string DescribeOrigin(const StatedPart& part) {
    return "another one, " + Format(part.X_PL.translation()) + " would be right";
  }

  /// Another zero, or another place along the axis, by what of the link would then be in place.
  template <typename Offer>
  void AddOffsets(size_t i, const Pose& X_ab_P, const StatedPart& given, const Offer& offer) const {
    const Pose X_ab = given.X_PL.inverse() * X_ab_P * problem_.right[i].X_PL;
    const bool turns = problem_.given[i].is_revolute;
    const auto add = [&](const Vector3d& a, const Vector3d& b) {
      const double along = given.axis.dot(b - a);
      const double angle =
          std::atan2(given.axis.dot(a.cross(b)), a.dot(b) - given.axis.dot(a) * given.axis.dot(b));
      OfferOffset(given, turns ? angle : along, turns, offer);
      if (!turns || std::abs(along) <= problem_.close.tolerance * problem_.close.length) return;
      StatedPart moved = given;
      moved.X_PL = given.X_PL * Eigen::Translation3d(along * given.axis);
      offer({moved, kNumber, {}, "number.origin", DescribeOrigin(moved)});
    };
    add(problem_.given[i].body.com, X_ab * problem_.right[i].body.com);
    for (const size_t child : children_[i + 1]) {
      const Pose& X_a = problem_.given[child].X_PL;
      const Pose X_b = X_ab * problem_.right[child].X_PL;
      add(X_a.translation(), X_b.translation());
      if (turns) add(X_a.linear() * problem_.given[child].axis, X_b.linear() * problem_.right[child].axis);
    }
  }

  template <typename Offer>
  void OfferOffset(const StatedPart& given, double offset, bool turns, const Offer& offer) const {
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
      offer({part, common_.contains(words) ? kCommonConvention : kConvention, {}, kZero, words, angle});
    }
  }

  /// What stays wrong of what a link carries, when its frame of the other description stands so in its own.
  /// @param joint -1: the base.
  [[nodiscard]] double CostBehind(int joint, const Pose& X_ab, int depth) const {
    double cost = CostBody(static_cast<size_t>(joint + 1), X_ab);
    for (const size_t child : children_[static_cast<size_t>(joint + 1)])
      cost += CostRow(child, ToCarrier(child, X_ab), depth - 1);
    return cost;
  }

  [[nodiscard]] double CostRow(size_t i, const Pose& X_ab_P, int depth) const {
    double least = kUnexplained;
    const RowReading given = {StateRow(i), 0.0, {}, "", ""};
    if (IsAxisRight(given.part, i, X_ab_P)) {
      if (depth <= 0) return 0.0;
      least = std::min(least, CostBehind(static_cast<int>(i), Follow(given, i, X_ab_P), depth));
      if (least == 0.0) return least;
    }
    std::vector<RowReading> readings = ListReadings(i, X_ab_P, false);
    if (readings.empty()) readings = ListReadings(i, X_ab_P, true);
    for (const RowReading& reading : readings) {
      if (reading.cost >= least) continue;
      const double behind =
          depth > 0 ? CostBehind(static_cast<int>(i), Follow(reading, i, X_ab_P), depth) : 0.0;
      least = std::min(least, reading.cost + behind);
    }
    return least;
  }

  [[nodiscard]] double CostBody(size_t link, const Pose& X_ab) const {
    if (link == 0 && problem_.base_is_fixed) return 0.0;
    LinkBody body = PlaceBody(problem_, link, X_ab);
    if (!(body.given.body.mass > 0.0) || !(body.right.body.mass > 0.0)) return 0.0;
    if (IsRight(body, problem_.close)) return 0.0;
    double cost = 0.0;
    for (const Quantity quantity : kBodyQuantities) cost += CostQuantity(quantity, &body);
    return cost;
  }

  [[nodiscard]] double CostQuantity(Quantity quantity, LinkBody* body) const {
    if (IsRight(*body, quantity, problem_.close)) return 0.0;
    const BodyUndoing undoing(*body, problem_.close);
    for (const Convention& convention : ListConventions()) {
      if (convention.of != quantity) continue;
      std::optional<Undone> undone = undoing.Undo(convention);
      if (!undone) continue;
      *body = std::move(undone->body);
      return kConvention;
    }
    TakeFrom(body->right, quantity, &body->given);
    constexpr double kNumbers = 2.0;
    return quantity == Quantity::kMass ? kNumber : kNumbers;
  }

  const RowProblem& problem_;
  std::vector<std::vector<size_t>> children_;  // of the base, then of each joint
  std::set<std::string> common_;
};

}  // namespace

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

std::vector<RowFinding> SearchRows(const RowProblem& problem) { return RowSearch(problem).Run(); }

}  // namespace dexcheck
