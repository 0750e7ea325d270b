#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/common/text.h"
#include "harness/diagnosis/repair_trial.h"

namespace dexcheck {
namespace {

using ItemKind = PlacedItem::Kind;
using Kind = ParameterKind;
using Items = std::vector<int>;
using Parameters = std::vector<Parameter>;

constexpr int kMaxCauses = 12;

// Where nearly all is wrong, nearly all is suspect: pairs of far numbers would take for ever.
constexpr size_t kMostPaired = 30;

/// The middle one of three angles, which stays within a quarter turn.
bool IsPitch(const Parameter& parameter) { return IsRotation(parameter.kind) && parameter.component == 1; }

struct TriedRepair {
  Repair cause;
  double cost = 0.0;
};

class GeometryWalk {
 public:
  explicit GeometryWalk(const RepairTrial& trial)
      : trial_(trial),
        spec_(trial.written()),
        placement_(trial.placement()),
        left_(placement_.items().size()) {}

  std::vector<Repair> Run() {
    std::vector<Repair> causes;
    while (causes.size() < kMaxCauses) {
      failing_ = ListFailing();
      if (failing_.empty()) break;
      // Parents have smaller indices than children, so the smallest link has nothing misplaced before it.
      const auto is_nearer = [&](int a, int b) { return LinkOf(a) < LinkOf(b); };
      link_ = LinkOf(*std::min_element(failing_.begin(), failing_.end(), is_nearer));
      Repair cause;
      if (FindCause(&cause)) {
        Apply(cause, &spec_);
        // Two numbers that were solved for together may be two faults.
        for (Repair& part : SplitByVector(cause)) causes.push_back(std::move(part));
      } else {
        Leave();
      }
      placement_.Replace(spec_);
    }
    return causes;
  }

 private:
  [[nodiscard]] const PlacedItem& At(int item) const { return placement_.items()[static_cast<size_t>(item)]; }
  [[nodiscard]] int LinkOf(int item) const { return At(item).link; }
  [[nodiscard]] int ParentOf(int joint) const { return spec_.joints[static_cast<size_t>(joint)].parent; }

  [[nodiscard]] Items ListFailing() const {
    Items failing;
    for (size_t item = 0; item < left_.size(); ++item) {
      if (!left_[item] && placement_.Fails(static_cast<int>(item))) failing.push_back(static_cast<int>(item));
    }
    return failing;
  }

  /// Gives up what fails on the link; when nearly all is suspect, what the link carries too.
  void Leave() {
    const auto is_axis = [&](int item) { return LinkOf(item) == link_ && At(item).IsAxis(); };
    // What hangs on an axis that stays wrong cannot be put right, and its suspects grow with each link.
    const bool with_carried =
        num_suspects_ > kMostPaired && std::any_of(failing_.begin(), failing_.end(), is_axis);
    for (const int item : failing_) {
      if (LinkOf(item) == link_ || (with_carried && placement_.Carries(link_, LinkOf(item))))
        left_[static_cast<size_t>(item)] = true;
    }
  }

  /// Single numbers and changes of structure, then whole vectors, then two numbers of one place that hide
  /// each other.
  [[nodiscard]] bool FindCause(Repair* cause) {
    const Parameters suspects = ListSuspects();
    num_suspects_ = suspects.size();
    const std::vector<Items> targets = ListTargets();
    const double cost_before = CalcCost(0);
    candidates_.clear();
    const auto is_found = [&] {
      return std::any_of(candidates_.begin(), candidates_.end(),
                         [&](const TriedRepair& candidate) { return candidate.cost < cost_before; });
    };
    for (const Parameter& suspect : suspects) TryParameters({suspect}, targets);
    TryStructure();
    if (!is_found()) {
      for (Parameter parameter : suspects) {
        if (parameter.component != 2) continue;
        Parameters vector;
        for (parameter.component = 0; parameter.component < 3; ++parameter.component)
          vector.push_back(parameter);
        TryParameters(vector, targets);
      }
    }
    if (!is_found()) {
      const Parameters near = ListNear(suspects);
      for (size_t i = 0; i < near.size(); ++i) {
        for (size_t j = i + 1; j < near.size(); ++j) TryParameters({near[i], near[j]}, {targets[0]});
      }
    }
    if (!is_found()) return false;
    return Choose(cause);
  }

  /// The likeliest of those that cost least, with the others.
  [[nodiscard]] bool Choose(Repair* cause) {
    const double least =
        std::min_element(candidates_.begin(), candidates_.end(), [](const auto& a, const auto& b) {
          return a.cost < b.cost;
        })->cost;
    std::vector<Repair> equal;
    for (const TriedRepair& candidate : candidates_) {
      // Angles that were reached through a pole do not come out as they went in.
      if (candidate.cost == least && CalcCostAfter(candidate.cause) == least)
        equal.push_back(candidate.cause);
    }
    if (equal.empty()) return false;
    if (equal.size() > 1) KeepByForces(&equal);
    std::stable_sort(equal.begin(), equal.end(),
                     [&](const Repair& a, const Repair& b) { return IsLikelier(a, b, spec_); });
    *cause = equal.front();
    cause->equivalents.assign(equal.begin() + 1, equal.end());
    return true;
  }

  /// Of repairs that place everything alike, those after which the forces agree best.
  void KeepByForces(std::vector<Repair>* equal) const {
    std::vector<double> errors;
    for (const Repair& one : *equal) {
      RobotSpec repaired = spec_;
      Apply(one, &repaired);
      const std::optional<RobotModel> model = trial_.setup().TryModel(repaired);
      errors.push_back(model ? trial_.evidence().CalcForceResidual(*model).norm()
                             : std::numeric_limits<double>::infinity());
    }
    constexpr double kSame = 1.0 + 1e-6;
    const double most =
        *std::min_element(errors.begin(), errors.end()) * kSame + trial_.evidence().Widen(1e-9);
    for (size_t i = errors.size(); i-- > 0;) {
      if (errors[i] > most) equal->erase(equal->begin() + static_cast<std::ptrdiff_t>(i));
    }
  }

  [[nodiscard]] Parameters ListSuspects() {
    Parameters suspects;
    const auto add = [&](Kind kind, int index, int components) {
      for (int k = 0; k < components; ++k) {
        const Parameter parameter{kind, index, k};
        if (KeepsWhatIsRight(parameter)) suspects.push_back(parameter);
      }
    };
    for (int joint = link_; joint >= 0; joint = ParentOf(joint)) {
      if (!trial_.setup().terms.IsPlain(joint)) {
        for (const Kind kind : {Kind::kAlpha, Kind::kA, Kind::kHomeAngle, Kind::kD}) add(kind, joint, 1);
      }
      for (const Kind kind : {Kind::kPosition, Kind::kRotation}) add(kind, joint, 3);
    }
    if (spec_.base.type != BaseType::kFloating) add(Kind::kBasePosition, -1, 3);
    if (spec_.base.type == BaseType::kFixed) add(Kind::kBaseRotation, -1, 3);
    for (const int item : failing_) {
      if (LinkOf(item) != link_) continue;
      if (At(item).kind == ItemKind::kFramePosition) add(Kind::kFramePosition, At(item).index, 3);
      if (At(item).kind == ItemKind::kFrameRotation) add(Kind::kFrameRotation, At(item).index, 3);
    }
    return suspects;
  }

  /// Suspects among which pairs are tried: all, or when they are many, those of the link itself.
  [[nodiscard]] Parameters ListNear(Parameters suspects) const {
    if (suspects.size() > kMostPaired)
      std::erase_if(suspects, [&](const Parameter& suspect) { return CarrierOf(spec_, suspect) != link_; });
    return suspects;
  }

  /// Whether a change of the number moves nothing that stands right.
  [[nodiscard]] bool KeepsWhatIsRight(const Parameter& parameter) {
    constexpr double kOffset = 1e-3;  // rad or m
    const int carrier = CarrierOf(spec_, parameter);
    Items right;
    for (int item = 0; item < static_cast<int>(left_.size()); ++item) {
      if ((carrier < 0 || placement_.Carries(carrier, LinkOf(item))) && !placement_.Fails(item))
        right.push_back(item);
    }
    placement_.Set(parameter, GetValue(spec_, parameter) + kOffset);
    const bool keeps =
        std::none_of(right.begin(), right.end(), [&](int item) { return placement_.Fails(item); });
    placement_.Replace(spec_);
    return keeps;
  }

  /// All that fails on the link and the axes that it carries; the same without bodies; then each by itself,
  /// since another error may spoil the others.
  [[nodiscard]] std::vector<Items> ListTargets() const {
    Items near;
    Items without_bodies;
    for (const int item : failing_) {
      const bool is_carried = At(item).IsAxis() && ParentOf(At(item).index) == link_;
      if (LinkOf(item) != link_ && !is_carried) continue;
      near.push_back(item);
      if (!At(item).IsBody()) without_bodies.push_back(item);
    }
    std::vector<Items> targets = {near};
    if (near.size() == 1) return targets;
    if (!without_bodies.empty() && without_bodies.size() < near.size()) targets.push_back(without_bodies);
    for (const int item : near) targets.push_back({item});
    return targets;
  }

  /// Sets the trial's numbers so that the items stand right, by Gauss-Newton steps from `values`.
  [[nodiscard]] bool Solve(const Parameters& parameters, const Items& target, std::vector<double> values) {
    constexpr int kMaxIterations = 30;
    constexpr double kStep = 1e-6;
    constexpr double kConverged = 1e-14;
    constexpr double kExplained = 1e-3;                 // of the residual, by a step
    constexpr double kFar = 10.0;                       // of the robot's size: no length is that long
    constexpr double kLongestTurn = 0.7;                // rad; where the linearisation means something
    constexpr double kMovesNothing = 1e-9;              // of the target
    const double zero = trial_.evidence().Widen(1e-9);  // far above rounding, far below any fault
    const double longest = kFar * trial_.evidence().length();
    for (size_t i = 0; i < parameters.size(); ++i) placement_.Set(parameters[i], values[i]);
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      const VectorXd residual = placement_.CalcResidual(target);
      MatrixXd slope(residual.size(), static_cast<Eigen::Index>(parameters.size()));
      for (size_t i = 0; i < parameters.size(); ++i) {
        placement_.Set(parameters[i], values[i] + kStep);
        const VectorXd above = placement_.CalcResidual(target);
        placement_.Set(parameters[i], values[i] - kStep);
        slope.col(static_cast<Eigen::Index>(i)) = (above - placement_.CalcResidual(target)) / (2.0 * kStep);
        placement_.Set(parameters[i], values[i]);
      }
      if (slope.colwise().norm().minCoeff() < kMovesNothing) return false;
      VectorXd step = -slope.colPivHouseholderQr().solve(residual);
      // Where the residual is least and not zero, a step explains next to nothing of it.
      const bool is_zero = residual.cwiseAbs().maxCoeff() < zero;
      if (!is_zero && (slope * step).norm() < kExplained * residual.norm()) return false;
      for (size_t i = 0; i < parameters.size(); ++i) {
        const bool turns = IsRotation(parameters[i].kind);
        double& change = step[static_cast<Eigen::Index>(i)];
        if (turns) change = std::clamp(change, -kLongestTurn, kLongestTurn);
        values[i] += change;
        if (!turns && std::abs(values[i]) > longest) return false;
        if (IsPitch(parameters[i]) && std::abs(values[i]) >= 0.5 * kPi) return false;
        placement_.Set(parameters[i], values[i]);
      }
      if (step.cwiseAbs().maxCoeff() < kConverged) break;
    }
    return std::none_of(target.begin(), target.end(), [&](int item) { return placement_.Fails(item); });
  }

  [[nodiscard]] int CountWrongOnLink() const {
    int wrong = 0;
    for (int item = 0; item < static_cast<int>(left_.size()); ++item)
      wrong += LinkOf(item) == link_ ? placement_.CountWrongNumbers(item) : 0;
    return wrong;
  }

  [[nodiscard]] double CalcCost(size_t changes) const {
    auto cost = static_cast<double>(changes);
    for (int item = 0; item < static_cast<int>(left_.size()); ++item)
      cost += placement_.CountWrongNumbers(item);
    return cost;
  }

  [[nodiscard]] double CalcCostAfter(const Repair& cause) {
    RobotSpec changed = spec_;
    Apply(cause, &changed);
    placement_.Replace(changed);
    const double cost = CalcCost(std::max(cause.values.size(), size_t{1}));
    placement_.Replace(spec_);
    return cost;
  }

  /// The numbers that put the most right, solved for from where they are and from quarter turns.
  void TryParameters(const Parameters& parameters, const std::vector<Items>& targets) {
    const bool turns = std::any_of(parameters.begin(), parameters.end(),
                                   [](const Parameter& parameter) { return IsRotation(parameter.kind); });
    std::vector<double> turned = {0.0};
    if (turns) turned.insert(turned.end(), {0.5 * kPi, -0.5 * kPi, kPi});
    const int wrong_before = CountWrongOnLink();
    TriedRepair best;
    const auto is_found = [&] { return !best.cause.parameters.empty(); };
    const auto attempt = [&](const Items& target, double turn) {
      std::vector<double> start;
      for (const Parameter& parameter : parameters) {
        const bool is_turned = IsRotation(parameter.kind) && !IsPitch(parameter);
        start.push_back(GetValue(spec_, parameter) + (is_turned ? turn : 0.0));
      }
      if (!Solve(parameters, target, start) || CountWrongOnLink() >= wrong_before) return false;
      const double cost = CalcCost(parameters.size());
      if (is_found() && cost >= best.cost) return true;
      best = {{}, cost};
      best.cause.parameters = parameters;
      for (const Parameter& parameter : parameters)
        best.cause.values.push_back(GetValue(placement_.trial(), parameter));
      return true;
    };
    for (const Items& target : targets) {
      static_cast<void>(
          std::any_of(turned.begin(), turned.end(), [&](double turn) { return attempt(target, turn); }));
      if (is_found() && best.cost <= static_cast<double>(parameters.size())) break;
    }
    placement_.Replace(spec_);
    if (!is_found()) return;
    for (size_t i = 0; i < parameters.size(); ++i) {
      double& value = best.cause.values[i];
      if (IsRotation(parameters[i].kind)) value = std::remainder(value, 2.0 * kPi);
      value = RoundWithin(spec_, parameters[i], value, trial_.evidence().CalcSolvedDigits());
    }
    candidates_.push_back(std::move(best));
  }

  /// The engine's axis, as two numbers, in the place of the one that a plain row says.
  void TryAxis() {
    const auto i = static_cast<size_t>(link_);
    const Pose X_WL = placement_.PoseOf(ParentOf(link_)) * spec_.joints[i].X_PB;  // with the joint at zero
    Vector3d axis = X_WL.linear().transpose() * trial_.evidence().samples()[0].axes[i];
    constexpr double kRounding = 1e-14;
    for (double& entry : axis) entry = std::abs(entry) < kRounding ? 0.0 : entry;
    const Vector3d z = trial_.setup().terms.OwnFrame(link_).linear() * axis;
    TriedRepair tried;
    tried.cause.kind = RepairKind::kAxisTurned;
    tried.cause.joint = link_;
    tried.cause.values = {std::atan2(z.x(), -z.y()), std::atan2(std::hypot(z.x(), z.y()), z.z())};
    tried.cause.note = FormatNumbers(axis);
    tried.cost = CalcCostAfter(tried.cause);
    candidates_.push_back(std::move(tried));
  }

  void TryStructure() {
    const auto attempt = [&](RepairKind kind, int joint, int other) {
      TriedRepair candidate;
      candidate.cause.kind = kind;
      candidate.cause.joint = joint;
      candidate.cause.other = other;
      candidate.cause.is_plain = trial_.setup().terms.IsPlain(joint);
      candidate.cost = CalcCostAfter(candidate.cause);
      candidates_.push_back(std::move(candidate));
    };
    if (link_ < 0) return;
    if (trial_.setup().terms.IsPlain(link_)) TryAxis();
    const int parent = ParentOf(link_);
    attempt(RepairKind::kAxisReversed, link_, -1);
    if (parent >= 0) attempt(RepairKind::kAxisReversed, parent, -1);
    for (int other = 0; other < static_cast<int>(spec_.joints.size()); ++other) {
      const int above = ParentOf(other);
      if (other == link_ || (above != link_ && above != parent)) continue;
      const bool is_plain = trial_.setup().terms.IsPlain(link_) && trial_.setup().terms.IsPlain(other);
      if (!is_plain) attempt(RepairKind::kRowsSwapped, std::min(link_, other), std::max(link_, other));
      if (above == parent || is_plain)
        attempt(RepairKind::kPosesSwapped, std::min(link_, other), std::max(link_, other));
    }
  }

  const RepairTrial& trial_;
  RobotSpec spec_;
  Placement placement_;
  std::vector<bool> left_;   // items that no geometry explains
  Items failing_;            // of the others
  int link_ = -1;            // the first of them
  size_t num_suspects_ = 0;  // there
  std::vector<TriedRepair> candidates_;
};

}  // namespace

std::vector<Repair> WalkGeometry(const RepairTrial& trial) { return GeometryWalk(trial).Run(); }

}  // namespace dexcheck
