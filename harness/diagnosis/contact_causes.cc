#include <numeric>

#include "controller/common/text.h"
#include "harness/diagnosis/run_causes.h"
#include "harness/diagnosis/telling.h"

namespace dexcheck {
namespace {

using Eigen::Index;

// Rounding of a distance, m, and of how the nearest point moves when a radius changes. A mismatch that is
// hardly more says nothing.
constexpr double kDistanceNoise = 1e-14, kFaintest = 1e-12;
constexpr double kRadiusAccuracy = 1e-4;
// The residual may be this fraction of what there was.
constexpr double kExplainsDistance = 0.99;

/// A body whose contacts come nearer by d when it is larger by d: a fingertip, or the object for all of them.
std::vector<Candidate> ListShapes(const Setup& setup, Index tips, Index steps, double noise) {
  std::vector<Candidate> candidates;
  for (Index i = 0; i < tips; ++i) {
    const int tip = setup.fingertips()[static_cast<size_t>(i)];
    MatrixXd column = MatrixXd::Zero(tips, steps);
    column.row(i).setConstant(-1.0 / noise);
    candidates.push_back({.fault = "radius",
                          .place = "fingertip " + setup.model().frames()[static_cast<size_t>(tip)].name,
                          .unit = "m",
                          .nominal = setup.model().tip_radius(tip),
                          .columns = column.reshaped()});
  }
  candidates.push_back({.fault = "surface further out by",
                        .place = "object " + setup.object().name,
                        .unit = "m",
                        .columns = VectorXd::Constant(tips * steps, -1.0 / noise)});
  return candidates;
}

}  // namespace

Causes ExplainGeometry(const StepStore& store) {
  constexpr double kRounding = 1e-10;  // m and rad
  Causes causes;
  for (const StepStore::Misplaced& one : store.misplaced()) {
    // A wheel of another size stands higher or lower, too.
    const bool is_wheel = one.place.starts_with("wheel ");
    if (is_wheel && one.offset.head<2>().norm() <= kRounding && one.turn <= kRounding) continue;
    const double offset = one.offset.norm(), turn = RadToDeg(one.turn);
    const std::string on = " on " + one.parent;
    Explanation& cause = causes.emplace_back();
    cause.channel = CauseChannel::kGeometry;
    cause.from = one.from;
    cause.fraction = 1.0;
    Fault fault{"turned" + on + " by", one.place, turn, 0.0, "deg", ""};
    if (offset > kRounding) {
      fault.fault = "off its place" + on + " by";
      fault.value = offset, fault.unit = "m",
      fault.detail = FormatVector((one.offset.array().abs() > kRounding).select(one.offset, 0.0), 4);
      if (one.turn > kRounding) fault.detail += " and turned by " + FormatNumber(turn, 4) + " deg";
    }
    if (one.axis_turn > 0.0) {
      const mjModel& engine = store.setup().engine();
      const std::string joint = NameOf(engine, mjOBJ_JOINT, engine.body_jntadr[one.body]);
      fault = {"axis turned by", "joint " + joint, RadToDeg(one.axis_turn), 0.0, "deg", ""};
    }
    cause.faults.push_back(fault);
  }
  return causes;
}

Causes ExplainContacts(const StepStore& store) {
  const auto mismatch = store.Get(StepStore::kContactMismatch);
  if (mismatch.size() == 0 || !(mismatch.cwiseAbs().maxCoeff() > kFaintest)) return {};
  const double size = mismatch.cwiseAbs().maxCoeff();
  const double noise = kDistanceNoise + kRadiusAccuracy * size;
  const std::vector<Candidate> candidates =
      ListShapes(store.setup(), mismatch.rows(), mismatch.cols(), noise);
  const VectorXd y = (mismatch / noise).reshaped();
  const CauseSelection selection =
      SelectCauses(y, candidates, {.noise_block_size = static_cast<double>(mismatch.cols())});
  std::vector<Index> steps(static_cast<size_t>(mismatch.cols()));
  std::iota(steps.begin(), steps.end(), 0);
  return DescribeSelection(StartExplanation(store, CauseChannel::kContact, steps), selection, candidates,
                           DescribeNumber, selection.left <= 1.0 || selection.fraction >= kExplainsDistance);
}

}  // namespace dexcheck
