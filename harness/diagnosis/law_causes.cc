#include <algorithm>
#include <cmath>

#include "controller/dynamics/tree_factor.h"
#include "harness/diagnosis/run_causes.h"
#include "harness/diagnosis/telling.h"

namespace dexcheck {
namespace {

using Eigen::Index;

// Summands agree with what a wrong law has of them to this fraction: it is computed from the same numbers.
constexpr double kLawAccuracy = 1e-6;
// What is left over may be this many times the noise and is explained all the same.
constexpr double kMostLeft = 30.0;
constexpr Index kMostLawSteps = 20;   // that are looked at
constexpr double kPlausible = 300.0;  // of factors, which are units mistaken at the most
constexpr double kZero = 1e-6;        // a factor nearer to zero than this is one of a part that is missing

/// Entries of tau' that belong together.
struct Place {
  std::string name;
  std::vector<Index> entries;
  bool is_balanced = false;  ///< Whether the ground is asked to balance what the base has of it.
};

std::vector<Place> ListPlaces(const StepStore& store) {
  const Setup& setup = store.setup();
  const RobotModel& model = setup.model();
  const int offset = model.num_base_velocities();
  std::vector<Place> places = {{"law", {}}};
  for (Index i = 0; i < model.num_velocities(); ++i) places.front().entries.push_back(i);
  // Of a robot that stands the law may be wrong before the ground's forces are taken off, or after.
  if (model.base().type == BaseType::kFloating) places.push_back({"law", {}, true});
  std::vector<bool> carries(static_cast<size_t>(model.num_joints()), false);
  for (const int joint : setup.hold().arm_joints) carries[static_cast<size_t>(joint)] = true;
  for (const int tip : setup.fingertips()) {
    const Frame& frame = model.frames()[static_cast<size_t>(tip)];
    Place finger{"law of the finger of " + frame.name, {}};
    for (int joint = frame.link; joint >= 0; joint = model.joints()[static_cast<size_t>(joint)].parent)
      if (!carries[static_cast<size_t>(joint)]) finger.entries.push_back(offset + model.dof(joint));
    if (finger.entries.size() > 1) places.push_back(finger);
  }
  for (Index i = 0; i < model.num_velocities(); ++i)
    places.push_back(
        {"law of " + store.motors()[static_cast<size_t>(i)].place.substr(sizeof("motor ") - 1), {i}});
  return places;
}

/// A sum of which all but one summand vanish, and friction that the law has anyway, are no candidates besides
/// those. @param parts of each candidate, bits by summand; 0 for what is added.
void DropRepeated(std::vector<unsigned>* parts_of, std::vector<Candidate>* candidates) {
  std::vector<unsigned>& parts = *parts_of;
  const auto repeats = [&](size_t i, size_t of) {
    const Candidate &a = (*candidates)[of], &b = (*candidates)[i];
    const bool is_sum = parts[of] != 0 && (parts[i] & parts[of]) == parts[of];
    const bool is_friction = b.fault == "viscous friction" && a.fault.starts_with("friction");
    if (a.place != b.place || !(is_sum || is_friction)) return false;
    constexpr double kSame = 1e-10;
    const double product = a.columns.col(0).dot(b.columns.col(0));
    return product * product > (1.0 - kSame) * a.columns.squaredNorm() * b.columns.squaredNorm();
  };
  std::vector<size_t> kept;
  for (size_t i = 0; i < candidates->size(); ++i) {
    if (!((*candidates)[i].columns.squaredNorm() > 0.0)) continue;
    if (std::none_of(kept.begin(), kept.end(), [&](size_t of) { return repeats(i, of); })) kept.push_back(i);
  }
  for (size_t k = 0; k < kept.size(); ++k) {
    if (kept[k] == k) continue;
    (*candidates)[k] = std::move((*candidates)[kept[k]]);
    parts[k] = parts[kept[k]];
  }
  candidates->resize(kept.size());
  parts.resize(kept.size());
}

/// Factors of parts of the law, of which several may act on one torque: all torques' and one joint's, that of
/// a sum and that of one of its summands.
class LawFactors {
 public:
  LawFactors(std::span<const LawPartName> names, const std::vector<unsigned>& parts,
             std::span<const Candidate> candidates)
      : names_(names), parts_(parts), candidates_(candidates) {}

  /// A factor that several have in common is no alternative to one of them.
  void DropAlternatives(CauseSelection* selection) const {
    for (CauseTerm& term : selection->terms) {
      std::erase_if(term.same, [&](const auto& same) {
        return std::ranges::any_of(selection->terms, [&](const CauseTerm& other) {
          return &other != &term &&
                 (Holds(other.candidate, same.first) || Holds(same.first, other.candidate));
        });
      });
    }
  }

  /// The candidate's whole factor, and what it is of: what others of the selection have of it apart is
  /// theirs.
  void MakeWhole(const Candidate& one, const CauseSelection& selection, Fault* fault) const {
    const auto index = static_cast<size_t>(&one - candidates_.data());
    unsigned rest = parts_[index];
    std::string joints;
    for (const CauseTerm& term : selection.terms) {
      const size_t other = term.candidate;
      if (other == index) continue;
      if (Holds(other, index)) fault->value += term.amplitude[0];
      if (!Holds(index, other)) continue;
      const Candidate& apart = candidates_[other];
      if (apart.place == one.place) {
        rest &= ~parts_[other];
      } else if (parts_[other] == parts_[index]) {
        joints += (joints.empty() ? "" : ", ") + apart.place.substr(kOf.size());
      } else {
        fault->detail += (fault->detail.empty() ? "but for " : ", ") + apart.place + ": " + apart.fault;
      }
    }
    if (!joints.empty()) fault->place += " of all but " + joints;
    const auto name = std::ranges::find(names_, rest, &LawPartName::parts);
    if (rest != parts_[index] && name != names_.end()) fault->fault = NameFactor(*name);
    if (std::abs(fault->value) < kZero) fault->value = 0.0;
  }

  static std::string NameFactor(const LawPartName& name) {
    return std::string(name.name) + " (" + name.symbol + "), factor";
  }

 private:
  static constexpr std::string_view kAll = "law", kOf = "law of ";
  /// Whether one factor acts on all that the other one acts on.
  [[nodiscard]] bool Holds(size_t one, size_t other) const {
    const bool is_there =
        candidates_[one].place == candidates_[other].place || candidates_[one].place == kAll;
    return one != other && is_there && parts_[other] != 0 && (parts_[other] & parts_[one]) == parts_[other];
  }

  std::span<const LawPartName> names_;
  const std::vector<unsigned>& parts_;
  std::span<const Candidate> candidates_;
};

}  // namespace

Causes ExplainLaw(const StepStore& store) {
  Causes causes;
  if (store.size() == 0 || store.law() == nullptr) return causes;
  const auto noise = store.Get(StepStore::kLawNoise);
  std::vector<Index> steps;
  for (Index i = 0; i < store.size(); ++i)
    if (noise(0, i) > 0.0) steps.push_back(i);
  if (steps.empty()) return causes;
  const auto count = static_cast<Index>(steps.size());
  const Index used = std::min(count, kMostLawSteps);

  const RobotModel& model = store.setup().model();
  const Index n = model.num_velocities();
  const ActuationMap actuation(model);
  ModelTerms terms(model);
  TreeFactor factor(model);
  const std::vector<Place> places = ListPlaces(store);
  const std::span<const LawPartName> names = store.law()->ListParts();
  std::vector<Candidate> candidates;
  std::vector<unsigned> parts_of;
  const auto add = [&](const std::string& fault, const std::string& place, double nominal,
                       unsigned parts) -> Candidate& {
    parts_of.push_back(parts);
    candidates.push_back(
        {.fault = fault, .place = place, .nominal = nominal, .columns = MatrixXd::Zero(n * used, 1)});
    if (nominal != 0.0) candidates.back().scale = VectorXd::Constant(1, kPlausible);
    return candidates.back();
  };
  for (const LawPartName& name : names)
    for (const Place& place : places) add(LawFactors::NameFactor(name), place.name, 1.0, name.parts);
  for (const std::string& gain : store.law()->gains())
    add("gain " + gain + ", factor", places.front().name, 1.0, 0);
  // What a controller of another's may add.
  for (Index i = 0; i < n; ++i) {
    for (const char* fault : {"torque", "viscous friction", "dry friction"}) {
      Candidate& one = add(fault, places[places.size() - static_cast<size_t>(n - i)].name, 0.0, 0);
      one.unit = store.motors()[static_cast<size_t>(i)].unit;
      if (std::string_view(fault) != "torque")
        one.is_possible = [](const VectorXd& a) { return a[0] >= 0.0; };
    }
  }
  VectorXd y(n * used);
  for (Index k = 0; k < used; ++k) {
    const Index step = steps[static_cast<size_t>(used == 1 ? 0 : k * (count - 1) / (used - 1))];
    const VectorXd reading = store.Get(StepStore::kReading).col(step);
    terms.SetState(reading.head(model.num_positions()), reading.segment(model.num_positions(), n));
    terms.CalcDynamics();
    factor.Compute(terms.M());
    const auto whiten = [&](VectorXd f) {
      factor.SolveTransposed(f);
      // The bound is one of the norm.
      return VectorXd(f * (std::sqrt(static_cast<double>(n)) / noise(0, step)));
    };
    y.segment(k * n, n) = whiten(store.Get(StepStore::kLawDifference).col(step));
    const VectorXd flat = store.Get(StepStore::kLawParts).col(step);
    const MatrixXd parts = flat.reshaped(n, store.law()->CountColumns());
    size_t candidate = 0;
    for (const LawPartName& name : names) {
      VectorXd sum = VectorXd::Zero(n);
      for (Index i = 0; i < store.law()->CountParts(); ++i)
        if ((name.parts >> i & 1U) != 0) sum += parts.col(i);
      VectorXd tau(n);
      actuation.CalcTorque(sum, tau);
      for (const Place& place : places) {
        VectorXd own = VectorXd::Zero(n);
        for (const Index entry : place.entries) own[entry] = tau[entry];
        actuation.CalcForce(own, own);
        if (place.is_balanced) own = sum;
        candidates[candidate++].columns.col(0).segment(k * n, n) = whiten(own);
      }
    }
    for (Index i = store.law()->CountParts(); i < parts.cols(); ++i)
      candidates[candidate++].columns.col(0).segment(k * n, n) = whiten(parts.col(i));
    for (Index i = 0; i < n; ++i) {
      VectorXd own(n);
      actuation.CalcForce(VectorXd::Unit(n, i), own);
      own = whiten(own);
      const double rate = terms.velocity()[i];
      for (const double size : {1.0, -rate, rate > 0.0 ? -1.0 : rate < 0.0 ? 1.0 : 0.0})
        candidates[candidate++].columns.col(0).segment(k * n, n) = size * own;
    }
  }
  DropRepeated(&parts_of, &candidates);
  const double floor = 1.0 + kLawAccuracy * kLawAccuracy * y.squaredNorm() / static_cast<double>(y.size());
  CauseSelection selection = SelectCauses(y, candidates, {.most_terms = 4, .restarts = 0, .floor = floor});
  const LawFactors factors(names, parts_of, candidates);
  factors.DropAlternatives(&selection);
  causes = TellSelection(StartExplanation(store, CauseChannel::kLaw, steps), selection, candidates,
                         [&](const Candidate& one, const VectorXd& amplitude, const VectorXd& error) {
                           Fault fault = TellNumber(one, amplitude, error);
                           if (one.nominal != 0.0) factors.MakeWhole(one, selection, &fault);
                           return fault;
                         });
  if (selection.left <= kMostLeft * std::sqrt(floor)) return causes;
  // The nearest stands for all.
  causes.resize(1, StartExplanation(store, CauseChannel::kLaw, steps));
  causes.front().outcome = CauseOutcome::kNotExplained;
  causes.front().faults.resize(std::min<size_t>(causes.front().faults.size(), 1));
  causes.front().rival.clear();
  causes.front().fraction = selection.fraction;
  causes.front().left = selection.left;
  return causes;
}

}  // namespace dexcheck
