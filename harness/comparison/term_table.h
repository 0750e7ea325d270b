#pragma once

// The terms that two providers of a robot are compared in at a state: one entry for each term. `run`,
// `consistency`, `engines`, `diagnose` and `mutate` compare the entries that are marked as theirs.

#include <span>
#include <vector>

#include "harness/base/check_record.h"
#include "harness/comparison/rounding_scales.h"
#include "harness/descriptions/dynamics_provider.h"

namespace dexcheck {

/// Who asks for a term.
enum Asker : unsigned {
  kAskedByRun = 1,          ///< Every step, for the terms that the controller has evaluated.
  kAskedByConsistency = 2,  ///< Two descriptions, at random states of robot and object.
  kAskedByContacts = 4,     ///< Random contacts of one fingertip.
  kAskedOfPrograms = 8,     ///< Terms of the protocol of programs, results in files and other engines.
};

/// Parts that the columns of a term's matrix belong to; its rows are the numbers of each part.
enum class TermParts {
  kWhole,
  kJoint,          ///< One column for each of its velocities.
  kLink,           ///< Links that move, the base first.
  kModelFrame,     ///< Every frame of the model.
  kFrame,          ///< Frames whose Jacobians are compared;
  kFrameColumns,   ///< n columns of each.
  kVelocity,       ///< One column, whose rows are velocities.
  kVelocityPair,   ///< n x n
  kUnreducedPair,  ///< In unreduced coordinates.
  kContact,
  kContactColumns,  ///< n columns of each.
  kObject,
};

/// Sizes that the object's rounding errors are relative to.
struct ObjectScales {
  double place = 1.0;  ///< Scale of its position, m.
  double rate = 1.0;   ///< m/s and rad/s
  double mass = 1.0;
  double inertia = 1.0;
  double weight = 1.0;  ///< N
};

/// Sizes that a contact's rounding errors are relative to.
struct ContactScales {
  double normal = 1.0;    ///< Scale of directions.
  double position = 1.0;  ///< m
  double moment = 1.0;    ///< Scale of a force's moment about Sigma_o, m.
  double J_B = 1.0;       ///< Scale beside that of the column's velocity.
  double J_B_dot_xi = 1.0;
  double G_dot_T_V = 1.0;
  double relative_twist = 1.0;
};

/// Everything that scales are formed from, at one state.
struct ScaleContext {
  explicit ScaleContext(const RobotModel& described)
      : model(&described), robot(described), robot_at_w(described) {}

  const RobotModel* model;
  std::vector<int> frames;          ///< Whose Jacobians are compared.
  std::vector<int> contact_frames;  ///< The first of them that have contacts.
  std::vector<bool> has_mass;       ///< By link that moves: whether both providers have it.
  RoundingScales robot, robot_at_w;
  VectorXd xi;
  ObjectScales object;
  std::vector<ContactScales> contacts;
  const MatrixXd* first = nullptr;  ///< The term's numbers by the first two providers.
  const MatrixXd* second = nullptr;
};

/// Sets the size of the terms that are summed to form each number, so that one bound holds for all; infinite
/// for numbers that are not compared. `scale` holds ones.
using ScaleFunction = void (*)(const ScaleContext&, Eigen::Ref<MatrixXd> scale);

/// One entry of the table.
struct TermEntry {
  Term term;
  const char* name;  ///< In log and summary; NOTATION.md has it.
  const char* symbol;
  const char* equation;
  TermParts parts;
  Eigen::Index rows;  ///< Numbers of each part.
  unsigned askers;    ///< A sum of Asker values.
  double factor;      ///< Geometric quantities (poses, Jacobians are one) that its formation chains.
  ScaleFunction scale = nullptr;           ///< Null for ones.
  bool is_scaled_once = false;             ///< The scale is the same at all states.
  const char* consistency_name = nullptr;  ///< Where consistency calls it otherwise.
  Term instead_of = Term::kTermCount;      ///< Is compared where one of the two lacks that term.
};

/// All terms, in the order of Term.
std::span<const TermEntry> ListTerms();

/// Largest relative error that rounding explains, on chains of `depth` joints.
double CalcBound(const TermEntry& term, int depth);

/// Whether the term is of contacts.
inline bool IsOfContacts(const TermEntry& entry) {
  return entry.parts == TermParts::kContact || entry.parts == TermParts::kContactColumns;
}

/// Rows and columns of a term's matrix.
std::pair<Eigen::Index, Eigen::Index> CalcShape(const TermEntry& entry, const ScaleContext& context);

/// Returns the location of the number in a row and column.
Location FindLocation(const TermEntry& entry, const ScaleContext& context, Eigen::Index row,
                      Eigen::Index col);

/// Sizes of the object at a distance from the world's origin, m, that moves at `rate`, m/s and rad/s.
ObjectScales CalcObjectScales(const MassProperties& body, const Vector3d& gravity, double distance,
                              double rate);

}  // namespace dexcheck
