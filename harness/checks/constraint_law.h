#pragma once

// The forces of the engine's constraints, predicted from the motion: the documented law of soft contacts,
// joint limits, dry friction and joined points, with the masses, lengths and Jacobians of the parameters.

#include <mujoco/mujoco.h>

#include <array>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "harness/checks/soft_constraint.h"
#include "harness/checks/whole_robot.h"

namespace dexcheck {

/// Force of one row of the constraints, N or N m.
struct RowForce {
  double law = 0.0;
  double bound = 0.0;  ///< Largest difference from the engine's force that rounding explains.
  /// False for rows of another kind, and on bodies other than robot, object and world: no law is stated.
  bool is_predicted = false;
  bool has_own_place = true;  ///< Place, distance and normal follow from the parameters; else the engine's.
};

/// The engine's constraints at one step. A row has the velocity v = J qvel, the acceleration a = J qacc and
/// the distance r, less its margin. K, B and the impedance d(r) come from its solref and solimp, and w is the
/// inverse inertia of the joined bodies at the reference pose. The engine documents
///
///   y = a + B v + K d r,  R = w (1 - d) / d
///   f = max(0, -y / R)   contacts without friction, joint limits, edges of friction pyramids
///   f = -y / R           joined points; dry friction, within the joint's own
///   f = the point of the friction cone that is nearest to -y / R, in the metric of R
///
/// No row needs a state of its own. Along a contact's tangents K = 0, and R is smaller by the factors
/// impratio and (mu_j / mu_1)^2; the edges of a pyramid share R = 2 mu_1^2 (1 + mu_1^2) w (1 - d) / d /
/// impratio.
///
/// w, J, the joints' limits and dry friction follow from the parameters. So do the places at which spheres of
/// fingertips, feet and wheels touch planes of the world, each other, or an object that is a sphere or torus.
/// At all other contacts place and distance are the engine's; the direction of tangents and the choice
/// between the two nearest places on a torus are always the engine's. Softness, margins and friction come
/// from the adapter's mjModel, or from the contact where no pair of the MJCF lists its geoms.
///
/// Bounds follow from the sizes of the terms that are summed to y, and from how errors of rotations, places
/// and velocities grow along the chain of joints. Nothing allocates after construction.
class ConstraintLaw {
 public:
  /// @param model of the plant's robot. @param object its object, if it has one. @param adapter between that
  /// model and the engine. @param whole of the same, set to the state of each step. All of them outlive this.
  /// @param tolerance relative error of the parameters, where it is larger than that of rounding.
  ConstraintLaw(const RobotModel& model, const ObjectModel* object, const Adapter& adapter,
                const WholeRobot& whole, double tolerance = 0.0);

  /// Whether the engine's forces are those of the law: the PGS solver and the no-slip pass leave some over,
  /// and contact parameters that the engine overrides are not read.
  [[nodiscard]] static bool Applies(const mjModel& engine);

  /// Predicts the rows of a step. @param qpos, qvel the engine's at its beginning. @param response the
  /// step's. All of them outlive the calls below.
  void SetStep(const mjtNum* qpos, const mjtNum* qvel, const PlantResponse& response);
  /// By row.
  [[nodiscard]] std::span<const RowForce> forces() const { return forces_; }
  /// The largest difference of the engine's force and the law's over its bound, and its row; -1 without one.
  [[nodiscard]] std::pair<double, int> FindWorst() const;
  /// "contact of r_fingertip_1 and torus", "limit of joint elbow", "dry friction of joint elbow".
  [[nodiscard]] std::string DescribeRow(int row) const;

 private:
  enum class Shape { kOther, kPlane, kSphere, kTorus };
  struct Geom {
    std::string name;
    Shape shape = Shape::kOther;
    int link = WholeRobot::kNoLink;
    Vector3d center = Vector3d::Zero();  // in the link's frame; of a plane any point
    Vector3d normal = Vector3d::Zero();  // of a plane
    double radius = 0.0, tube = 0.0;     // m
  };
  // Members called error are in units of the relative error of one operation.
  struct Link {
    long step = -1;
    Pose X = Pose::Identity();
    double turn_error = 0.0;                  // rad
    Vector3d place_error = Vector3d::Zero();  // m
    PointMotion origin;
  };
  /// A point of a link.
  struct Point {
    const Link* link;
    Vector3d position, error;  // world, m
  };
  struct Place {
    Vector3d position = Vector3d::Zero();
    Matrix3d frame = Matrix3d::Identity();
    double distance = 0.0;
    double position_error = 0.0, normal_error = 0.0, distance_error = 0.0;
    bool is_own = false;
  };
  void FindGeoms(const mjData& reference);
  void FindWeights(const mjData& reference);
  void FindAnchors(const mjData& reference);
  const Link& Follow(int link);
  Point Locate(int link, const Vector3d& in_link);
  static void AddMotion(const Link& link, const Vector3d& point, double point_error, double sign,
                        PointMotion* motion);
  /// The contact with the parameters of its pair.
  [[nodiscard]] EngineContact TakePair(EngineContact contact) const;
  [[nodiscard]] Place FindPlace(const EngineContact& contact);
  [[nodiscard]] InverseInertia AddWeights(int body1, int body2) const;
  void SetJointRow(size_t row);
  void SetConnection(size_t row);
  void SetContact(size_t row);
  /// @param project moves -y / R to the forces that the rows can have.
  template <typename Project>
  void SetForces(size_t row, const SoftCone& cone, bool has_own_place, const Project& project);

  const RobotModel* model_;
  const ObjectModel* object_;
  const Adapter* adapter_;
  const WholeRobot* whole_;
  double unit_;  // relative error of one operation
  std::vector<Geom> geoms_;
  std::map<std::pair<int, int>, int> pairs_;        // by their geoms, the smaller number first
  std::vector<InverseInertia> body_weights_;        // by the engine's bodies, of their translation
  std::vector<InverseInertia> joint_weights_;       // by the engine's joints
  std::vector<int> joints_;                         // of the whole robot, by the engine's; -1 without
  std::vector<std::array<Vector3d, 2>> anchors_;    // of joined points, in their links' frames
  std::vector<Link> links_;                         // object, world, base, then by joint
  Eigen::Matrix<double, Eigen::Dynamic, 2> rates_;  // nu_dot and nu
  VectorXd nu_;
  long step_ = 0;
  const mjtNum *qpos_ = nullptr, *qvel_ = nullptr;
  const PlantResponse* response_ = nullptr;
  std::vector<RowForce> forces_;
};

}  // namespace dexcheck
