#include <algorithm>
#include <functional>
#include <map>

#include "harness/descriptions/fault_search.h"

namespace dexcheck {
namespace {

constexpr double kSameCost = 1e-9;

class RowSearch {
 public:
  explicit RowSearch(const RowProblem& problem) : problem_(problem), reader_(problem) {}

  std::vector<RowFinding> Run() {
    std::vector<RowFinding> findings = Read();
    if (IsExplainedByOne(findings)) return findings;
    std::vector<RowFinding> alike = ReadAlike(findings);
    return alike.empty() ? findings : alike;
  }

 private:
  static bool IsExplainedByOne(const std::vector<RowFinding>& findings) {
    return std::ranges::count_if(findings, [](const RowFinding& finding) {
             return !finding.is_placed || !finding.readings.empty();
           }) <= 1;
  }

  /// One reading of all rows; none of those that it is not about.
  using Change =
      std::function<std::optional<RowReading>(size_t row, const StatedPart& given, const StatedPart& right)>;

  [[nodiscard]] std::vector<Change> ListChanges(const std::vector<RowFinding>& findings) const {
    std::vector<Change> changes;
    for (const Convention& convention : ListConventions()) {
      if (!IsOfRow(convention.of)) continue;
      changes.push_back(
          [&](size_t, const StatedPart& given, const StatedPart& right) -> std::optional<RowReading> {
            const std::optional<StatedPart> undone = convention.undo(given, right);
            if (!undone) return std::nullopt;
            return RowReading{*undone, kConvention, {&convention}, "", ""};
          });
    }
    // Of all joints that turn, or of all that slide.
    std::map<std::string, std::pair<double, bool>> offsets;
    for (size_t i = 1; i < findings.size(); ++i) {
      for (const RowReading& reading : findings[i].readings) {
        if (reading.number == kZero)
          offsets[reading.words] = {reading.offset, problem_.given[i - 1].is_revolute};
      }
    }
    for (const auto& [words, offset] : offsets) {
      changes.push_back([this, words = words, by = offset.first, turns = offset.second](
                            size_t row, StatedPart given, const StatedPart&) -> std::optional<RowReading> {
        if (problem_.given[row].is_revolute != turns) return std::nullopt;
        given.X_PL = given.X_PL * (turns ? Pose(Eigen::AngleAxisd(by, given.axis))
                                         : Pose(Eigen::Translation3d(by * given.axis)));
        return RowReading{given, kConvention, {}, kZero, words, by};
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
    std::vector<RowFinding> findings(problem_.bodies.size());
    findings[0].X_ab = problem_.X_W0_given.inverse() * problem_.X_W0_right;
    findings[0].is_placed = true;
    for (size_t i = 0; i < problem_.given.size(); ++i) {
      const Pose X_ab_P =
          reader_.ToCarrier(i, findings[static_cast<size_t>(problem_.given[i].parent + 1)].X_ab);
      RowReading reading{reader_.StateRow(i), 0.0, {}, "", ""};
      std::optional<RowReading> changed = change(i, reading.part, reader_.StateRight(i, X_ab_P));
      const bool changes = changed && !reader_.IsSame(changed->part, reading.part);
      if (changes) reading = std::move(*changed);
      if (!IsAxisRight(problem_, i, reading.part, X_ab_P)) return {};
      findings[i + 1].X_ab = Follow(reading, i, X_ab_P);
      findings[i + 1].is_placed = true;
      if (changes) findings[i + 1].readings.push_back(std::move(reading));
    }
    return findings;
  }

  [[nodiscard]] std::vector<RowFinding> Read() const {
    std::vector<RowFinding> findings(problem_.bodies.size());
    ReadBase(&findings[0]);
    for (size_t i = 0; i < problem_.given.size(); ++i) {
      const RowFinding& parent = findings[static_cast<size_t>(problem_.given[i].parent + 1)];
      if (parent.is_placed) ReadRow(i, reader_.ToCarrier(i, parent.X_ab), &findings[i + 1]);
    }
    return findings;
  }

  // The base, of which no axis tells where it stands.

  void ReadBase(RowFinding* finding) const {
    StatedPart given;
    given.X_PL = problem_.X_W0_given;
    StatedPart right;
    right.X_PL = problem_.X_W0_right;
    std::vector<RowReading> readings = {{given, 0.0, {}, "", ""}};
    if (problem_.base_is_fixed) {
      for (const Convention& convention : ListMountings()) {
        const std::optional<StatedPart> undone = convention.undo(given, right);
        if (undone && !reader_.IsSame(*undone, given))
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

  void ReadRow(size_t i, const Pose& X_ab_P, RowFinding* finding) const {
    constexpr int kDepth = 2;
    std::vector<RowReading> readings = reader_.ListReadings(i, X_ab_P, false);
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
      readings = reader_.ListReadings(i, X_ab_P, true);
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
    const double least = std::ranges::min_element(readings, cheaper)->cost;
    std::erase_if(readings, [&](const RowReading& reading) { return reading.cost > least + kSameCost; });
    // Another place is what any of the others is.
    const auto is_place = [](const RowReading& reading) { return reading.number == "number.place"; };
    if (!std::ranges::all_of(readings, is_place)) std::erase_if(readings, is_place);
    finding->X_ab = readings[0].part.X_PL.inverse() * X_PR;
    finding->is_placed = true;
    const bool is_right = readings[0].conventions.empty() && readings[0].number.empty();
    (is_right ? finding->elsewhere : finding->readings) = std::move(readings);
  }

  [[nodiscard]] Pose Follow(const RowReading& reading, size_t i, const Pose& X_ab_P) const {
    return reading.part.X_PL.inverse() * X_ab_P * problem_.right[i].X_PL;
  }

  /// What stays wrong of what a link carries, when its frame of the other description stands so in its own.
  /// @param joint -1: the base.
  [[nodiscard]] double CostBehind(int joint, const Pose& X_ab, int depth) const {
    double cost = CostBody(static_cast<size_t>(joint + 1), X_ab);
    for (const size_t child : reader_.ListChildren(joint))
      cost += CostRow(child, reader_.ToCarrier(child, X_ab), depth - 1);
    return cost;
  }

  [[nodiscard]] double CostRow(size_t i, const Pose& X_ab_P, int depth) const {
    double least = kUnexplained;
    const RowReading given = {reader_.StateRow(i), 0.0, {}, "", ""};
    if (IsAxisRight(problem_, i, given.part, X_ab_P)) {
      if (depth <= 0) return 0.0;
      least = std::min(least, CostBehind(static_cast<int>(i), Follow(given, i, X_ab_P), depth));
      if (least == 0.0) return least;
    }
    for (const RowReading& reading : reader_.ListReadings(i, X_ab_P, false)) {
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
  RowReader reader_;
};

}  // namespace

std::vector<RowFinding> SearchRows(const RowProblem& problem) { return RowSearch(problem).Run(); }

}  // namespace dexcheck
