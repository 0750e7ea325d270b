#pragma once

// Where the fingers of a hand can touch an object. Internal to controller/grasp.

#include <optional>
#include <span>
#include <vector>

#include "controller/common/types.h"
#include "controller/contact/surface.h"
#include "controller/grasp/contact_plan.h"
#include "controller/grasp/serial_chain.h"
#include "controller/model/robot_model.h"

namespace dexcheck::grasp_internal {

/// What the fingers keep clear of.
struct HandClearance {
  const ContactPlanOptions& options;
  std::optional<SupportPlane> above;  // the support in the palm frame
};

/// One way in which a finger can touch the object.
struct Touch {
  SurfacePoint alpha;
  Eigen::Matrix<double, 6, 3> G;  // its columns of the grasp map, object frame
  VectorXd q;                     // the finger's own joints
  VectorXd q_open;                // with the fingertip moved out along the normal
  std::vector<Vector3d> points;   // along the finger in the palm frame, the fingertip's centre last
  double joint_margin = 0.0;      // smallest distance from the ends of ranges
  VectorXd supports;              // see TouchChooser
};

/// The fingers of one hand. Everything is in the palm frame.
class HandReach {
 public:
  HandReach(const RobotModel& model, std::span<const int> fingertips, int palm_frame,
            const Eigen::Ref<const VectorXd>& q, double joint_margin);

  [[nodiscard]] size_t num_fingers() const { return fingers_.size(); }
  [[nodiscard]] const SerialChain& chain(size_t finger) const { return fingers_[finger].chain; }
  [[nodiscard]] double radius(size_t finger) const { return fingers_[finger].radius; }
  /// Where the fingers begin: origins of their first own joints.
  [[nodiscard]] const std::vector<Vector3d>& bases() const { return bases_; }
  /// Middle of the box around the bases, and how far along z the fingertips reach beyond it.
  [[nodiscard]] const Vector3d& center() const { return center_; }
  [[nodiscard]] double length() const { return length_; }

  /// The finger's touch at a point of the object, if it reaches and stays clear. @param X_Po object in the
  /// palm frame. @param q_start of the finger's own joints.
  [[nodiscard]] std::optional<Touch> FindTouch(size_t finger, const Surface& object, const Pose& X_Po,
                                               const HandClearance& clearance, const SurfacePoint& alpha,
                                               const VectorXd& q_start) const;

  /// Touches all over what the finger reaches, about `grid` m apart.
  [[nodiscard]] std::vector<Touch> ListTouches(size_t finger, const Surface& object, const Pose& X_Po,
                                               const HandClearance& clearance, double grid) const;

  /// Whether two fingers with these touches stay apart.
  [[nodiscard]] bool AreApart(size_t finger_a, const Touch& a, size_t finger_b, const Touch& b,
                              const HandClearance& clearance) const;

 private:
  struct Finger {
    SerialChain chain;  // rooted in the palm frame
    double radius;
    JointRange range;  // less the margin
    VectorXd middle;
    std::vector<VectorXd> postures;  // all over the ranges
    std::vector<Vector3d> tips;      // fingertip's centre in them
  };

  std::vector<Finger> fingers_;
  std::vector<Vector3d> bases_;
  Vector3d center_;
  double length_ = 0.0;
};

/// Distance of a point (object frame) from the object, m; also where the closest point is not unique.
double CalcDistance(const Surface& object, const Vector3d& p);

}  // namespace dexcheck::grasp_internal
