#pragma once

// The body of a link against what it should be, as one and part by part.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "harness/descriptions/conventions.h"
#include "harness/descriptions/robot_description.h"

namespace dexcheck {

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

}  // namespace dexcheck
