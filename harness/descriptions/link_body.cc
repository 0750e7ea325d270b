#include <algorithm>
#include <cmath>
#include <tuple>

#include "controller/model/rigid_body.h"
#include "harness/descriptions/fault_search.h"

namespace dexcheck {

const char* NameOf(Quantity quantity, bool many) {
  static constexpr const char* kNames[][2] = {
      {"mass", "masses"},        {"centre of mass", "centres of mass"},
      {"inertia", "inertias"},   {"origin", "origins"},
      {"rotation", "rotations"}, {"place", "places"},
      {"axis", "axes"},          {"range", "ranges"},
      {"damping", "dampings"},   {"armature", "armatures"}};
  return kNames[static_cast<size_t>(quantity)][many ? 1 : 0];
}

std::string ShowNumbers(const VectorXd& values) {
  const double rounding = 1e-9 * values.cwiseAbs().maxCoeff();
  std::string text;
  for (const double value : values)
    text += (text.empty() ? "[" : ", ") + FormatNumber(std::abs(value) > rounding ? value : 0.0, 7);
  return text + "]";
}

bool AgreesIn(Quantity quantity, const StatedPart& a, const StatedPart& b, double length, double tolerance) {
  const auto same = [&](double x, double y) {
    return std::abs(x - y) <= tolerance * std::max(std::abs(x), std::abs(y));
  };
  const double trace = std::max(std::abs(a.body.inertia.trace()), std::abs(b.body.inertia.trace()));
  switch (quantity) {
    case Quantity::kMass:
      return same(a.body.mass, b.body.mass);
    case Quantity::kCom:
      return (a.body.com - b.body.com).cwiseAbs().maxCoeff() <= tolerance * length;
    case Quantity::kInertia:
      return (a.body.inertia - b.body.inertia).cwiseAbs().maxCoeff() <= tolerance * trace;
    case Quantity::kRange:
      return same(a.lower, b.lower) && same(a.upper, b.upper);
    case Quantity::kDamping:
      return same(a.damping, b.damping);
    case Quantity::kArmature:
      return same(a.armature, b.armature);
    default:
      return a.axis == b.axis && a.X_PL.isApprox(b.X_PL, tolerance);
  }
}

void TakeFrom(const StatedPart& other, Quantity quantity, StatedPart* part) {
  if (quantity == Quantity::kMass) part->body.mass = other.body.mass;
  if (quantity == Quantity::kCom) part->body.com = other.body.com;
  if (quantity == Quantity::kInertia) part->body.inertia = other.body.inertia;
  if (quantity == Quantity::kRange) std::tie(part->lower, part->upper) = std::tie(other.lower, other.upper);
  if (quantity == Quantity::kDamping) part->damping = other.damping;
  if (quantity == Quantity::kArmature) part->armature = other.armature;
}
namespace {

/// What is left of a body without others that belong to it, all in one frame; nothing where no mass is left.
std::optional<MassProperties> Subtract(const MassProperties& whole, const MassProperties& others) {
  // Below this fraction of the whole the part is lost in what the other numbers are rounded by.
  constexpr double kLeastFraction = 1e-6;
  MassProperties rest;
  rest.mass = whole.mass - others.mass;
  if (!(rest.mass > kLeastFraction * whole.mass)) return std::nullopt;
  rest.com = (whole.mass * whole.com - others.mass * others.com) / rest.mass;
  rest.inertia = whole.inertia + CalcPointInertia(whole.mass, whole.com) - others.inertia -
                 CalcPointInertia(others.mass, others.com) - CalcPointInertia(rest.mass, rest.com);
  return rest;
}

/// @param left_out an index, or none: parts.size().
MassProperties CombineOthers(const std::vector<DescribedPart>& parts, size_t left_out) {
  std::vector<MassProperties> others;
  for (size_t k = 0; k < parts.size(); ++k) {
    if (k != left_out) others.push_back(parts[k].body);
  }
  return Combine(others);
}

/// Parts describe a body only while they are what it was made of.
bool Describe(const std::vector<DescribedPart>& parts, const MassProperties& body) {
  constexpr double kRounding = 1e-9;
  if (parts.size() < 2) return false;
  const StatedPart whole{CombineOthers(parts, parts.size())};
  return std::ranges::all_of(kBodyQuantities, [&](Quantity quantity) {
    return AgreesIn(quantity, whole, StatedPart{body}, 1.0, kRounding);
  });
}

const DescribedPart* FindByName(const std::vector<DescribedPart>& parts, const std::string& name) {
  const auto found = std::ranges::find(parts, name, &DescribedPart::name);
  return found == parts.end() ? nullptr : &*found;
}

/// Whether a part is the link's own, which stands first, and is placed by its joint.
bool IsMain(const std::vector<DescribedPart>& parts, const DescribedPart& part) {
  return &part == parts.data() && part.X_iL.isApprox(Pose::Identity());
}

/// A body in the own frame of a part, given in the link's.
StatedPart StatePart(const DescribedPart& part, bool is_main, const MassProperties& body,
                     const StatedPart& link) {
  StatedPart stated;
  if (is_main) stated = link;
  if (!is_main) stated.X_PL = part.X_iL;
  stated.body = ExpressIn(body, part.X_iL.inverse());
  stated.R_LC = part.X_iL.linear().transpose() * part.X_LC.linear();
  return stated;
}

/// A part of the given body. What it should be says the other file's part of its name; else what the others
/// do not have of the whole.
std::optional<PartView> ViewGiven(const LinkBody& link, size_t k) {
  const DescribedPart& part = link.given_parts[k];
  const bool is_main = IsMain(link.given_parts, part);
  PartView view{part.name, k, is_main, StatePart(part, is_main, part.body, link.given), {}};
  if (const DescribedPart* const other = FindByName(link.right_parts, part.name)) {
    view.right = StatePart(*other, is_main, other->body, link.right);
    view.right.body = ExpressIn(other->body, part.X_iL.inverse());
    return view;
  }
  const std::optional<MassProperties> rest = Subtract(link.right.body, CombineOthers(link.given_parts, k));
  if (!rest) return std::nullopt;
  view.right = StatePart(part, is_main, *rest, link.given);
  return view;
}

/// A part of the right body, in a given one that is stated as a whole.
std::optional<PartView> ViewRight(const LinkBody& link, size_t k) {
  const DescribedPart& part = link.right_parts[k];
  const bool is_main = IsMain(link.right_parts, part);
  const std::optional<MassProperties> rest = Subtract(link.given.body, CombineOthers(link.right_parts, k));
  if (!rest) return std::nullopt;
  PartView view{part.name, k, false, StatePart(part, is_main, *rest, link.given),
                StatePart(part, is_main, part.body, link.right)};
  view.given.R_LC.setIdentity();
  return view;
}

int CountRight(const StatedPart& a, const StatedPart& b, const Closeness& close) {
  return static_cast<int>(std::ranges::count_if(kBodyQuantities, [&](Quantity quantity) {
    return AgreesIn(quantity, a, b, close.length, close.tolerance);
  }));
}

/// Keeps the better of two.
void Offer(Undone candidate, std::optional<Undone>* best) {
  if (!*best || candidate.right > (*best)->right) *best = std::move(candidate);
}

/// Along the axes in which the file gives the inertia, or along the link's.
std::vector<StatedPart> UndoAlong(const Convention& convention, const StatedPart& given,
                                  const StatedPart& right) {
  std::vector<StatedPart> undone;
  const std::optional<StatedPart> in_file = convention.undo(given, right);
  if (in_file) undone.push_back(*in_file);
  if (convention.of != Quantity::kInertia || given.R_LC.isIdentity()) return undone;
  StatedPart along_link = given;
  along_link.R_LC.setIdentity();
  const std::optional<StatedPart> in_link = convention.undo(along_link, right);
  if (in_link) undone.push_back(*in_link);
  return undone;
}

DescribedPart Move(const DescribedPart& part, const StatedPart& undone, bool of_place) {
  DescribedPart moved = part;
  if (of_place) moved.X_iL = undone.X_PL;
  moved.body = ExpressIn(undone.body, moved.X_iL);
  return moved;
}

}  // namespace

BodyUndoing::BodyUndoing(const LinkBody& link, const Closeness& close) : link_(link), close_(close) {
  of_given_ = Describe(link.given_parts, link.given.body);
  const bool of_right = !of_given_ && Describe(link.right_parts, link.right.body);
  const size_t count = of_given_ ? link.given_parts.size() : of_right ? link.right_parts.size() : 0;
  for (size_t k = 0; k < count; ++k) {
    std::optional<PartView> view = of_given_ ? ViewGiven(link, k) : ViewRight(link, k);
    if (view) views_.push_back(std::move(*view));
  }
}

std::optional<Undone> BodyUndoing::Undo(const Convention& convention) const {
  std::optional<Undone> best;
  const bool of_place = IsOfPlace(convention.of);
  // What is wrong of parts may balance in one quantity of the whole, and show in the others.
  const bool is_right = !of_place && IsRight(link_, convention.of, close_);
  if (of_place || (of_given_ && IsOfBody(convention.of)) ? IsRight(link_, close_) : is_right) return best;
  if (of_given_ && (of_place || IsOfBody(convention.of))) TryAll(convention, &best);
  if (!of_place && !is_right) TryWhole(convention, &best);
  if (!IsOfBody(convention.of) && !of_place) return best;
  for (const PartView& view : views_) TryPart(convention, view, &best);
  return best;
}

bool BodyUndoing::Fits(const Convention& convention, const StatedPart& undone,
                       const StatedPart& right) const {
  return AgreesIn(convention.of, undone, right, close_.length, close_.tolerance);
}

void BodyUndoing::TryWhole(const Convention& convention, std::optional<Undone>* best) const {
  for (const StatedPart& undone : UndoAlong(convention, link_.given, link_.right)) {
    if (!Fits(convention, undone, link_.right)) continue;
    Undone candidate{link_, "", 0};
    TakeFrom(link_.right, convention.of, &candidate.body.given);
    candidate.right = CountRight(candidate.body.given, link_.right, close_);
    return Offer(std::move(candidate), best);
  }
}

/// A body made of other parts, when it is right then.
void BodyUndoing::OfferParts(const Convention& convention, const std::vector<DescribedPart>& parts,
                             const std::string& name, std::optional<Undone>* best) const {
  Undone candidate{link_, name, 0};
  candidate.body.given_parts = parts;
  candidate.body.given.body = CombineOthers(parts, parts.size());
  candidate.right = CountRight(candidate.body.given, link_.right, close_);
  const bool fits = IsOfPlace(convention.of) ? IsRight(candidate.body, close_)
                                             : Fits(convention, candidate.body.given, link_.right);
  if (fits && candidate.right > CountRight(link_.given, link_.right, close_))
    Offer(std::move(candidate), best);
}

void BodyUndoing::TryAll(const Convention& convention, std::optional<Undone>* best) const {
  const bool of_place = IsOfPlace(convention.of);
  std::vector<DescribedPart> parts = link_.given_parts;
  int changed = 0;
  for (DescribedPart& part : parts) {
    const bool is_main = IsMain(parts, part);
    if (of_place && is_main) continue;
    const StatedPart given = StatePart(part, is_main, part.body, link_.given);
    const DescribedPart* const other = FindByName(link_.right_parts, part.name);
    const std::optional<StatedPart> undone = convention.undo(
        given, other == nullptr ? given : StatePart(*other, is_main, other->body, link_.right));
    if (!undone) continue;
    constexpr double kVisible = 1e-9;
    const DescribedPart moved = Move(part, *undone, of_place);
    changed += CountRight(StatedPart{moved.body}, StatedPart{part.body}, {1.0, kVisible}) < 3 ? 1 : 0;
    part = moved;
  }
  if (changed > 1) OfferParts(convention, parts, "", best);  // one is that part's own
}

void BodyUndoing::TryPart(const Convention& convention, const PartView& view,
                          std::optional<Undone>* best) const {
  const bool of_place = IsOfPlace(convention.of);
  if (of_place && (view.is_main || !of_given_)) return;
  for (const StatedPart& undone : UndoAlong(convention, view.given, view.right)) {
    if (of_given_) {
      std::vector<DescribedPart> parts = link_.given_parts;
      parts[view.index] = Move(parts[view.index], undone, of_place);
      OfferParts(convention, parts, view.name, best);
    } else if (Fits(convention, undone, view.right)) {
      Undone candidate{link_, view.name, CountRight(undone, view.right, close_)};
      for (const Quantity quantity : kBodyQuantities) {
        if (candidate.right == 3 || quantity == convention.of)
          TakeFrom(link_.right, quantity, &candidate.body.given);
      }
      Offer(std::move(candidate), best);
    }
  }
}

bool IsRight(const LinkBody& body, Quantity quantity, const Closeness& close) {
  return AgreesIn(quantity, body.given, body.right, close.length, close.tolerance);
}

bool IsRight(const LinkBody& body, const Closeness& close) {
  return CountRight(body.given, body.right, close) == static_cast<int>(std::size(kBodyQuantities));
}

std::optional<std::string> FindLostPart(const LinkBody& body, const Closeness& close) {
  for (size_t k = 0; body.right_parts.size() > 1 && k < body.right_parts.size(); ++k) {
    const StatedPart rest{CombineOthers(body.right_parts, k)};
    if (CountRight(body.given, rest, close) == 3) return body.right_parts[k].name;
  }
  return std::nullopt;
}

}  // namespace dexcheck
