#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "controller/common/text.h"
#include "harness/descriptions/conventions.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/fault_search.h"

namespace dexcheck {

namespace {

Matrix3d Turn(int axis, double angle) {
  return Eigen::AngleAxisd(angle, Vector3d::Unit(axis)).toRotationMatrix();
}
Matrix3d FromAngles(const Vector3d& rpy) { return Turn(2, rpy[2]) * Turn(1, rpy[1]) * Turn(0, rpy[0]); }
Matrix3d InOtherOrder(const Vector3d& rpy) { return Turn(0, rpy[0]) * Turn(1, rpy[1]) * Turn(2, rpy[2]); }
Matrix3d FromQuaternion(double w, double x, double y, double z) {
  return Eigen::Quaterniond(w, x, y, z).toRotationMatrix();
}
bool IsSame(const Matrix3d& a, const Matrix3d& b) {
  constexpr double kSame = 1e-6;
  return (a - b).cwiseAbs().maxCoeff() < kSame;
}

Matrix3d FromSignedAngles(const Matrix3d& R) { return FromAngles(-CalcRollPitchYaw(R)); }
Matrix3d FromReversedAngles(const Matrix3d& R) { return FromAngles(CalcRollPitchYaw(R).reverse()); }
Matrix3d ToOtherOrder(const Matrix3d& R) { return InOtherOrder(CalcRollPitchYaw(R)); }
Matrix3d FromOtherOrder(const Matrix3d& R) { return FromAngles(-CalcRollPitchYaw(R.transpose())); }
Matrix3d Quarter(const Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return FromQuaternion(q.z(), q.w(), q.x(), q.y());
}
Matrix3d QuarterBack(const Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return FromQuaternion(q.x(), q.y(), q.z(), q.w());
}
const RotationFault kRotations[] = {
    {"transposed", "turned the other way (transposed)",
     [](const Matrix3d& R) { return Matrix3d(R.transpose()); }, nullptr},
    {"degrees", "as if its angles were in degrees, though radians are expected", nullptr,
     [](const Matrix3d& R) { return FromAngles(CalcRollPitchYaw(R) / DegToRad(1.0)); }},
    {"radians", "as if its angles were in radians, though degrees are expected",
     [](const Matrix3d& R) { return FromAngles(CalcRollPitchYaw(R) / DegToRad(1.0)); }, nullptr},
    {"missing", "missing", nullptr, [](const Matrix3d&) { return Matrix3d(Matrix3d::Identity()); }},
    {"unneeded", "as if the file should have none",
     [](const Matrix3d&) { return Matrix3d(Matrix3d::Identity()); }, nullptr},
    {"other_order", "as if its roll, pitch and yaw were taken in the other order", FromOtherOrder,
     ToOtherOrder},
    {"meant_other_order", "as if its roll, pitch and yaw were meant in the other order", ToOtherOrder,
     FromOtherOrder},
    {"ypr", "as if yaw, pitch and roll stood in the place of roll, pitch and yaw", FromReversedAngles,
     FromReversedAngles},
    {"sign", "with the sign of its angles turned around", FromSignedAngles, FromSignedAngles},
    {"xyzw", "as if its quaternion were written x, y, z, w and read w, x, y, z", Quarter, nullptr},
    {"wxyz", "as if its quaternion were written w, x, y, z and read x, y, z, w", QuarterBack, nullptr}};

}  // namespace

std::span<const RotationFault> ListRotationFaults() { return kRotations; }

std::optional<Matrix3d> Undo(const RotationFault& fault, const Matrix3d& given, const Matrix3d& right) {
  if (fault.apply != nullptr && IsSame(fault.apply(right), given)) return right;
  if (fault.undo == nullptr) return std::nullopt;
  return fault.undo(given);
}

namespace {

/// What a person reads of a body.
std::string Describe(const MassProperties& body, std::span<const Quantity> quantities) {
  const Matrix3d& I = body.inertia;
  Vector6d moments;
  moments << I.diagonal(), I(0, 1), I(0, 2), I(1, 2);
  const std::string texts[] = {"mass " + FormatNumber(body.mass, 7), "com " + ShowNumbers(body.com),
                               "inertia " + ShowNumbers(moments)};
  std::string text;
  for (const Quantity one : quantities) text += (text.empty() ? "" : ", ") + texts[static_cast<size_t>(one)];
  return text;
}

constexpr size_t kMany = 3;

class BodySearch {
 public:
  BodySearch(const Closeness& close, std::vector<LinkBody>* bodies)
      : read_(*bodies), bodies_(*bodies), close_(close) {
    for (const LinkBody& body : bodies_)
      count_ += body.given.body.mass > 0.0 || body.right.body.mass > 0.0 ? 1 : 0;
  }

  std::vector<Finding> Run() {
    for (const Quantity quantity : {Quantity::kRange, Quantity::kDamping, Quantity::kArmature})
      Vote(quantity, 1);
    FindShiftedLists();
    // One fault of many links is likelier than many exchanges: left and right are mirrored, and a wrong
    // sign makes one of the other.
    for (const Quantity quantity : kBodyQuantities) Vote(quantity, kMany);
    FindExchanges();
    FindLostParts();
    for (const Quantity quantity : {Quantity::kOrigin, Quantity::kRotation, Quantity::kPlace})
      Vote(quantity, 1);
    for (const Quantity quantity : kBodyQuantities) {
      Vote(quantity, 1);
      TakeNumbers(quantity);
    }
    found_.insert(found_.end(), numbers_.begin(), numbers_.end());
    for (const auto& [i, quantity] : taken_) TakeFrom(read_[i].given, quantity, &bodies_[i].given);
    return std::move(found_);
  }

 private:
  /// The links that a convention explains, each as it is then.
  struct Cover {
    std::vector<size_t> links;
    std::vector<Undone> undone;
    std::vector<const Convention*> conventions;  // that explain the same ones
  };

  [[nodiscard]] static Cover Try(const Convention& convention, const std::vector<BodyUndoing>& undoings) {
    Cover cover;
    for (size_t i = 0; i < undoings.size(); ++i) {
      std::optional<Undone> undone = undoings[i].Undo(convention);
      if (!undone) continue;
      cover.links.push_back(i);
      cover.undone.push_back(std::move(*undone));
    }
    cover.conventions.push_back(&convention);
    return cover;
  }

  /// The convention that explains most links comes first, with those that explain the same ones.
  /// @param fewest links that a fault must explain.
  void Vote(Quantity quantity, size_t fewest) {
    while (std::ranges::any_of(bodies_, [&](const LinkBody& body) { return IsWrong(body, quantity); })) {
      Cover best;
      std::vector<BodyUndoing> undoings;
      for (const LinkBody& body : bodies_) undoings.emplace_back(body, close_);
      for (const Convention& convention : ListConventions()) {
        if (convention.of != quantity) continue;
        Cover cover = Try(convention, undoings);
        if (cover.links.size() > best.links.size()) {
          best = std::move(cover);
        } else if (!cover.links.empty() && cover.links == best.links &&
                   cover.undone[0].part == best.undone[0].part) {
          best.conventions.push_back(&convention);
        }
      }
      if (best.links.size() < std::max(fewest, size_t{1})) return;
      Take(quantity, best);
    }
  }

  [[nodiscard]] bool IsWrong(const LinkBody& body, Quantity quantity) const {
    return IsOfPlace(quantity) ? !IsRight(body, close_) : !IsRight(body, quantity, close_);
  }

  void Take(Quantity quantity, const Cover& cover) {
    const size_t wrong = static_cast<size_t>(
        std::ranges::count_if(bodies_, [&](const LinkBody& body) { return IsWrong(body, quantity); }));
    Finding finding;
    finding.what = IsOfBody(quantity) || IsOfPlace(quantity) ? "link" : "joint";
    finding.total = IsOfBody(quantity) ? count_ : bodies_.size();
    finding.is_all = cover.links.size() == wrong && 2 * wrong > finding.total;
    const std::string& part = cover.undone[0].part;
    for (const Convention* const convention : cover.conventions) {
      finding.ids.push_back(convention->id);
      const std::string noun = NameOf(convention->of, false);
      finding.one.push_back((part.empty() ? "its " + noun : "the " + noun + " of its part " + Quote(part)) +
                            " looks " + convention->words);
      finding.many.push_back(std::string(NameOf(convention->of, true)) + " look " + convention->words);
    }
    Add(std::move(finding), cover.links,
        IsOfBody(quantity) ? std::span<const Quantity>(&quantity, 1)
                           : std::span<const Quantity>(kBodyQuantities));
    for (size_t k = 0; k < cover.links.size(); ++k) bodies_[cover.links[k]] = cover.undone[k].body;
  }

  /// Names the links, and adds to an earlier finding of the same kind.
  void Add(Finding finding, const std::vector<size_t>& links, std::span<const Quantity> quantities) {
    finding.cells = links.size();
    const auto same = std::ranges::find_if(found_, [&](const Finding& other) {
      return other.ids == finding.ids && other.what == finding.what &&
             !finding.ids[0].starts_with("exchange");
    });
    Finding& target = same == found_.end() ? found_.emplace_back(finding) : *same;
    if (same != found_.end()) {
      target.cells += finding.cells;
      target.is_all = finding.is_all || 2 * target.cells > target.total;
    }
    for (const size_t i : links) {
      target.parts.push_back(target.what == "joint" ? read_[i].joint_name : read_[i].link);
      AddValue(i, quantities, &target);
    }
  }

  void AddValue(size_t i, std::span<const Quantity> quantities, Finding* finding) const {
    constexpr size_t kMostValues = 3;
    if (finding->what == "joint" || finding->values.size() == kMostValues) return;
    finding->values.push_back("link " + read_[i].link + ": " + Describe(read_[i].given.body, quantities) +
                              "; right would be " + Describe(read_[i].right.body, quantities));
  }

  [[nodiscard]] std::vector<size_t> ListOpen() const {
    std::vector<size_t> open;
    for (size_t i = 0; i < bodies_.size(); ++i) {
      if (!IsRight(bodies_[i], close_)) open.push_back(i);
    }
    return open;
  }

  [[nodiscard]] bool IsBodyOf(size_t i, size_t other, Quantity quantity) const {
    return AgreesIn(quantity, bodies_[i].given, bodies_[other].right, close_.length, close_.tolerance);
  }
  [[nodiscard]] bool IsBodyOf(size_t i, size_t other) const {
    return std::ranges::all_of(kBodyQuantities,
                               [&](Quantity quantity) { return IsBodyOf(i, other, quantity); });
  }

  void TakeRight(Quantity quantity, size_t i) {
    TakeFrom(bodies_[i].right, quantity, &bodies_[i].given);
    bodies_[i].given_parts.clear();
  }

  void AddSentence(const std::string& id, const std::string& sentence, const std::vector<size_t>& links) {
    Finding finding;
    finding.ids = {id};
    finding.one = {sentence};
    Add(std::move(finding), links, kBodyQuantities);
  }

  /// Each body is that of the next joint, or of the one before.
  void FindShiftedLists() {
    for (const int shift : {1, -1}) {
      std::vector<size_t> links;
      const std::vector<size_t> open = ListOpen();
      for (const size_t i : open) {
        const long other = static_cast<long>(i) + shift;
        if (other >= 0 && other < static_cast<long>(bodies_.size()) &&
            IsBodyOf(i, static_cast<size_t>(other)))
          links.push_back(i);
      }
      if (links.size() < kMany || 2 * links.size() < open.size()) continue;  // two may be an exchange
      // The one at the end of the list has no other to be.
      AddSentence(
          "list.shifted",
          fmt::format(
              "the list of bodies looks shifted by one: each link has the body of the {}, {} of {} links",
              shift > 0 ? "next" : "one before", open.size(), count_),
          open);
      for (const size_t i : open) {
        for (const Quantity quantity : kBodyQuantities) TakeRight(quantity, i);
      }
      return;
    }
  }

  void FindExchanges() {
    for (const size_t i : ListOpen()) {
      for (const size_t j : ListOpen()) {
        if (j > i) FindExchange(i, j);
      }
    }
  }

  /// A link as a whole, or its own part without what is welded to it.
  [[nodiscard]] PartView FindOwn(size_t i) const {
    const BodyUndoing undoing(bodies_[i], close_);
    for (const PartView& view : undoing.views()) {
      if (view.is_main) return view;
    }
    return {"", 0, true, bodies_[i].given, bodies_[i].right};
  }

  /// All that is wrong of two links is right of each other.
  void FindExchange(size_t i, size_t j) {
    const PartView a = FindOwn(i);
    const PartView b = FindOwn(j);
    const auto agree = [&](Quantity quantity, const StatedPart& x, const StatedPart& y) {
      return AgreesIn(quantity, x, y, close_.length, close_.tolerance);
    };
    std::vector<Quantity> exchanged;
    bool is_whole = true;
    for (const Quantity quantity : kBodyQuantities) {
      const bool is_wrong = !agree(quantity, a.given, a.right) || !agree(quantity, b.given, b.right);
      const bool is_other = agree(quantity, a.given, b.right) && agree(quantity, b.given, a.right);
      is_whole = is_whole && is_other;
      if (!is_wrong) continue;
      if (!is_other) return;
      exchanged.push_back(quantity);
    }
    if (exchanged.empty()) return;
    static constexpr const char* kIds[] = {"exchange.mass", "exchange.com", "exchange.inertia"};
    std::string what;
    for (const Quantity quantity : exchanged)
      what += (what.empty() ? "" : " and ") + std::string(NameOf(quantity, true));
    AddSentence(is_whole ? "exchange.body" : kIds[static_cast<size_t>(exchanged[0])],
                "links " + bodies_[i].link + " and " + bodies_[j].link + ": their " +
                    (is_whole ? "bodies" : what) + " look exchanged",
                {i, j});
    for (const Quantity quantity : kBodyQuantities) {
      TakeRight(quantity, i);
      TakeRight(quantity, j);
    }
  }

  void FindLostParts() {
    for (const size_t i : ListOpen()) {
      const std::optional<std::string> part = FindLostPart(bodies_[i], close_);
      if (!part) continue;
      AddSentence(
          "part.lost",
          "link " + bodies_[i].link + ": the mass of " + Quote(*part) + ", which is welded to it, looks lost",
          {i});
      for (const Quantity quantity : kBodyQuantities) TakeRight(quantity, i);
    }
  }

  /// What no convention explains is a wrong number.
  void TakeNumbers(Quantity quantity) {
    static constexpr const char* kIds[] = {"number.mass", "number.com", "number.inertia"};
    Finding finding;
    finding.ids = {kIds[static_cast<size_t>(quantity)]};
    finding.one = {std::string("its ") + NameOf(quantity, false) + " is another number"};
    finding.many = {std::string(NameOf(quantity, true)) + " are other numbers"};
    finding.what = "link";
    finding.total = count_;
    for (size_t i = 0; i < bodies_.size(); ++i) {
      if (!IsWrong(bodies_[i], quantity)) continue;
      finding.parts.push_back(bodies_[i].link);
      AddValue(i, {&quantity, 1}, &finding);
      TakeRight(quantity, i);
      taken_.emplace_back(i, quantity);
    }
    finding.cells = finding.parts.size();
    if (finding.cells > 0) numbers_.push_back(std::move(finding));
  }

  const std::vector<LinkBody> read_;
  std::vector<LinkBody>& bodies_;
  Closeness close_;
  size_t count_ = 0;  // links with mass
  std::vector<Finding> found_;
  std::vector<Finding> numbers_;
  std::vector<std::pair<size_t, Quantity>> taken_;  // what these are about
};

}  // namespace

std::vector<Finding> SearchBodies(const Closeness& close, std::vector<LinkBody>* bodies) {
  return BodySearch(close, bodies).Run();
}

}  // namespace dexcheck
