#pragma once

// The search for candidates: edits that correct quantities which differ between two files.

#include <optional>
#include <string>
#include <vector>

#include "harness/corrections/edits.h"
#include "harness/corrections/printed_pair.h"

namespace dexcheck {

/// A correction to be tried.
struct EditTrial {
  FileFault fault;
  double bits = 0.0;
  SiteMask kinds = kPoseMask | kBodyMask;  ///< Sites that it may put right and must not put wrong.
  std::string values{};
  bool needs_all = true;  ///< All wrong sites of these kinds must be right then; otherwise some.
};

/// An edit of one link.
struct PlacedEdit {
  int link;
  LinkUndo undo;
};

class CandidateSearch {
 public:
  /// @param pair whose robots are changed by trials, and put back. @param budget trials that may still be
  /// made; at 0 the search ends.
  CandidateSearch(PrintedPair* pair, std::vector<Site> sites, bool is_second, int* budget);

  [[nodiscard]] std::vector<CorrectionCandidate> Run();

 private:
  // candidate_search.cc
  [[nodiscard]] bool IsWrong(int link, SiteKind kind) const { return (WrongOf(link) & MaskOf(kind)) != 0; }
  [[nodiscard]] SiteMask WrongOf(int link) const { return wrong_[static_cast<size_t>(link)]; }
  [[nodiscard]] const std::vector<int>& PosesOf(int link) const { return poses_[static_cast<size_t>(link)]; }
  [[nodiscard]] int BodyOf(int link) const { return bodies_[static_cast<size_t>(link)]; }
  /// Adds the edits as one candidate if they put right what they are about and nothing wrong.
  bool Try(const EditTrial& trial, int place, const std::vector<PlacedEdit>& edits);
  bool Try(const EditTrial& trial, int link, const LinkUndo& undo) {
    return Try(trial, link, std::vector<PlacedEdit>{{link, undo}});
  }
  /// The edits of one of several links.
  struct LinkEdits {
    int link;
    std::vector<LinkEdit> edits;
  };
  /// Tries each fault that several of these links may have, at all of them.
  void TryTogether(const std::vector<LinkEdits>& lists, int place, SiteMask kinds, bool needs_all);
  struct TriedNode;
  [[nodiscard]] std::vector<TriedNode> ListTried(const std::vector<PlacedEdit>& edits) const;
  void Add(const EditTrial& trial, int link, std::vector<Site> sites, std::vector<LinkPatch> patches = {});
  /// Adds a candidate that puts one site right, without a trial.
  void AddSimple(const EditTrial& trial, int link, const LinkUndo& undo);
  /// All wrong sites of a body.
  [[nodiscard]] std::vector<Site> ListBodySites(int link) const;

  // joint_candidates.cc
  void SearchJoint(int link);
  void SearchRange(int link);
  void SearchMimic(int link);
  void SearchScalar(int link, JointScalar scalar);
  void SearchAxis(int link);
  void SearchRobot();
  void SearchMotors(const Site& site);

  // place_candidates.cc
  void SearchPlace(int link);
  struct Origin;  ///< One origin of a chain, and what is right of it.
  /// By how much more the second file's joint has as its reference position, rad or m, and both in words.
  [[nodiscard]] std::pair<double, std::string> CompareReferences(const Origin& origin) const;
  void SearchRotationNumbers(const Origin& origin);
  void SearchPositionNumbers(const Origin& origin);
  void SearchPoseNumbers(const Origin& origin);
  void SearchRowNumbers(const Origin& origin);
  void SearchWeld(int link);
  void SearchAllOrigins(int link);

  // body_candidates.cc
  void SearchBody(int link);
  struct Part;  ///< One inertial of a node, and what is right of it.
  [[nodiscard]] std::optional<Part> MakePart(int link, int k) const;
  void SearchPart(const Part& part);
  void SearchInertiaNumbers(const Part& part);
  void SearchAllParts(int link);
  void SearchTwoParts(int link, size_t begin);
  void SearchLoad(int link);
  void SearchLostParts(int link);

  // exchange_candidates.cc
  void SearchExchanges();
  void SearchTurnedExchange(int n, int k, double which);
  void SearchCopy(int link, double which);
  void SearchSecond(int link);
  [[nodiscard]] PrintedLink TakeRight(int link, SiteMask mask) const;

  PrintedPair& pair_;
  std::vector<Site> sites_;
  std::vector<SiteMask> wrong_;          // by link of the first file
  std::vector<std::vector<int>> poses_;  // by link, the nodes that its origin places
  std::vector<int> bodies_;              // by link, the node whose body it is of; -1
  bool is_second_;                       // the first file of the search is the second one
  int* budget_;
  std::vector<CorrectionCandidate> found_;
};

/// Bits that a correction leaves over when sites are so far from right after and before; none if it corrects
/// nothing.
std::optional<double> CountLeft(double after, double before);

/// "0.1 kg here, 0.2 kg in the other file". @param unit as " kg".
std::string DescribeRight(const std::string& given, const std::string& right);
std::string DescribeRight(double given, double right, const char* unit);
std::string DescribeRight(const Vector3d& given, const Vector3d& right, const char* unit);
/// The bits of the entries that differ by more than the tolerance, and "x 0.1 m here, 0.2 m in the other
/// file" of each.
struct EntryDifference {
  double bits = 1.0;
  std::string values{};
};
EntryDifference CompareEntries(std::span<const char* const> names, const double* given, const double* right,
                               const double* open, const char* unit);
template <typename Vector>
EntryDifference CompareEntries(std::span<const char* const> names, const Vector& given, const Vector& right,
                               const Vector& open, const char* unit) {
  return CompareEntries(names, given.data(), right.data(), open.data(), unit);
}
/// "0.1 0 -0.2": entries that are rounding beside the largest are 0.
std::string ShowVector(const Vector3d& v);
inline constexpr const char* kInertiaNames[] = {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};

/// The rotation of an inertial's frame, which the other file turns and this one does not.
FileFault MakeLostAxes(const PrintedInertial& inertial, bool in_second);

/// A body without others of its parts; none where no mass is left.
std::optional<MassProperties> Subtract(const MassProperties& whole, const MassProperties& rest);
/// Gives a link's inertial the numbers of a body, along the axes that it has.
LinkUndo GiveBody(const MassProperties& body);

}  // namespace dexcheck
