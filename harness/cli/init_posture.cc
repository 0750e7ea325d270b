#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/control/grasp_controller.h"
#include "controller/control/stance.h"
#include "controller/dynamics/model_terms.h"
#include "harness/cli/init_stance.h"

namespace dexcheck::cli {
namespace {

/// Not at an end, where rounding to the digits printed would put it outside.
double ClampInside(const Joint& joint, double q) {
  const double margin = 0.01 * (joint.upper - joint.lower);
  return std::clamp(q, joint.lower + margin, joint.upper - margin);
}

/// Follows a robot that stands: whether it can, and what it asks of its motors.
class StandTrial {
 public:
  /// @param least that each place on the ground bears, N.
  StandTrial(const RobotModel& model, const std::map<std::string, double>& limits, const Stand& stand,
             double least)
      : model_(model), terms_(model), joints_(model.num_joints()), limits_(limits) {
    for (const Foot& foot : stand.feet) stance_.feet.push_back(model.FindFrame(foot.frame));
    stance_.mu = 0.45;  // less than the scenario's
    stance_.f_min = least;
    stance_.f_max = stand.weight;
    SetAtRest(VectorXd::Unit(model.num_positions(), 3));
  }

  /// 1 or -1, by which joints of either side turn alike.
  [[nodiscard]] double FindSide(int joint) const {
    return terms_.CalcLinkPose(joint).linear().col(2).sum() < 0.0 ? -1.0 : 1.0;
  }

  /// Puts the feet on the ground, and then, with the base lower by `sink`, the centre of mass over them.
  [[nodiscard]] bool Settle(double sink, bool in_plane, VectorXd* q) {
    GroundContacts ground(model_, stance_.feet);
    (*q)[3] = 1.0;
    SetAtRest(*q);
    ground.SetState(terms_);
    (*q)[2] = -ground.gap().mean();
    if (!(PutFeetDown(model_, stance_, q) < 1e-9)) return false;
    for (int k = 0; sink > 0.0 && k < 4; ++k) {
      SetAtRest(*q);
      ground.SetState(terms_);
      VectorXd way = -terms_.CalcEnergyAndMomentum().com;
      for (int i = 0; i < ground.count(); ++i) way += ground.X_WF(i).translation() / ground.count();
      way.conservativeResizeLike(VectorXd::Zero(6));
      if (in_plane) way[1] = 0.0;
      way[2] = k == 0 ? -sink : 0.0;
      DesiredJoints next;
      StanceMotion(model_, stance_, *q, JointMotion(way, {}, {})).Evaluate(0.0, &next);
      *q = next.q;
    }
    return true;
  }

  /// Whether the robot can sway from there as the scenario says, its joints well within their ranges.
  [[nodiscard]] bool Sways(const VectorXd& q, Stand* stand) {
    stand->poses.clear();
    stand->weak.clear();
    StanceForces forces(model_, stance_);
    const Sway sway = ListWay(*stand);
    const StanceMotion motion(model_, stance_, q, JointMotion(VectorXd::Zero(6), sway.points, sway.swings));
    GroundContacts ground(model_, stance_.feet);
    DesiredJoints desired;
    constexpr int kSamples = 64;
    constexpr double kStays = 1e-9;  // m, m/s, of feet
    for (int k = 0; k <= kSamples; ++k) {
      motion.Evaluate(4.0 * k / kSamples, &desired);
      if (!desired.q.allFinite() || !IsInRange(desired.q)) return false;
      terms_.SetState(desired.q, desired.q_dot);
      terms_.CalcDynamics();
      // Legs with too few joints cannot move the base in all ways.
      ground.SetState(terms_);
      const double rate = (ground.J() * desired.q_dot).lpNorm<Eigen::Infinity>();
      if (!(std::max(rate, ground.gap().lpNorm<Eigen::Infinity>()) < kStays)) return false;
      VectorXd force =
          terms_.M() * desired.q_ddot + terms_.C() * desired.q_dot + terms_.friction() + terms_.gravity();
      try {
        forces.TakeOff(terms_, force);
      } catch (const GraspForceError&) {
        return false;
      }
      Note(desired.q.tail(joints_), force.tail(joints_), stand);
    }
    return true;
  }

 private:
  void SetAtRest(const VectorXd& q) {
    terms_.SetState(q, VectorXd::Zero(model_.num_velocities()));
    terms_.CalcDynamics();
  }

  [[nodiscard]] bool IsInRange(const VectorXd& q) const {
    for (int i = 0; i < joints_; ++i) {
      const Joint& joint = model_.joints()[static_cast<size_t>(i)];
      const double at = q[q.size() - joints_ + i];
      if (at < joint.lower || at > joint.upper) return false;
    }
    return true;
  }

  void Note(const VectorXd& q, const VectorXd& force, Stand* stand) const {
    std::map<std::string, double>& pose = stand->poses.emplace_back();
    for (int i = 0; i < joints_; ++i) {
      const std::string& name = model_.joints()[static_cast<size_t>(i)].name;
      pose[name] = q[i];
      const auto limit = limits_.find(name);
      const bool is_weak = limit != limits_.end() && std::abs(force[i]) > 0.9 * limit->second;
      const std::vector<std::string>& weak = stand->weak;
      if (is_weak && std::find(weak.begin(), weak.end(), name) == weak.end()) stand->weak.push_back(name);
    }
  }

  const RobotModel& model_;
  ModelTerms terms_;
  int joints_;
  const std::map<std::string, double>& limits_;
  Stance stance_;
};

}  // namespace

std::string FindPosture(const RobotModel& model, const std::map<std::string, double>& limits, Stand* stand) {
  if (stand->has_wheels) return "a foot turns without end, as wheels do";
  if (stand->feet.size() < 3) return fmt::format("{} places touch the ground", stand->feet.size());
  // The engine shares a sole's load among its corners evenly, not as the law asks: with a quarter of its
  // share each, no corner of six humanoids lifts.
  const double least = 0.25 * stand->weight / static_cast<double>(stand->feet.size());
  StandTrial trial(model, limits, *stand, least);
  bool settles = false;
  // Of the way to the middle of a joint's range, which bends a knee as it can be bent.
  constexpr double kBends[] = {0.0, 0.1, 0.2, 0.3, 0.45, 0.6};
  for (size_t k = 0; k < 2 * std::size(kBends); ++k) {
    const double bend = kBends[k % std::size(kBends)];
    stand->in_plane = k >= std::size(kBends);
    VectorXd q = VectorXd::Zero(model.num_positions());
    for (int i = 0; i < model.num_joints(); ++i) {
      const Joint& joint = model.joints()[static_cast<size_t>(i)];
      const double at = ClampInside(joint, stand->pose[joint.name]);
      // A leg that is stretched bends by joints that may turn on.
      const bool turns = joint.type == JointType::kRevolute && joint.upper - joint.lower >= 2.0 * kPi;
      const double middle = turns ? at + trial.FindSide(i) : 0.5 * (joint.lower + joint.upper);
      q[q.size() - model.num_joints() + i] = (1.0 - bend) * at + bend * middle;
    }
    if (!trial.Settle(0.1 * bend * stand->height, stand->in_plane, &q)) continue;
    settles = true;
    for (stand->sway = 1.0; stand->sway > 0.2; stand->sway *= 0.5) {
      if (!trial.Sways(q, stand)) continue;
      for (int i = 0; i < model.num_joints(); ++i)
        stand->pose[model.joints()[static_cast<size_t>(i)].name] = q[q.size() - model.num_joints() + i];
      return "";
    }
  }
  if (!settles) return "its feet do not all reach the ground";
  return "in no posture that was tried it sways within its joints' ranges and the ground's friction cones";
}

}  // namespace dexcheck::cli
