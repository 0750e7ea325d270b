#pragma once

// A robot joint by joint as its file has it: each link in its own frame, placed in its parent's. Where the
// links of two descriptions are in each other, and a frame on each link that has no common one.

#include <optional>
#include <string>
#include <vector>

#include "harness/descriptions/conventions.h"
#include "harness/descriptions/hypotheses.h"
#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// A joint and its link in the link's own frame: the joint turns about, or slides along, `axis` there.
struct OwnRow {
  int parent = -1;
  bool is_revolute = true;
  Pose X_PL = Pose::Identity();  ///< The link's own frame in its parent's own frame, at q = 0.
  Pose X_PW = Pose::Identity();  ///< Of what is welded to the parent and carries the joint.
  Vector3d axis = Vector3d::UnitZ();
  MassProperties body;  ///< In the own frame.
};

/// The rows of a description; the base's own frame is Sigma_0.
std::vector<OwnRow> ListOwnRows(const RobotDescription& robot);

/// Pose of each link's own frame in the world, the base first, with all joints at zero.
std::vector<Pose> CalcOwnPoses(const Pose& X_W0, const std::vector<OwnRow>& rows);

/// Returns the poses of the links' own frames in the world as CalcOwnPoses has them.
std::vector<Pose> CalcZeroPoses(const RobotDescription& robot);

/// Gives the link of a plain row another place in its parent's own frame, and its joint another axis in the
/// own frame, in which all that it carries stays where it is.
void TakeOwnRow(int joint, const Pose& X_PL, const Vector3d& axis, RobotDescription* robot);

/// The rows as if the file's Denavit-Hartenberg rows had been changed so, and were classic ones.
std::vector<OwnRow> ReadRowsAs(const RobotDescription& robot, MdhRow (*change)(MdhRow), bool classic);

/// Parts of a link that have mass, in the own frame of another description.
/// @param joint that moves it; -1 for the base. @param X_ab the link's own frame in that of the other
/// description. @return `body`, X_LC and, as X_iL, the part's own frame, all in that frame.
std::vector<DescribedPart> ListParts(const RobotDescription& robot, int joint, const Pose& X_ab);

/// A link of two descriptions: which frame it has is each description's own choice.
struct LinkPlace {
  int a = -1;  ///< Its joint in `a`; -1 the base.
  int b = -1;
  Pose X_ab = Pose::Identity();  ///< Frame i of `b` in that of `a`: they coincide so with all joints at zero.
};

/// The joints' links and a floating base, as far as `b` has parts of them.
/// @param a, b as CompleteEachOther left them; without places when their joints do not match.
std::vector<LinkPlace> PlaceLinks(const RobotDescription& a, const RobotDescription& b);

/// Adds to both descriptions a frame of the link's name on each link that joints move and on which they have
/// none in common, so that how links move is compared: the link's own frame of `b`, and in `a` where it is
/// with all joints at zero. @return whether there is such a link.
bool AddLinkFrames(RobotDescription* a, RobotDescription* b);

// Which conventions and numbers explain that bodies differ, and that axes and bodies stand elsewhere: links
// and rows of the two descriptions, and what was found, before it is put into words.

/// A link of two descriptions, in its own frame of the first.
struct LinkBody {
  std::string link;
  std::string joint_name;
  StatedPart given;
  StatedPart right;
  // What is welded together in it, as ListParts has it.
  std::vector<DescribedPart> given_parts;
  std::vector<DescribedPart> right_parts;
};

/// What the two are compared with: places relative to `length`, m.
struct Closeness {
  double length;
  double tolerance;
};

inline constexpr Quantity kBodyQuantities[] = {Quantity::kMass, Quantity::kCom, Quantity::kInertia};

bool IsRight(const LinkBody& body, Quantity quantity, const Closeness& close);
/// Whether mass, centre of mass and inertia are.
bool IsRight(const LinkBody& body, const Closeness& close);

/// A link with a convention undone.
struct Undone {
  LinkBody body;
  std::string part;  ///< Of several, the one that it was undone in; empty for the whole link.
  int right = 0;     ///< Quantities that are right then.
};

/// One of several parts of a link: as it is given, and as it should be.
struct PartView {
  std::string name;
  size_t index = 0;      ///< Of the given parts.
  bool is_main = false;  ///< The link's own, which its joint places.
  StatedPart given;
  StatedPart right;
};

class BodyUndoing {
 public:
  BodyUndoing(const LinkBody& link, const Closeness& close);

  /// Undoes a convention in the whole link, in each of its parts or in one, whichever makes most right.
  /// Nothing unless what the convention is about was wrong and is right then, and nothing else is wrong for
  /// it.
  [[nodiscard]] std::optional<Undone> Undo(const Convention& convention) const;
  /// Parts of the given body; if it is one, as those of the right body say.
  [[nodiscard]] const std::vector<PartView>& views() const { return views_; }

 private:
  [[nodiscard]] bool Fits(const Convention& convention, const StatedPart& undone,
                          const StatedPart& right) const;
  void TryWhole(const Convention& convention, std::optional<Undone>* best) const;
  void TryAll(const Convention& convention, std::optional<Undone>* best) const;
  void TryPart(const Convention& convention, const PartView& view, std::optional<Undone>* best) const;
  void OfferParts(const Convention& convention, const std::vector<DescribedPart>& parts,
                  const std::string& name, std::optional<Undone>* best) const;

  const LinkBody& link_;
  Closeness close_;
  bool of_given_ = false;  // the views are parts of the given body
  std::vector<PartView> views_;
};

/// The name of a part of the right body that the given one lacks.
std::optional<std::string> FindLostPart(const LinkBody& body, const Closeness& close);

/// One way to put a row right: conventions of the table, or numbers.
struct RowReading {
  StatedPart part;  ///< X_PL and axis; what else conventions need.
  double cost = 0.0;
  std::vector<const Convention*> conventions;  ///< At most two.
  std::string number;                          ///< "zero.offset", "number.origin", ...
  std::string words;                           ///< Of the number: "offset by 30 deg".
  double offset = 0.0;                         ///< Of a zero, rad: what undoes it.
};

/// A row as it was read, the base's first, and what explains it: readings that do equally well. None where
/// the row is right; one without conventions and number where nothing explains it.
struct RowFinding {
  std::vector<RowReading> readings;
  std::vector<RowReading> elsewhere;  ///< Of a row that is right: what would explain as well what it carries.
  Pose X_ab = Pose::Identity();       ///< The link's own frame of the other description in this one's.
  bool is_placed = false;             ///< Whether that is known, since all rows up to here are explained.
};

struct RowProblem {
  std::vector<OwnRow> given;
  std::vector<OwnRow> right;  ///< In the order of `given`.
  Pose X_W0_given = Pose::Identity();
  Pose X_W0_right = Pose::Identity();
  bool base_is_fixed = true;
  std::vector<LinkBody> bodies;  ///< Of the base, then of each joint, but for the frame of `right`.
  Closeness close;
};

/// The cheapest reading of each row from the base outward. A reading costs 1 for each convention, more for
/// numbers, and what it leaves wrong of what the row places: its axis, its body, the joints on its link.
std::vector<RowFinding> SearchRows(const RowProblem& problem);

/// Whether a joint of the given robot turns about the right axis, when its row is read so.
bool IsAxisRight(const RowProblem& problem, size_t joint, const StatedPart& part, const Pose& X_ab_P);

/// A body of the problem with its right one in the given frame.
LinkBody PlaceBody(const RowProblem& problem, size_t link, const Pose& X_ab);

// A number that can take any value explains by chance what a convention does not.
inline constexpr double kConvention = 1.0;
inline constexpr double kNumber = 1.3;
inline constexpr double kUnexplained = 4.0;
inline constexpr const char* kZero = "zero.offset";

class RowReader {
 public:
  explicit RowReader(const RowProblem& problem);

  /// Joints on a link; -1: on the base.
  [[nodiscard]] const std::vector<size_t>& ListChildren(int joint) const {
    return children_[static_cast<size_t>(joint + 1)];
  }
  /// From here on a row's parent frame is that in which the file places it.
  [[nodiscard]] Pose ToCarrier(size_t i, const Pose& X_ab) const {
    return problem_.given[i].X_PW.inverse() * X_ab;
  }

  [[nodiscard]] StatedPart StateRow(size_t i) const {
    StatedPart part = problem_.bodies[i + 1].given;
    part.X_PL = problem_.given[i].X_PW.inverse() * problem_.given[i].X_PL;
    part.axis = problem_.given[i].axis;
    return part;
  }

  /// What would be right if the two files had the same frame on the link.
  [[nodiscard]] StatedPart StateRight(size_t i, const Pose& X_ab_P) const {
    StatedPart part;
    part.X_PL = X_ab_P * problem_.right[i].X_PL;
    part.axis = problem_.right[i].axis;
    return part;
  }
  [[nodiscard]] bool IsSame(const StatedPart& a, const StatedPart& b) const;

  /// Readings under which the axis is right.
  /// @param in_pairs also two conventions at once.
  [[nodiscard]] std::vector<RowReading> ListReadings(size_t i, const Pose& X_ab_P, bool in_pairs) const;

 private:
  using Readings = std::vector<RowReading>;
  void Offer(size_t i, const Pose& X_ab_P, RowReading reading, Readings* readings) const;
  void AddNumbers(size_t i, const Pose& X_ab_P, const StatedPart& given, const StatedPart& right,
                  Readings* readings) const;
  void AddOffsets(size_t i, const Pose& X_ab_P, const StatedPart& given, Readings* readings) const;
  void OfferOffset(size_t i, const Pose& X_ab_P, const StatedPart& given, double offset,
                   Readings* readings) const;

  const RowProblem& problem_;
  std::vector<std::vector<size_t>> children_;  // of the base, then of each joint
};

/// A hypothesis, but for its text and what it explains.
struct Finding : Hypothesis {
  std::vector<std::string> one;   ///< By id: "inertia looks halved". Whole sentences when `what` is empty.
  std::vector<std::string> many;  ///< By id: "inertias look halved".
  std::string what;               ///< "link" or "joint", or empty.
  size_t total = 0;               ///< How many such parts the robot has.
  bool is_all = false;            ///< All that are wrong in what it is about, and most there are.
  size_t cells = 0;               ///< Quantities of parts that it explains.
};

/// Conventions that many links share first, then bodies that are exchanged or shifted by one in the list,
/// then what single links have; at last the numbers that nothing explains.
/// @param bodies have all but these numbers undone afterwards.
std::vector<Finding> SearchBodies(const Closeness& close, std::vector<LinkBody>* bodies);

std::vector<Finding> ReportRows(const RobotDescription& robot, const std::vector<RowFinding>& rows);

/// Adds what the row of another joint explains as well. @param joint -1: the base.
void AddElsewhere(const RobotDescription& robot, const RowFinding& row, int joint, Finding* finding);

}  // namespace dexcheck
