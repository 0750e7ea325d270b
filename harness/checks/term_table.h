#pragma once

// What is compared between model and engine at a state: one entry for each term, with its own evaluator on
// either side. `consistency`, `run`, `diagnose` and `mutate` ask the entries that are marked as theirs.

#include <span>
#include <string_view>
#include <vector>

#include "controller/contact/grasp_map.h"
#include "harness/checks/compared_term.h"
#include "harness/checks/model_view.h"
#include "harness/checks/rounding_scales.h"
#include "harness/engine/engine_terms.h"

namespace dexcheck {

/// Who asks for a term.
enum Asker : unsigned {
  kAskedByRun = 1,          ///< Every step, of what the controller has evaluated.
  kAskedByConsistency = 2,  ///< Random states of robot and object.
  kAskedByContacts = 4,     ///< Random contacts of one fingertip.
};

/// A frame's body Jacobian and its rate, 6 x n, in the frame's own axes.
struct FrameJacobian {
  const Matrix6Xd* J = nullptr;
  const Matrix6Xd* J_dot = nullptr;
};

/// Rotation and place of a pose.
using Matrix34d = Eigen::Matrix<double, 3, 4>;

/// The object's terms by either side, in Sigma_o.
struct ObjectValues {
  Matrix34d pose;  ///< World.
  Vector6d V_Bo;
  Matrix6d M_hat;
  Vector6d C_hat_V;
  Vector6d N_o;
  double kinetic = 0.0;
  double potential = 0.0;
  Matrix6d M_o;  ///< These two in coordinates X_o.
  Vector6d C_o_X_o_dot;
};

/// X_o and its rate, which the checks lead to the body velocity by themselves.
struct ObjectCoordinates {
  Vector6d X_o;
  Vector6d X_o_dot;
};

/// Sizes that the object's rounding errors are relative to.
struct ObjectScales {
  double place = 1.0;  ///< Of its position, m.
  double rate = 1.0;   ///< m/s and rad/s
  double mass = 1.0;
  double inertia = 1.0;
  double weight = 1.0;  ///< N
};

/// One contact's terms by either side.
struct ContactValues {
  static constexpr int kOverlap = 6;   ///< Its place in `frame`.
  Eigen::Matrix<double, 19, 1> frame;  ///< Point, normal and overlap; Sigma_cf in Sigma_o (3 x 4).
  Eigen::Matrix<double, 6, 3> G;
  Matrix3Xd J_B;  ///< Columns of the fingertip's chain.
  Vector3d J_B_dot_xi;
  Vector3d G_dot_T_V;
  Vector6d relative_twist;  ///< Of the fingertip against the object in Sigma_cf, as kappa_dot has it.
};

/// Sizes that a contact's rounding errors are relative to.
struct ContactScales {
  double normal = 1.0;    ///< Of directions.
  double position = 1.0;  ///< m
  double moment = 1.0;    ///< Of a force's moment about Sigma_o, m.
  double J_B = 1.0;       ///< Beside that of the column's velocity.
  double J_B_dot_xi = 1.0;
  double G_dot_T_V = 1.0;
  double relative_twist = 1.0;
};

/// A contact by both sides.
struct ContactSides {
  int frame = -1;  ///< Of the fingertip.
  ContactValues model, engine;
  ContactScales scales;
};

/// Everything that evaluators read, at one state.
struct TermContext {
  const Adapter* adapter = nullptr;
  EngineTerms* engine = nullptr;
  const ModelView* robot = nullptr;
  const RoundingScales* scales = nullptr;
  std::vector<int> frames;               ///< Those whose Jacobians are compared,
  std::vector<FrameJacobian> jacobians;  ///< one for each by the model,
  std::vector<Matrix6Xd> columns;        ///< and by the engine, 6 x chain, world axes.
  VectorXd xi;
  EnergyAndMomentum energy;  ///< The model's.

  // Consistency alone.
  const ModelView* unreduced = nullptr;
  EngineTerms* engine_unreduced = nullptr;
  std::vector<LinkInWorld> links;  ///< By the engine, base first.
  VectorXd w;                      ///< A second velocity.
  const RoundingScales* scales_at_w = nullptr;

  ObjectValues object_model, object_engine;
  ObjectScales object_scales;
  std::vector<ContactSides> contacts;  ///< Of the first frames, one for each.
  const MatrixXd* J_B = nullptr;       ///< The model's, all contacts' rows.
  double when = 0.0;
};

enum class TermGroup {
  kRobot,
  kContact,
  kObject,
  kObjectCoordinates,  ///< With X_o alone: a pose that is measured and used as it is tells nothing.
};

/// When a term's scales are formed.
enum class Weighed { kOnce, kAtEachState };

/// Numbers of a term that are evaluated together: those of a joint, a link, a frame, a contact.
struct TermItem {
  int index;                    ///< Of the joint, ...; of frames and contacts, their place in the context.
  std::vector<Location> where;  ///< One for each number.
};

/// Numbers of an item on either side, or one over the size of what is summed up to form them.
using Evaluator = void (*)(const TermContext&, int item, Eigen::Ref<Eigen::ArrayXd> numbers);

/// One entry of the table.
struct TermEntry {
  const char* name;              ///< In log and summary; NOTATION.md has it.
  const char* consistency_name;  ///< What consistency calls it.
  const char* symbol;
  const char* equation;
  TermGroup group;
  unsigned askers;  ///< Of Asker.
  double factor;    ///< Geometric quantities (poses, Jacobians are one) that its formation chains.

  std::vector<TermItem> (*list)(const TermContext&);
  Evaluator model;
  Evaluator engine;
  Evaluator weigh;  ///< So that one bound holds for all numbers.
  Weighed weighed = Weighed::kAtEachState;
  /// Matrices of which `list` has only what the tree lets differ from zero; null where it has everything.
  std::vector<ZeroPattern> (*list_zeros)(const TermContext&) = nullptr;
  void (*check_zeros)(const TermContext&, ComparedTerm*) = nullptr;
};

/// All terms, in the order in which they are shown: what stands above explains what stands below.
std::span<const TermEntry> ListTerms();

/// The entry that consistency calls so. @throws std::invalid_argument when there is none.
const TermEntry& FindTerm(std::string_view consistency_name);

/// Largest relative error that rounding explains, on chains of `depth` joints.
double CalcBound(const TermEntry& term, int depth);

/// By the engine, with its scales: the contact of one of the frames, whose model's side is at hand.
/// @param shift carries the projected robot to where the plant has it.
void EvaluateContact(const Contact& contact, const Pose& shift, size_t index, TermContext* context);

/// By the engine, in coordinates X_o with X_o_dot when `coordinates` has them.
void EvaluateObject(const MassProperties& body, const Vector3d& gravity, const ObjectCoordinates* coordinates,
                    TermContext* context);

// The table's parts.
std::span<const TermEntry> ListRobotTerms();
std::span<const TermEntry> ListContactTerms();
std::span<const TermEntry> ListObjectTerms();

}  // namespace dexcheck
