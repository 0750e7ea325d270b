#pragma once

// Two files of one robot: the second one's numbers in the link frames of the first, and where they differ.

#include <optional>
#include <span>
#include <vector>

#include "harness/corrections/correction.h"
#include "harness/corrections/link_match.h"

namespace dexcheck {

/// A link's numbers as a file has them, and the tolerances that its digits give them.
struct GivenNode {
  Pose X = Pose::Identity();
  PoseTolerance pose;
  MassProperties body, body_tolerance;
};

/// The right values of a link, in the first file's frames of it and of its parent, with the tolerances of the
/// second file's digits.
struct RightNode : GivenNode {
  bool is_placed = false;  ///< Whether both files have it on the same link.
  Vector3d axis = Vector3d::UnitZ();
  double axis_tolerance = 0.0;
  Vector3d anchor = Vector3d::Zero();
  double anchor_tolerance = 0.0;
};

class PrintedPair {
 public:
  PrintedPair(PrintedRobot a, PrintedRobot b, MatchBy by = MatchBy::kLinks);

  [[nodiscard]] const PrintedRobot& a() const { return a_; }
  [[nodiscard]] PrintedRobot* mutable_a() { return &a_; }
  [[nodiscard]] PrintedRobot* mutable_b() { return &b_; }
  [[nodiscard]] const PrintedRobot& b() const { return b_; }
  /// Whether both files are MJCFs, which state a joint's limits and reference, or have none.
  [[nodiscard]] bool AreMjcfs() const {
    return a_.format == RobotFormat::kMjcf && b_.format == RobotFormat::kMjcf;
  }
  [[nodiscard]] const LinkMatch& match() const { return match_; }
  [[nodiscard]] const Node& node(int link) const { return nodes_[static_cast<size_t>(link)]; }
  [[nodiscard]] const Node& node_b(int link) const { return nodes_b_[static_cast<size_t>(link)]; }
  /// The link of the second file; -1 when it has none.
  [[nodiscard]] int Partner(int link) const { return match_.b_of_a[static_cast<size_t>(link)]; }
  /// Links of the first file that the second has too, parents first.
  [[nodiscard]] const std::vector<int>& links() const { return links_; }
  /// The link that carries a link in both files; -1 when it stands in the world, or they differ in that.
  [[nodiscard]] int Carrier(int link) const;
  /// Whether both files have a link on the same one, or in the world.
  [[nodiscard]] bool IsPlaced(int link) const;

  /// Pose of the second file's frame of a link in the first one's.
  [[nodiscard]] const Pose& X_ab(int link) const { return X_ab_[static_cast<size_t>(link)]; }
  void SetFrames(std::vector<Pose> X_ab);

  [[nodiscard]] const RightNode& right(int link) const { return right_[static_cast<size_t>(link)]; }
  [[nodiscard]] const GivenNode& given(int link) const { return given_[static_cast<size_t>(link)]; }
  /// Numbers of the second file in its own frames.
  [[nodiscard]] const GivenNode& other(int link) const { return other_[static_cast<size_t>(link)]; }

  /// How far a number is from right, relative to its digits' tolerance; at most 1: it is right.
  /// @param deviation gets its distance from the right one, m, rad, kg or kg m^2, whatever the digits.
  [[nodiscard]] double CompareNode(SiteKind kind, int link, const GivenNode& now,
                                   double* deviation = nullptr) const;
  /// Compares the numbers as they were measured.
  [[nodiscard]] double CompareNode(SiteKind kind, int link) const {
    return CompareNode(kind, link, given(link));
  }
  /// Measures the first file's numbers again. @pre links were changed.
  void Measure();
  /// Measures the second file's numbers of one link. @pre it was changed.
  void MeasureOther(int link);
  /// All that differs.
  [[nodiscard]] std::vector<Site> ListSites() const;
  /// A motor of the first file with the joint, and the gains of a servo, that it has in the second one.
  [[nodiscard]] PrintedMotor FindRight(PrintedMotor motor) const;
  /// The constraints of the first file, or of a copy of it, with the second file's names of its joints and
  /// links.
  [[nodiscard]] std::vector<std::string> RenameConstraints(const PrintedRobot& a) const;
  /// Whether a file states some number of this kind at any joint.
  [[nodiscard]] static bool States(const PrintedRobot& robot, JointScalar scalar);

 private:
  void ListJointSites(int link, std::vector<Site>* sites) const;
  void ListConstantSites(int link, std::vector<Site>* sites) const;
  void ListRobotSites(std::vector<Site>* sites) const;
  void SetRight(int link);
  [[nodiscard]] bool IsCoupledAlike(int link) const;

  PrintedRobot a_, b_;
  LinkMatch match_;
  std::vector<Node> nodes_, nodes_b_;
  std::vector<int> links_;
  std::vector<Pose> X_ab_;
  std::vector<PoseTolerance> frame_open_;  ///< Tolerance that digits give X_ab_.
  std::vector<RightNode> right_;
  std::vector<GivenNode> given_, other_;
};

/// Whether two scalars differ by more than their digits allow.
bool Differ(const PrintedScalar& a, const PrintedScalar& b);
/// The number of a joint that counts where its file states none.
/// @param has_motors both files state motors: a joint without one has none.
std::optional<PrintedScalar> TakeScalar(const PrintedLink& link, JointScalar scalar, bool has_motors);

}  // namespace dexcheck
