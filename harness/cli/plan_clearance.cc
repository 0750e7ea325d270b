#include "harness/cli/plan_clearance.h"

#include <algorithm>

#include "harness/engine/engine.h"

namespace dexcheck::cli {

std::array<PlanClearance, kPairClassCount> FindPlanClearance(const RobotModel& model,
                                                             const std::filesystem::path& mjcf,
                                                             const Pose& X_Bo, const VectorXd& q,
                                                             const VectorXd& q_open) {
  const MjModelPtr engine = LoadMjcf(mjcf);
  const Adapter adapter(model, *engine, mjcf.string());
  const Solids solids = ListSolids(*engine);
  const std::vector<WatchedPair> pairs = ListWatchedPairs(*engine, adapter, solids, {}, mjcf.string());
  const MjDataPtr data = MakeData(*engine);
  if (const int body = adapter.object_body(); body >= 0 && engine->body_jntnum[body] == 1) {
    mjtNum* const place = data->qpos + engine->jnt_qposadr[engine->body_jntadr[body]];
    const Eigen::Quaterniond turn(X_Bo.linear());
    std::copy_n(X_Bo.translation().data(), 3, place);
    const double quaternion[4] = {turn.w(), turn.x(), turn.y(), turn.z()};
    std::copy_n(quaternion, 4, place + 3);
  }
  std::array<PlanClearance, kPairClassCount> smallest;
  for (const VectorXd* posture : {&q, &q_open}) {
    adapter.SetPositions(*posture, data->qpos);
    mj_kinematics(engine.get(), data.get());
    Clearance clearance(*engine, adapter, solids, pairs);
    clearance.Update({data->xpos, data->xmat}, 0.0);
    for (size_t i = 0; i < smallest.size(); ++i) {
      const Clearance::Nearest& nearest = clearance.nearest(static_cast<PairClass>(i));
      if (nearest.pair < 0 || nearest.distance >= smallest[i].distance) continue;
      smallest[i] = {nearest.distance, clearance.Describe(nearest.pair)};
    }
  }
  return smallest;
}

}  // namespace dexcheck::cli
