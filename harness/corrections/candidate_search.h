#pragma once

// What would put right what differs between two files.

#include <optional>
#include <string>
#include <vector>

#include "harness/corrections/correction.h"
#include "harness/corrections/printed_pair.h"

namespace dexcheck {

/// Refers to a callable `void(const PrintedLink& before, PrintedLink* after)`, for an argument of a call.
class LinkEdit {
 public:
  template <typename Function>
  LinkEdit(const Function& function)  // NOLINT(google-explicit-constructor)
      : object_(&function), call_([](const void* object, const PrintedLink& before, PrintedLink* after) {
          (*static_cast<const Function*>(object))(before, after);
        }) {}
  void operator()(const PrintedLink& before, PrintedLink* after) const { call_(object_, before, after); }

 private:
  const void* object_;
  void (*call_)(const void*, const PrintedLink&, PrintedLink*);
};

/// Kinds of sites, a bit each.
using SiteMask = unsigned;
constexpr SiteMask MaskOf(SiteKind kind) { return 1U << static_cast<unsigned>(kind); }
inline constexpr SiteMask kBodyMask =
    MaskOf(SiteKind::kMass) | MaskOf(SiteKind::kCom) | MaskOf(SiteKind::kInertia);
inline constexpr SiteMask kPoseMask = MaskOf(SiteKind::kPosition) | MaskOf(SiteKind::kRotation);

/// Which of the sites of a candidate's kinds must be right then.
enum class Demand { kAll, kSome };

/// A correction to be tried.
struct EditTrial {
  FileFault fault;
  double bits = 0.0;
  SiteMask kinds = 0;
  Demand demand = Demand::kAll;
  std::string values{};
};

class CandidateSearch {
 public:
  /// @param pair whose first robot is changed by trials, and put back.
  CandidateSearch(PrintedPair* pair, std::vector<Site> sites, bool is_second);

  [[nodiscard]] std::vector<CorrectionCandidate> Run();

 private:
  // candidate_search.cc
  [[nodiscard]] bool IsWrong(int link, SiteKind kind) const {
    return (wrong_[static_cast<size_t>(link)] & MaskOf(kind)) != 0;
  }
  /// Adds the edit of a link if it puts right what it is about and nothing wrong. @return whether it does.
  bool Try(const EditTrial& trial, int link, const LinkEdit& edit);
  /// The same of several links, whose digits the patches carry.
  bool TryPatches(const EditTrial& trial, int link, std::vector<LinkPatch> patches);
  void Add(const FileFault& fault, int link, std::vector<Site> sites, double bits,
           std::vector<LinkPatch> patches, std::string values);
  void AddSimple(CorrectionKind kind, Site site, double bits, std::string values, const LinkEdit& edit);
  /// Bits that a correction leaves over; none if it corrects nothing.
  [[nodiscard]] static std::optional<double> CountLeft(double after, double before);

  // joint_candidates.cc
  void SearchJoint(int link);
  void SearchRange(int link);
  void SearchMimic(int link);
  void SearchScalar(int link, JointScalar scalar);
  void SearchAxis(int link);

  // place_candidates.cc
  void SearchPlace(int link);
  struct Origin;  ///< One origin of a chain, and what is right of it.
  void SearchRotation(const Origin& origin);
  void SearchRotationNumbers(const Origin& origin);
  void SearchPosition(const Origin& origin);
  void SearchPose(const Origin& origin);
  void SearchRow(const Origin& origin);
  void SearchSecond(int link);

  // body_candidates.cc and inertia_candidates.cc
  void SearchBody(int link);
  struct Part;  ///< One inertial of a node, and what is right of it.
  void SearchMass(const Part& part);
  void SearchCom(const Part& part);
  void SearchWhole(const Part& part);
  void SearchInertia(const Part& part);
  void SearchInertiaConventions(const Part& part);
  void SearchInertiaNumbers(const Part& part);
  void SearchAllParts(int link);
  void SearchLoad(int link);
  void AddBody(const FileFault& fault, int link, double bits, std::string values);
  void SearchLostParts(int link);

  // exchange_candidates.cc
  void SearchExchanges();
  void SearchCopy(int link, double which);
  void SearchWelds();
  void SearchAllOrigins(int link);
  void SearchWeld(int link);
  void SearchNames();

  PrintedPair& pair_;
  std::vector<Site> sites_;
  std::vector<SiteMask> wrong_;          // by link of the first file
  std::vector<std::vector<int>> poses_;  // by link, the nodes that its origin places
  std::vector<int> bodies_;              // by link, the node whose body it is of; -1
  bool is_second_;                       // the first file of the search is the second one
  std::vector<CorrectionCandidate> found_;
};

/// "x 0.1, 0.2 would be right" of each entry that differs by more than the tolerance.
std::string DescribeEntries(std::span<const char* const> names, const double* given, const double* right,
                            const double* open);
/// The bits of these entries.
double CountEntries(size_t count, const double* given, const double* right, const double* open);
inline constexpr const char* kAxisNames[] = {"x", "y", "z"};
inline constexpr const char* kAngleNames[] = {"roll", "pitch", "yaw"};
inline constexpr const char* kInertiaNames[] = {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};

}  // namespace dexcheck
