#include "harness/checks/consistency.h"

#include <algorithm>
#include <chrono>

namespace dexcheck {

bool ConsistencyResult::Agrees() const {
  const auto good = [](const CheckRecord& record) { return !record.failed; };
  return std::all_of(constants.records.begin(), constants.records.end(), good) &&
         std::all_of(terms.begin(), terms.end(), good);
}

ConsistencyResult CheckConsistency(const Adapter& adapter, const ConsistencyOptions& options,
                                   const std::function<bool(long)>& progress) {
  const auto start = std::chrono::steady_clock::now();
  const RobotModel& model = adapter.model();
  ConsistencyResult result;
  result.constants = CheckConstants(adapter);

  ModelCheck check(adapter, options.make_view, options.object);
  StateSource source(model, options.range, options.seed);
  VectorXd q = VectorXd::Zero(model.num_positions());
  VectorXd xi = VectorXd::Zero(model.num_velocities());
  VectorXd w = VectorXd::Zero(model.num_velocities());
  Vector6d X_o = Vector6d::Zero();
  Vector6d X_o_dot = Vector6d::Zero();
  bool go_on = true;
  while (go_on && result.samples < options.samples) {
    const long sample = result.samples++;
    source.DrawPositions(&q);
    source.DrawVelocity(&xi);
    source.DrawVelocity(&w);
    if (model.object()) source.DrawObject(&X_o, &X_o_dot);
    check.Compare(q, xi, w, X_o, X_o_dot, sample);
    go_on = progress(result.samples);
  }
  result.terms.assign(check.records().begin(), check.records().end());
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace dexcheck
