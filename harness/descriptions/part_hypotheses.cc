// Faults of one part of a body that several parts are welded to. What the other parts do not have of the
// whole body is that part, so it is compared as a body of its own.

#include "controller/common/text.h"
#include "controller/model/body_frame.h"
#include "harness/descriptions/body_faults.h"

namespace dexcheck {
namespace {

/// A part as a body in its own frame; X_PL of it is that frame in the link's own frame.
struct ComparedPart {
  std::string name;
  ComparedBody body;
  bool is_placed = false;  ///< By the right description: the given one may have it at another place.
};

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

MassProperties CombineOthers(const std::vector<DescribedPart>& parts, size_t left_out) {
  std::vector<MassProperties> others;
  for (size_t k = 0; k < parts.size(); ++k) {
    if (k != left_out) others.push_back(parts[k].body);
  }
  return Combine(others);
}

/// @param parts of one of the two descriptions, at whose places they are compared.
/// @param whole of the other one.
void AddParts(const ComparedBody& link, bool of_given, std::vector<ComparedPart>* list) {
  const std::vector<DescribedPart>& parts = of_given ? link.given_parts : link.parts;
  if (parts.size() < 2) return;
  // Parts describe the body only while they are what it was made of.
  constexpr double kRounding = 1e-9;
  const MassProperties whole = CombineOthers(parts, parts.size());
  if (CompareBodies(whole, of_given ? link.given : link.right, 1.0).largest() > kRounding) return;
  for (size_t k = 0; k < parts.size(); ++k) {
    const DescribedPart& part = parts[k];
    const std::optional<MassProperties> other =
        Subtract(of_given ? link.right : link.given, CombineOthers(parts, k));
    if (!other) continue;
    const Pose X_PL = part.X_iL.inverse();
    ComparedPart& compared = list->emplace_back();
    compared.name = part.name;
    compared.is_placed = !of_given;
    compared.body.link = link.link;
    compared.body.given = ExpressIn(of_given ? part.body : *other, X_PL);
    compared.body.right = ExpressIn(of_given ? *other : part.body, X_PL);
    compared.body.X_PL = part.X_iL;
    const Matrix3d R_LC = X_PL.linear() * part.X_LC.linear();
    if (of_given) compared.body.R_LC = R_LC;
    if (of_given) continue;
    DescribedPart own = part;
    own.body = compared.body.right;
    own.X_LC = X_PL * part.X_LC;
    compared.body.parts = {own};
  }
}

std::vector<BodyFault> ListPartFaults() {
  std::vector<BodyFault> faults = ListBodyFaults();
  faults.push_back({"inertia", "inertias", "as if given about the origin of the link that carries it",
                    [](const ComparedBody& body) {
                      MassProperties in_link = ExpressIn(body.given, body.X_PL);
                      in_link.inertia -= CalcPointInertia(in_link.mass, in_link.com);
                      return ExpressIn(in_link, body.X_PL.inverse());
                    }});
  return faults;
}

/// Where a part would stand that is welded on by fault so, and in which words.
std::vector<std::pair<Pose, const char*>> ListWrongPlaces(const Pose& X_LP) {
  const auto place = [](const Vector3d& p, const Matrix3d& R) {
    Pose X = Pose::Identity();
    X.translation() = p;
    X.linear() = R;
    return X;
  };
  const Vector3d p = X_LP.translation();
  const Matrix3d R = X_LP.linear();
  const Matrix3d one = Matrix3d::Identity();
  return {{Pose::Identity(), "stood at the origin of the link that carries it (its weld's place is missing)"},
          {place(p, one), "were welded on without the rotation of its weld"},
          {place(Vector3d::Zero(), R), "were welded on without the translation of its weld"},
          {place(p, R.transpose()), "were welded on with the rotation transposed"},
          {place(-p, R), "were welded on with the translation turned around"},
          {X_LP.inverse(), "were welded on by the inverse of its weld's place"},
          {place(1e3 * p, R), "were welded on at a place in mm"},
          {place(1e-3 * p, R), "were welded on at a place divided by 1000"}};
}

}  // namespace

std::optional<std::string> DescribePartFault(const ComparedBody& body, double length, double tolerance) {
  std::vector<ComparedPart> parts;
  AddParts(body, /*of_given=*/true, &parts);
  AddParts(body, /*of_given=*/false, &parts);
  if (parts.empty()) return std::nullopt;
  const auto is_right = [&](const ComparedPart& part, const MassProperties& undone) {
    return CompareBodies(undone, part.body.right, length).largest() <= tolerance;
  };
  std::erase_if(parts, [&](const ComparedPart& part) { return is_right(part, part.body.given); });
  for (const BodyFault& fault : ListPartFaults()) {
    for (const ComparedPart& part : parts) {
      const std::optional<MassProperties> undone = fault.undo(part.body);
      if (!undone || !is_right(part, *undone)) continue;
      return "the " + fault.noun + " of its part " + Quote(part.name) + " looks " + fault.text;
    }
  }
  for (const ComparedPart& part : parts) {
    if (!part.is_placed) continue;
    const MassProperties given = ExpressIn(part.body.given, part.body.X_PL);
    for (const auto& [X_LP, text] : ListWrongPlaces(part.body.X_PL)) {
      const MassProperties there = ExpressIn(part.body.right, X_LP);
      if (CompareBodies(there, given, length).largest() > tolerance) continue;
      return "its part " + Quote(part.name) + " looks as if it " + text;
    }
  }
  return std::nullopt;
}

std::optional<MassProperties> UndoInAllParts(const BodyFault& fault, const ComparedBody& body,
                                             int fewest_parts) {
  std::vector<ComparedPart> parts;
  AddParts(body, /*of_given=*/true, &parts);
  if (parts.empty() || parts.size() != body.given_parts.size()) return std::nullopt;
  constexpr double kVisible = 1e-9;
  std::vector<MassProperties> undone;
  int changed = 0;
  for (const ComparedPart& part : parts) {
    const std::optional<MassProperties> one = fault.undo(part.body);
    if (!one) return std::nullopt;
    changed += CompareBodies(*one, part.body.given, 1.0).largest() > kVisible ? 1 : 0;
    undone.push_back(ExpressIn(*one, part.body.X_PL));
  }
  if (changed < fewest_parts) return std::nullopt;
  return Combine(undone);
}

}  // namespace dexcheck
